# SPDX-License-Identifier: GPL-3.0-or-later
"""Coats, sheen and rough diffuse surfaces against Cycles: balls under two suns. Neither picture has
any noise but that of where in a pixel it looks, and ours that of which lobes a point has."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest
from numpy.typing import NDArray

from addon.blender.export import snapshot
from addon.photon.prepare import prepare as renderer_of
from addon.photon.settings import Settings
from addon.streams import Device
from tests.blender.build import add_light, add_node, finish, new_material

from .blocks import BLOCK, block_means, compare_means
from .cycles import prepare, read_exr

pytestmark = pytest.mark.blender

PIXELS = 32  # of a ball
SAMPLES, PASSES = 160, 48
# Relative, of blocks; HIGH at their 95th percentile. Normals that lean, and toon, have edges.
MEDIAN, HIGH = 0.01, {"layers": 0.03, "edged": 0.05}
MEAN = 0.01  # of a ball
# Passes of a ball of which one lobe of four is taken by chance.
NOISY = {"all": 768}
PAINT = {"Base_Color": (0.8, 0.25, 0.1, 1.0), "Roughness": 0.5}
METAL = {"Base_Color": (0.9, 0.7, 0.4, 1.0), "Roughness": 0.4, "Metallic": 1.0}
COAT = {"Coat_Weight": 1.0, "Coat_Roughness": 0.2}
SHEEN = {"Sheen_Weight": 1.0, "Sheen_Tint": (0.5, 0.8, 1.0, 1.0)}
BLUE = (0.3, 0.5, 0.9, 1.0)
# Principled over its sockets.
BALLS: dict[str, dict[str, Any]] = {
    "plain": PAINT,
    "coat": PAINT | COAT,
    "half a coat, broad": PAINT | COAT | {"Coat_Weight": 0.5, "Coat_Roughness": 0.7},
    "tinted coat": PAINT | COAT | {"Coat_Tint": BLUE, "Coat_IOR": 2.0},
    "half a tinted coat": PAINT | COAT | {"Coat_Tint": BLUE, "Coat_Weight": 0.5},
    "coated metal": METAL | COAT | {"Coat_Tint": BLUE},
    "coated base": PAINT | COAT | {"Specular_IOR_Level": 0.0, "Coat_Tint": BLUE},
    "coat of index 1": PAINT | COAT | {"Coat_IOR": 1.0, "Coat_Tint": BLUE},
    "half metal, coated": METAL | COAT | {"Metallic": 0.5},
    "sheen": PAINT | SHEEN,
    "smooth sheen": PAINT | SHEEN | {"Sheen_Roughness": 0.25},
    "rough sheen": PAINT | SHEEN | {"Sheen_Roughness": 1.0, "Sheen_Weight": 0.5},
    "sheen on metal": METAL | SHEEN,
    "sheen on a coat": PAINT | COAT | SHEEN,
    "all": PAINT | COAT | SHEEN | {"Coat_Tint": BLUE, "Diffuse_Roughness": 1.0, "Metallic": 0.3},
    "rough": PAINT | {"Diffuse_Roughness": 1.0},
    "half rough": PAINT | {"Diffuse_Roughness": 0.5, "Base_Color": (1.0, 1.0, 1.0, 1.0)},
    "rough, coated": PAINT | COAT | {"Diffuse_Roughness": 1.0, "Coat_Tint": BLUE},
    "specular tint": PAINT | {"Specular_Tint": BLUE, "IOR": 2.0},
    "specular level": PAINT | {"Specular_IOR_Level": 0.9, "Specular_Tint": BLUE},
    "metal's tint": METAL | {"Specular_Tint": BLUE},
    "anisotropic, coated": PAINT | COAT | {"Anisotropic": 0.8, "IOR": 2.5},
}
BENT = {"bent below a coat": "Normal", "bent coat": "Coat Normal"}  # balls' inputs
OTHERS: dict[str, tuple[str, dict[str, Any], str]] = {
    "Diffuse": ("ShaderNodeBsdfDiffuse", {"Color": BLUE, "Roughness": 0.7}, ""),
    "Sheen": ("ShaderNodeBsdfSheen", {"Color": BLUE, "Roughness": 0.6}, "MICROFIBER"),
    "Velvet": ("ShaderNodeBsdfSheen", {"Color": BLUE, "Roughness": 0.6}, "ASHIKHMIN"),
}


TOON = {"toon": "DIFFUSE", "glossy toon": "GLOSSY"}  # balls' components
SHEETS = {"layers": [*BALLS, *OTHERS], "edged": [*BENT, *TOON]}


def materials(names: Sequence[str]) -> dict[str, bpy.types.Material]:
    found = {}
    for name in names:
        material, tree = new_material(name)
        kind, inputs, distribution = OTHERS.get(
            name, ("ShaderNodeBsdfPrincipled", BALLS.get(name, PAINT | COAT), "")
        )
        node = add_node(tree, kind, **inputs)
        if name in TOON:
            node = add_node(tree, "ShaderNodeBsdfToon", Color=BLUE, Size=0.6, Smooth=0.2)
            node.component = TOON[name]
        if distribution:
            node.distribution = distribution
        if name in BENT:
            normal = tree.nodes.new("ShaderNodeNewGeometry").outputs["Normal"]
            lean = add_node(tree, "ShaderNodeVectorMath")
            tree.links.new(normal, lean.inputs[0])
            lean.inputs[1].default_value = (0.3, -0.2, 0.0)
            tree.links.new(lean.outputs[0], node.inputs[BENT[name]])
        finish(tree, node)
        found[name] = material
    return found


def open_balls(names: Sequence[str]) -> int:
    """Rows of them from below, seen from far above; two lamps, one of them low. How many are in a
    row."""
    side = math.ceil(math.sqrt(len(names)))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    data = bpy.data.cameras.new("Camera")
    data.type, data.ortho_scale = "ORTHO", 2.0 * side
    camera = bpy.data.objects.new("Camera", data)
    camera.location = (0.0, 0.0, 10.0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.resolution_x = scene.render.resolution_y = side * PIXELS
    worn = materials(names)
    for number, material in enumerate(worn.values()):
        row, column = divmod(number, side)
        place = (2.0 * column - side + 1.0, 2.0 * row - side + 1.0, 0.0)
        bpy.ops.mesh.primitive_uv_sphere_add(
            segments=48, ring_count=24, radius=0.9, location=place, calc_uvs=False
        )
        bpy.context.object.data.shade_smooth()
        bpy.context.object.data.materials.append(material)
    add_light("High", "SUN", energy=2.0, angle=0.0, rotation_euler=(0.5, 0.3, 0.0))
    low = {"rotation_euler": (0.2, -1.25, 0.4), "angle": 0.0}
    add_light("Low", "SUN", energy=3.0, color=(1.0, 0.7, 0.5), **low)
    return side


def by_cycles() -> NDArray[np.float32]:
    """(h, w, 3) of the open scene."""
    scene = bpy.context.scene
    prepare(scene, SAMPLES, 1)
    scene.cycles.max_bounces = 0
    with tempfile.TemporaryDirectory() as folder:
        scene.render.filepath = str(Path(folder) / "cycles.exr")
        bpy.ops.render.render(write_still=True)
        return read_exr(Path(scene.render.filepath))


def by_us(
    device: Device, side: int, region: tuple[int, int, int, int] | None = None, passes: int = PASSES
) -> NDArray[np.float32]:
    """The same of ours, or a region of it."""
    exported, report = snapshot(bpy.context.evaluated_depsgraph_get())
    lost = [e for e in report.entries if e.status != "exact" and e.object.startswith("Material")]
    assert not lost, lost
    settings = Settings(
        width=side * PIXELS,
        height=side * PIXELS,
        passes=passes,
        region=region,
        photons=0,
        mirror_depth=0,
        backend="fragment",
    )
    renderer = renderer_of(exported, settings, device)
    try:
        for _ in range(passes):
            renderer.render_pass()
        return renderer.images()["Combined"][..., :3]
    finally:
        renderer.release()


@pytest.mark.skipif(bpy.app.version < (5, 0), reason="Cycles had another sheen and another coat")
@pytest.mark.parametrize("sheet", SHEETS)
def test_balls(device: Device, record_property: Callable[[str, object], None], sheet: str) -> None:
    across = open_balls(names := SHEETS[sheet])
    reference, ours = block_means(by_cycles()), block_means(by_us(device, across))
    lit = reference.mean(axis=-1) > 0.02
    side, means = PIXELS // BLOCK, {}
    for number, name in enumerate(names):
        row, column = divmod(number, across)
        ball = np.s_[row * side : (row + 1) * side, column * side : (column + 1) * side]
        seen = ours[ball]
        if name in NOISY:
            corner = column * PIXELS, row * PIXELS
            region = *corner, *(end + PIXELS for end in corner)
            seen = by_us(device, across, region, NOISY[name])
        means[name] = float(seen.mean() / reference[ball].mean() - 1.0)
        found = compare_means(ours[ball], reference[ball], lit[ball])
        print(f"{name}: mean {means[name]:+.2%}, {found.median:.2%}, {found.high:.2%}")
    found = compare_means(ours, reference, lit)
    record_property("median", f"{found.median:.2%}")
    record_property("high", f"{found.high:.2%}")
    print(f"all: {found.median:.2%}, 95th {found.high:.2%}, mean {found.bias:+.2%}")
    assert lit.mean() > 0.5 * len(names) / across**2
    assert found.median <= MEDIAN and found.high <= HIGH[sheet]
    assert not [name for name, mean in means.items() if abs(mean) > MEAN]
