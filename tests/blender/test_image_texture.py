# SPDX-License-Identifier: GPL-3.0-or-later
"""Image textures: each way to store, interpolate, extend and project one, as Cycles has it."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import product
from pathlib import Path
from typing import Any

import bmesh
import bpy
import numpy as np
import pytest
from numpy.typing import NDArray

from addon.photon.scene import Scene
from tests.measure import render

from .build import add_light, add_node, add_object, finish
from .image_files import write, write_exr, write_png
from .image_panels import HEIGHT, RANDOM, SPAN, WIDTH, load, noise, quad, textured

pytestmark = [pytest.mark.blender, pytest.mark.usefixtures("nothing_kept")]

SIDE = 16  # [px] of a panel's picture
SAMPLES = 144
EXTENSIONS = ("REPEAT", "EXTEND", "CLIP", "MIRROR")
MODES = ("STRAIGHT", "PREMUL", "CHANNEL_PACKED", "NONE")

Panels = dict[str, bpy.types.Material]  # by what they show
Compare = Callable[..., tuple[Scene, list[str]]]


@pytest.fixture
def stage(scene: bpy.types.Scene) -> bpy.types.Scene:
    """A sun that makes the radiance of what faces up its albedo, and a camera above."""
    add_light("Sun", "SUN", energy=math.pi, angle=0.0)
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BOX", 1.0
    return scene


def with_alpha(image: bpy.types.Image, what: str) -> bpy.types.Material:
    """Its alpha as a colour; or with a little of it, so that both are asked for."""
    material, node = textured(image, interpolation="Closest")
    tree = material.node_tree
    diffuse = next(n for n in tree.nodes if n.type == "BSDF_DIFFUSE")
    if what == "alpha":
        tree.links.new(node.outputs["Alpha"], diffuse.inputs["Color"])
    elif what == "both":
        tiny = add_node(tree, "ShaderNodeMath")
        tiny.operation = "MULTIPLY_ADD"
        tree.links.new(node.outputs["Alpha"], tiny.inputs[0])
        tiny.inputs[1].default_value = 1e-5
        tree.links.new(node.outputs["Color"], tiny.inputs[2])
        tree.links.new(tiny.outputs[0], diffuse.inputs["Color"])
    return material


@pytest.fixture
def compare(stage, cycles_mean, export, device) -> Compare:
    """Render panels beside each other with both: 99 % of each one's pixels within 1 %. The scene,
    and what its report lacks."""

    def run(panels: Panels, span: tuple[float, float] = SPAN) -> tuple[Scene, list[str]]:
        columns = math.ceil(math.sqrt(len(panels)))
        rows = math.ceil(len(panels) / columns)
        for number, material in enumerate(panels.values()):
            row, column = divmod(number, columns)
            quad(material, (2 * column + 1 - columns, 2 * row + 1 - rows), span)
        width, height = SIDE * columns, SIDE * rows
        stage.render.resolution_x, stage.render.resolution_y = width, height
        stage.camera.data.type = "ORTHO"
        stage.camera.data.ortho_scale = 2.0 * max(columns, rows)
        ours, theirs, scene, lost = both(stage, cycles_mean, export, device)
        wrong = {}
        for number, name in enumerate(panels):
            row, column = divmod(number, columns)
            part = np.s_[row * SIDE : (row + 1) * SIDE, column * SIDE : (column + 1) * SIDE]
            share = equal_share(ours[part], theirs[part])
            if share < 0.99 or abs(ours[part].mean() / theirs[part].mean() - 1.0) > 0.003:
                wrong[name] = share, ours[part].mean(), theirs[part].mean()
        assert not wrong, wrong
        return scene, lost

    return run


def both(stage: Any, cycles_mean: Any, export: Any, device: Any) -> tuple[Any, Any, Scene, Any]:
    """Our picture and Cycles', (h, w, 3), the scene, and what is not exact in it."""
    scene, report = export()
    size = {"width": stage.render.resolution_x, "height": stage.render.resolution_y}
    ours = render(device, scene, transparent=True, photons=0, passes=SAMPLES, **size)["Combined"]
    theirs = cycles_mean(SAMPLES, 0)
    lost = [str(x) for x in report.entries if x.status != "exact"]
    return ours[..., :3], theirs[..., :3], scene, lost


def equal_share(ours: NDArray[Any], theirs: NDArray[Any]) -> float:
    """Of pixels, within 1 % of the brightest."""
    return float((np.abs(ours - theirs) <= 0.01 * theirs.max()).all(axis=-1).mean())


def test_interpolation_and_extension(compare, tmp_path) -> None:
    image = load(write_png(tmp_path / "a.png", noise(np.uint8, 3)))
    options = product(("Linear", "Closest", "Cubic", "Smart"), EXTENSIONS)
    scene, lost = compare(
        {f"{i} {e}": textured(image, interpolation=i, extension=e)[0] for i, e in options}
    )
    assert not lost and len(scene.textures) == 2  # what clips knows an outside


def test_files(compare, tmp_path) -> None:
    """Bytes stay bytes, and what has one channel is stored as one."""
    panels, expected = {}, []
    types = [
        *product((np.uint8, np.uint16), (1, 2, 3, 4)),
        *product((np.float16, np.float32), (1, 4)),
    ]
    for (dtype, channels), packed in product(types, (False, True)):
        name = f"{np.dtype(dtype).name} {channels} {packed}"
        image = load(
            write(tmp_path / name.replace(" ", "_"), noise(dtype, channels)), packed=packed
        )
        panels[name] = textured(image)[0]
        is_half = np.dtype(dtype).kind == "f" or (packed and dtype == np.uint16)
        expected.append((np.float16 if is_half else dtype, 1 if channels == 1 else 4))
    scene, lost = compare(panels)
    assert [(t.pixels.dtype, t.pixels.shape[2]) for t in scene.textures] == expected and not lost


def test_alpha(compare, tmp_path) -> None:
    """Colours that are multiplied by it; and together with their alpha, which divides them."""
    panels = {}
    for dtype, mode, packed in product((np.uint8, np.uint16, np.float32), MODES, (False, True)):
        some = noise(dtype, 4)
        most = 1 if some.dtype.kind == "f" else np.iinfo(dtype).max
        some[..., :3] = (some[..., :3].astype(float) * some[..., 3:] / most).astype(dtype)
        if mode == "PREMUL" and dtype == np.uint8:  # Blender rounds what it divides by alpha
            some[..., 3] = 255
            some[0, 0] = 0  # and makes something white of colours where it is 0
        if most > 1:  # of floats Blender forgets the colours there
            some[0, 0, 3] = 0
        name = f"{np.dtype(dtype).name} {mode} {packed}"
        path = write(tmp_path / name.replace(" ", "_"), some)
        image = load(path, alpha_mode=mode, packed=packed)
        panels |= {
            f"{name} {what}": with_alpha(image, what) for what in ("colour", "alpha", "both")
        }
    compare(panels)


SPACES = ("Non-Color", "Linear Rec.709", "sRGB", "Filmic Log", "AgX Base sRGB", "ACEScg")
SPACES += ("Linear CIE-XYZ D65", "Rec.1886", "Display P3")


def test_colour_spaces(compare, tmp_path) -> None:
    """By Blender's own configuration, of colours that surfaces have."""
    panels = {}
    for dtype, space, packed in product((np.uint8, np.uint16), SPACES, (False, True)):
        name = f"{np.dtype(dtype).name} {space} {packed}"
        some = noise(dtype, 3, 0.45, 0.6)
        image = load(write(tmp_path / name.replace(" ", "_"), some), space=space, packed=packed)
        panels[name] = textured(image, interpolation="Closest")[0]
    _, lost = compare(panels)
    assert not lost


@pytest.mark.parametrize(
    ("projection", "blend"),
    [
        *[("BOX", 0.0), ("BOX", 0.4), ("BOX", 1.0), ("SPHERE", 0), ("TUBE", 0)],
        *[("EQUIRECTANGULAR", 0), ("MIRROR_BALL", 0)],
    ],
)
def test_projections(
    stage, cycles_mean, export, device, tmp_path, projection: str, blend: float
) -> None:
    """On a smooth ball that is turned and stretched, by its generated coordinates."""
    image = load(write_png(tmp_path / "a.png", noise(np.uint8, 3)))
    if projection in ("EQUIRECTANGULAR", "MIRROR_BALL"):
        material, node = textured(image, "ShaderNodeTexEnvironment", projection=projection)
    else:
        material, node = textured(image, projection=projection, projection_blend=blend)
    where = add_node(material.node_tree, "ShaderNodeTexCoord")
    material.node_tree.links.new(where.outputs["Generated"], node.inputs["Vector"])
    mesh, built = bpy.data.meshes.new("Ball"), bmesh.new()
    bmesh.ops.create_icosphere(built, subdivisions=4, radius=1.0)
    built.to_mesh(mesh)
    built.free()
    mesh.shade_smooth()
    mesh.materials.append(material)
    add_object("Ball", mesh, rotation_euler=(0.7, 0.4, 1.1), scale=(1.6, 1.9, 1.4))
    stage.render.resolution_x = stage.render.resolution_y = 40
    stage.camera.data.type, stage.camera.data.ortho_scale = "ORTHO", 1.2
    ours, theirs, _, lost = both(stage, cycles_mean, export, device)
    # Edges of texels and faces are sharp, and their share of a pixel has noise.
    assert equal_share(ours, theirs) > 0.97 and not lost
    assert ours.mean() == pytest.approx(theirs.mean(), rel=1e-3)


def udim(folder: Path, numbers: tuple[int, ...], packed: bool = False) -> bpy.types.Image:
    """An image of tiles, of which one has another size."""
    for number in numbers:
        some = noise(np.uint8, 3)
        write_png(folder / f"tile.{number}.png", some[:1] if number == 1002 else some)
    image = load(folder / f"tile.{numbers[0]}.png")
    image.source = "TILED"
    assert [tile.number for tile in image.tiles] == [*numbers]
    if packed:
        image.pack()
    return image


@pytest.mark.stability(71)
def test_tiles(compare, tmp_path) -> None:
    """Each in its cell, whatever its size; where there is none, magenta."""
    (tmp_path / "files").mkdir()
    (tmp_path / "packed").mkdir()
    files = udim(tmp_path / "files", (1001, 1002, 1011))
    packed = udim(tmp_path / "packed", (1001, 1002, 1011), packed=True)
    gone = udim(tmp_path, (1001, 1002))
    (tmp_path / "tile.1002.png").unlink()
    images = {"files": files, "packed": packed, "gone": gone}
    panels = {}
    for name, interpolation in product(images, ("Closest", "Linear")):
        material, node = textured(images[name], interpolation=interpolation)
        # Cycles looks at the corners' UV coordinates, and forgets tiles between them, unless a
        # node moves these.
        moved = add_node(material.node_tree, "ShaderNodeVectorMath")
        where = add_node(material.node_tree, "ShaderNodeTexCoord")
        material.node_tree.links.new(where.outputs["UV"], moved.inputs[0])
        material.node_tree.links.new(moved.outputs[0], node.inputs["Vector"])
        panels[f"{name} {interpolation}"] = material
    scene, lost = compare(panels)
    assert [t.tile for t in scene.textures] == [1001, 1002, 1011] * 2 + [1001, 1002]
    (note,) = {text.split(": ", 1)[1].split(": ", 1)[1] for text in lost}
    assert "tile 1002" in note and "magenta" in note


@pytest.mark.stability(71)
def test_odd_images(compare, tmp_path) -> None:
    """None at all, one without a file, of one texel, painted and not saved, generated, of a
    sequence's third frame, with texels that are not finite."""
    missing = load(write_png(tmp_path / "gone.png", noise(np.uint8, 3)))
    (tmp_path / "gone.png").unlink()
    missing.reload()
    painted = bpy.data.images.new("painted", WIDTH, HEIGHT)
    painted.pixels.foreach_set(RANDOM.uniform(0.6, 0.8, WIDTH * HEIGHT * 4).astype(np.float32))
    grid = bpy.data.images.new("grid", 8, 8)
    grid.generated_type = "UV_GRID"
    bright = bpy.data.images.new("bright", WIDTH, HEIGHT, float_buffer=True)
    bright.pixels.foreach_set(RANDOM.uniform(0.4, 0.8, WIDTH * HEIGHT * 4).astype(np.float32))
    for frame in range(1, 5):
        write_png(tmp_path / f"f{frame:03d}.png", noise(np.uint8, 3))
    sequence = load(tmp_path / "f001.png", source="SEQUENCE")
    images = {
        "none": None,
        "missing": missing,
        "one": load(write_png(tmp_path / "one.png", noise(np.uint8, 3)[:1, :1])),
        "painted": painted,
        "grid": grid,
        "float": bright,
        "sequence": sequence,
    }
    panels = {}
    for name, image in images.items():
        for extension in ("REPEAT", "CLIP"):
            material, node = textured(image, extension=extension, interpolation="Closest")
            if name == "sequence":
                node.image_user.frame_duration, node.image_user.frame_offset = 4, 1
            panels[f"{name} {extension}"] = material
    bpy.context.scene.frame_set(2)
    scene, lost = compare(panels)
    assert len(lost) == 4 and all("magenta" in text for text in lost)
    assert sum("no image is chosen" in text for text in lost) == 2
    assert sum(f"is missing ({tmp_path / 'gone.png'})" in text for text in lost) == 2
    # What is the same everywhere is a constant, and no texture.
    clipped = 1 if bpy.app.version >= (5, 2) else 3  # of a missing one there is no outside since
    assert len(scene.textures) == clipped + 2 * 4


def test_emission(compare, tmp_path) -> None:
    """Radiance of any size, of floats."""
    image = load(write_exr(tmp_path / "bright.exr", noise(np.float32, 3, 20.0, 40.0)))
    material, node = textured(image)
    tree = material.node_tree
    finish(tree, add_node(tree, "ShaderNodeEmission", Color=node.outputs["Color"]))
    _, lost = compare({"emission": material})
    assert len(lost) == 1 and "as a light by cells of each triangle" in lost[0]


def test_texture_limit(compare, stage, tmp_path) -> None:
    """Simplify's, as Cycles halves what is larger."""
    stage.render.use_simplify, stage.cycles.texture_limit_render = True, "128"
    sizes = {"even": (512, 256), "odd": (259, 130), "thin": (1, 300), "small": (128, 128)}
    panels = {}
    for name, (width, height) in sizes.items():
        x, y = np.meshgrid(np.arange(width) * 2 // width, np.arange(height) * 2 // height)
        some = np.stack([150 + 60 * x, 200 - 50 * y, 180 + 40 * (x ^ y)], -1).astype(np.uint8)
        image = load(write_png(tmp_path / f"{name}.png", some))
        panels[name] = textured(image)[0]
    scene, lost = compare(panels, span=(0.0, 1.0))
    shapes = [texture.pixels.shape[1::-1] for texture in scene.textures]
    assert shapes == [(128, 64), (64, 32), (1, 75), (128, 128)]
    assert len(lost) == 3 and all("Simplify's texture limit" in text for text in lost)
