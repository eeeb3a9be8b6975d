# SPDX-License-Identifier: GPL-3.0-or-later
"""What the world's nodes become."""

from __future__ import annotations

import math
from typing import Any

import bpy
import numpy as np
import pytest

from addon.blender.export import environment, finer, pixels, world_nodes
from addon.blender.export.pixels import floats_of
from addon.photon.scene import FOUND_BY
from tests.measure import render

from .build import CUBE, add_mesh, add_node, add_object, finish, gone, new_world, shader_material

pytestmark = pytest.mark.blender


def test_no_world_is_black(export) -> None:
    assert not export()[0].lights


def test_colour_times_strength(scene, export) -> None:
    tree = new_world(scene)
    finish(tree, add_node(tree, "ShaderNodeBackground", Color=(0.1, 0.2, 0.4, 1), Strength=2.0))
    exported, report = export()
    (world,) = exported.lights
    assert (world.kind, world.power) == ("world", pytest.approx((0.2, 0.4, 0.8)))
    assert [e.feature for e in report.of("exact") if "World" in e.object] == ["Background"]


def test_black_world_is_exact(scene, export) -> None:
    tree = new_world(scene)
    finish(tree, add_node(tree, "ShaderNodeBackground", Strength=0.0))
    assert not [e for e in export()[1].of("approximated") if "World" in e.object]


def switched(tree: bpy.types.NodeTree, output: str) -> None:
    """Two greys, of which the second is where Light Path says so."""
    mix = tree.nodes.new("ShaderNodeMixShader")
    for index, level in ((1, 0.1), (2, 0.6)):
        shader = add_node(tree, "ShaderNodeBackground", Color=(level, level, level, 1))
        tree.links.new(shader.outputs[0], mix.inputs[index])
    path = tree.nodes.new("ShaderNodeLightPath")
    tree.links.new(path.outputs[output], mix.inputs[0])
    finish(tree, mix)


@pytest.mark.parametrize(
    ("output", "second", "status"),
    [
        ("Is Camera Ray", {"camera"}, "exact"),
        ("Is Glossy Ray", {"glossy", "chains"}, "exact"),
        ("Is Diffuse Ray", {"diffuse"}, "approximated"),
        ("Ray Length", set(), "approximated"),
    ],
)
def test_light_path(scene, export, output, second, status) -> None:
    """A world of its own for each that finds lights."""
    switched(new_world(scene), output)
    exported, report = export()
    found = {light.power[0]: {*light.found_by} for light in exported.lights}
    first = {*FOUND_BY} - second
    assert found == {near(0.1): first} | ({near(0.6): second} if second else {})
    assert [e.status for e in report.entries if "World" in e.object] == [status]


def near(level: float) -> float:
    return float(np.float32(level))


def test_strength_by_light_path(scene, export) -> None:
    """Through Math nodes, and a group's sockets."""
    tree = new_world(scene)
    path = tree.nodes.new("ShaderNodeLightPath")
    less = add_node(tree, "ShaderNodeMath")
    less.operation = "SUBTRACT"
    less.inputs[0].default_value = 3.0
    tree.links.new(path.outputs["Is Camera Ray"], less.inputs[1])
    finish(tree, add_node(tree, "ShaderNodeBackground", Strength=less.outputs[0]))
    tree.nodes["Background"].inputs["Color"].default_value = (1.0, 0.5, 0.25, 1.0)
    found = {light.found_by: light.power for light in export()[0].lights}
    assert found == {("camera",): (2.0, 1.0, 0.5), FOUND_BY[1:]: (3.0, 1.5, 0.75)}


def test_ray_visibility(scene, export) -> None:
    tree = new_world(scene)
    finish(tree, add_node(tree, "ShaderNodeBackground"))
    scene.world.cycles_visibility.camera = False
    assert export()[0].lights[0].found_by == FOUND_BY[1:]
    scene.world.cycles_visibility.camera = True
    scene.world.cycles_visibility.glossy = False
    assert export()[0].lights[0].found_by == ("camera", "diffuse")


def image_of(pixels: np.ndarray, **options: Any) -> bpy.types.Image:
    height, width = pixels.shape[:2]
    image = bpy.data.images.new("Sky", width, height, **options)
    image.pixels.foreach_set(pixels.astype(np.float32).ravel())
    return image


def with_texture(scene: bpy.types.Scene, image: bpy.types.Image | None) -> bpy.types.Node:
    tree = new_world(scene)
    node = tree.nodes.new("ShaderNodeTexEnvironment")
    node.image = image
    finish(tree, add_node(tree, "ShaderNodeBackground", Color=node.outputs[0], Strength=2.0))
    return node


RANDOM = np.random.default_rng(2).random((8, 16, 4))
RANDOM[..., 3] = 1.0


def test_environment_texture(scene, export) -> None:
    """Its pixels as they are; a Mapping node turns the light."""
    node = with_texture(scene, image_of(RANDOM, float_buffer=True))
    tree = scene.world.node_tree
    place = tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"]
    mapping = add_node(tree, "ShaderNodeMapping", Vector=place, Rotation=(0.0, 0.0, math.pi / 2))
    tree.links.new(mapping.outputs[0], node.inputs[0])
    exported, report = export()
    (light,), (image,) = exported.lights, exported.images
    assert (light.kind, light.power, light.parameters) == ("environment", (2.0,) * 3, {"image": 0})
    np.testing.assert_array_equal(image.pixels, RANDOM[..., :3].astype(np.float32))
    assert light.direction == pytest.approx((0.0, 0.0, 1.0), abs=1e-6)
    # What is at -Y is looked up at +X: in the middle.
    assert light.across == pytest.approx((0.0, -1.0, 0.0), abs=1e-6)
    assert [e.status for e in report.entries if "World" in e.object] == ["exact"]


def test_bytes_are_decoded(scene, export) -> None:
    stored = np.rint(RANDOM * 255) / 255
    with_texture(scene, image_of(stored))
    (image,) = export()[0].images
    low, high = stored / 12.92, ((stored + 0.055) / 1.055) ** 2.4
    linear = np.where(stored <= 0.04045, low, high)[..., :3]
    times = image.pixels.shape[0] // 8
    middles = image.pixels[times // 2 :: times, times // 2 :: times]
    np.testing.assert_allclose(middles, linear, rtol=1e-5, atol=1e-6)


@pytest.mark.thorough("Linear", "Smart")
@pytest.mark.parametrize("interpolation", ["Closest", "Linear", "Cubic", "Smart"])
def test_between_pixels(scene, export, interpolation) -> None:
    """As Cycles finds it there: of coded colours before they are decoded."""
    node = with_texture(scene, image_of(RANDOM))
    node.interpolation = interpolation
    exported, report = export()
    (image,) = exported.images
    height, width = image.pixels.shape[:2]
    expected = world_nodes.evaluate(node, node.outputs[0], (), least=width)
    assert (height, width) == expected.shape[:2] and width >= 1024
    apart = np.abs(image.pixels - expected)
    assert apart.mean() < 3e-3 * expected.mean() and np.percentile(apart, 99.9) < 0.02
    (entry,) = (e for e in report.of("approximated") if "World" in e.object)
    assert interpolation.lower() in entry.detail


@pytest.mark.parametrize(("width", "height"), [(1, 300), (300, 1), (1, 1)])
def test_narrow_images_stay_small(width, height) -> None:
    times = finer.times_finer(width, height)
    found = finer.finer(np.full((height, width, 3), 0.5, np.float32), "Cubic", times)
    assert times % 2 == 1 and max(found.shape) < 2048
    np.testing.assert_allclose(found, 0.5, rtol=1e-6)


def test_large_images_are_finer_by_no_texel(scene, export, monkeypatch) -> None:
    """What is as wide as that is looked up between its own pixels."""
    monkeypatch.setattr(finer, "LENGTH", 16)
    node = with_texture(scene, image_of(RANDOM, float_buffer=True))
    node.interpolation = "Cubic"
    (image,) = export()[0].images
    weights = np.zeros((8, 16))
    weights[np.ix_((-1, 0, 1), (-1, 0, 1))] = np.outer((1, 4, 1), (1, 4, 1)) / 36
    spectrum = np.fft.fft2(RANDOM[..., :3], axes=(0, 1)) * np.fft.fft2(weights)[..., None]
    expected = np.fft.ifft2(spectrum, axes=(0, 1)).real
    np.testing.assert_allclose(image.pixels, expected, rtol=1e-5)


MULTIPLIED = 1.0 if bpy.app.version >= (5, 2) else 0.4  # what Alpha Mode says is so already


@pytest.mark.parametrize(
    ("mode", "factor"),
    [("STRAIGHT", 0.4), ("PREMUL", MULTIPLIED), ("CHANNEL_PACKED", 1.0), ("NONE", 1.0)],
)
def test_bytes_that_let_something_through(scene, export, mode, factor) -> None:
    """Where they are no masks, Cycles multiplies colours by their alpha as they are stored."""
    image = image_of(np.tile((0.8, 0.6, 0.4, 0.4), (8, 16, 1)), alpha=True)
    image.alpha_mode = mode
    with_texture(scene, image)
    exported, _ = export()
    (light,) = exported.lights
    shown = exported.images[0].pixels.mean(axis=(0, 1)) if exported.images else 1.0
    stored = factor * np.array((0.8, 0.6, 0.4))
    expected = np.where(stored <= 0.04045, stored / 12.92, ((stored + 0.055) / 1.055) ** 2.4)
    np.testing.assert_allclose(shown * np.array(light.power), 2.0 * expected, rtol=0.05)


def test_an_image_of_one_colour_is_a_colour(scene, export) -> None:
    with_texture(scene, image_of(np.full((8, 16, 4), 0.25), float_buffer=True))
    exported, _ = export()
    assert not exported.images and exported.lights[0].power == (0.5,) * 3


def test_missing_image_is_magenta(scene, export) -> None:
    with_texture(scene, None)
    exported, report = export()
    assert exported.lights[0].power == (2.0, 0.0, 2.0)
    assert "magenta" in next(e.detail for e in report.of("approximated") if "World" in e.object)


def test_alpha_of_a_missing_image_is_one(scene, export) -> None:
    tree = new_world(scene)
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image = gone()
    alpha = add_node(tree, "ShaderNodeMath", Value=texture.outputs["Alpha"])
    alpha.operation = "SINE"
    finish(tree, add_node(tree, "ShaderNodeBackground", Color=alpha.outputs[0]))
    exported, _ = export()
    assert exported.lights[0].power == pytest.approx((math.sin(1.0),) * 3, rel=1e-3)


@pytest.mark.parametrize("kind", ["ShaderNodeTexEnvironment", "ShaderNodeTexImage"])
def test_missing_image_behind_nodes_is_magenta(scene, export, kind) -> None:
    """They are evaluated as for one pixel of it."""
    tree = new_world(scene)
    texture = tree.nodes.new(kind)
    texture.image = gone()
    turned = add_node(tree, "ShaderNodeHueSaturation", Saturation=0.5, Color=texture.outputs[0])
    node = add_node(tree, "ShaderNodeBackground", Color=turned.outputs[0], Strength=2.0)
    finish(tree, node)
    exported, report = export()
    assert exported.lights[0].power == pytest.approx((2.0, 1.0, 2.0), rel=1e-3)
    assert "magenta" in next(e.detail for e in report.of("approximated") if "World" in e.object)


@pytest.mark.parametrize(
    ("kind", "output", "expected"),
    [
        ("ShaderNodeVertexColor", "Color", 0.0),
        ("ShaderNodeAttribute", "Alpha", 1.0),
        ("ShaderNodeObjectInfo", "Random", 0.0),
        pytest.param("ShaderNodeUVMap", "UV", 0.0, marks=pytest.mark.thorough),
        pytest.param("ShaderNodeParticleInfo", "Age", 0.0, marks=pytest.mark.thorough),
    ],
)
def test_what_surfaces_have(scene, export, kind, output, expected) -> None:
    """Nothing of it, as in Cycles."""
    tree = new_world(scene)
    away = add_node(tree, "ShaderNodeInvert", Color=tree.nodes.new(kind).outputs[output])
    finish(tree, add_node(tree, "ShaderNodeBackground", Color=away.outputs[0], Strength=2.0))
    exported, _ = export()
    found = exported.lights[0].power if exported.lights else (0.0,) * 3
    assert found == pytest.approx((2.0 - 2.0 * expected,) * 3, abs=1e-3)
    assert not exported.images


def test_large_images_become_smaller(scene, export, monkeypatch) -> None:
    monkeypatch.setattr(environment, "MOST_PIXELS", 32)
    with_texture(scene, image_of(RANDOM, float_buffer=True))
    exported, report = export()
    expected = RANDOM[..., :3].reshape(4, 2, 8, 2, 3).mean(axis=(1, 3))
    np.testing.assert_allclose(exported.images[0].pixels, expected, rtol=1e-6)
    (detail,) = (e.detail for e in report.of("approximated") if "World" in e.object)
    assert "2 x 2 of its 16x8 pixels" in detail and "GB" in detail


def test_sky_texture(scene, export) -> None:
    """As an image; the same one as long as its values stay."""
    tree = new_world(scene)
    sky = tree.nodes.new("ShaderNodeTexSky")
    sky.sky_type = "PREETHAM"
    finish(tree, add_node(tree, "ShaderNodeBackground", Color=sky.outputs[0]))
    first, report = export()
    assert first.lights[0].kind == "environment" and first.images[0].pixels.shape[1] >= 1024
    assert "Sky" in next(e.feature for e in report.of("approximated") if "World" in e.object)
    tree.nodes["Background"].inputs["Strength"].default_value = 3.0
    second = export()[0]
    assert second.images[0].pixels is first.images[0].pixels
    assert second.lights[0].power == (3.0,) * 3


def test_curves(scene, export) -> None:
    """Blender evaluates them as they are."""
    tree = new_world(scene)
    place = tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"]
    curves = add_node(tree, "ShaderNodeRGBCurve", Color=place)
    curves.mapping.curves[3].points[1].location = (1.0, 0.5)
    curves.mapping.update()
    finish(tree, add_node(tree, "ShaderNodeBackground", Color=curves.outputs[0]))
    (image,) = export()[0].images
    assert image.pixels.max(axis=(0, 1)) == pytest.approx([0.5] * 3, abs=0.01)


@pytest.mark.thorough("Camera")
@pytest.mark.parametrize("name", ["Camera", "Window", "Object"])
def test_coordinates_that_something_places(scene, export, device, cycles, name) -> None:
    """The camera and an object; seen in a mirror, for Cycles' film is transparent."""
    mirror = shader_material("ShaderNodeBsdfGlossy", Roughness=0.0, Color=(1, 1, 1, 1))
    add_mesh("Mirror", scale=(20, 20, 1)).data.materials.append(mirror)
    scene.camera.rotation_euler = 0.7, 0.2, 0.4
    scene.camera.data.shift_x = 0.1
    placed = {"location": (1, 2, 3), "rotation_euler": (0.3, 1.0, 0.2), "scale": (3, 2, 1)}
    tree = new_world(scene)
    place = tree.nodes.new("ShaderNodeTexCoord")
    place.object = add_object("Empty", None, **placed)
    scaled = tree.nodes.new("ShaderNodeVectorMath")
    scaled.operation = "MULTIPLY_ADD"
    tree.links.new(place.outputs[name], scaled.inputs[0])
    scaled.inputs[1].default_value, scaled.inputs[2].default_value = (0.4,) * 3, (0.5,) * 3
    finish(tree, add_node(tree, "ShaderNodeBackground", Color=scaled.outputs[0]))
    exported, report = export()
    found = {entry.feature for entry in report.of("approximated")} - {"Negative light"}
    assert not report.of("ignored") and len(found) == 1
    ours = render(device, exported, width=64, height=32, passes=8, photons=0)["Combined"]
    theirs = cycles()
    assert theirs[..., 3].min() == 1.0
    assert np.ptp(theirs[..., :3], axis=(0, 1)).max() > 0.05
    # Light is not negative here. At right angles to the view a window is infinite.
    known = np.abs(theirs[..., :3]) < 1.5
    off = np.abs(ours[..., :3] - theirs[..., :3].clip(0.0))[known]
    assert known.mean() > 0.4 and np.percentile(off, 95) < 0.01


def test_a_window_without_perspective(scene, export) -> None:
    """All its pixels look in one direction."""
    scene.camera.data.type = "ORTHO"
    tree = new_world(scene)
    place = tree.nodes.new("ShaderNodeTexCoord")
    finish(tree, add_node(tree, "ShaderNodeBackground", Color=place.outputs["Window"]))
    (entry,) = (e for e in export()[1].of("ignored") if "World" in e.object)
    assert "tells more than a direction" in entry.detail


@pytest.mark.thorough("120.0-2048")
@pytest.mark.parametrize(("scale", "width"), [(1.0, 1024), (120.0, 2048)])
def test_fine_skies_have_more_pixels(scene, export, scale, width) -> None:
    """Stars, beside clouds."""
    tree = new_world(scene)
    cells = add_node(tree, "ShaderNodeTexVoronoi", Scale=scale)
    root = add_node(tree, "ShaderNodeGamma", Color=cells.outputs["Distance"], Gamma=4.0)
    finish(tree, add_node(tree, "ShaderNodeBackground", Color=root.outputs[0]))
    (image,) = export()[0].images
    assert image.pixels.shape == (width // 2, width, 3)


def test_images_of_one_channel_are_grey(scene, export, monkeypatch) -> None:
    """In nodes that Blender evaluates."""
    monkeypatch.setattr(pixels, "floats_of", lambda image: floats_of(image)[..., :1])
    tree = new_world(scene)
    node = tree.nodes.new("ShaderNodeTexEnvironment")
    node.image = image_of(RANDOM, float_buffer=True)
    root = add_node(tree, "ShaderNodeGamma", Color=node.outputs[0], Gamma=0.5)
    finish(tree, add_node(tree, "ShaderNodeBackground", Color=root.outputs[0]))
    (image,) = export()[0].images
    assert np.ptp(image.pixels, axis=2).max() < 1e-6
    assert image.pixels.mean() == pytest.approx(np.sqrt(RANDOM[..., 0]).mean(), rel=0.05)


def test_what_cannot_be_evaluated_is_named(scene, export, monkeypatch) -> None:
    """By the node that asks for more than a direction, or by what Blender said."""
    tree = new_world(scene)
    sky = tree.nodes.new("ShaderNodeTexSky")
    sky.sky_type = "PREETHAM"
    path = tree.nodes.new("ShaderNodeLightPath")
    power = add_node(tree, "ShaderNodeGamma", Color=sky.outputs[0], Gamma=path.outputs["Ray Depth"])
    finish(tree, add_node(tree, "ShaderNodeBackground", Color=power.outputs[0]))
    (entry,) = (e for e in export()[1].of("ignored") if "World" in e.object)
    assert "Gamma" in entry.feature and "'Light Path'" in entry.detail
    tree.links.remove(power.inputs["Gamma"].links[0])
    monkeypatch.setattr(world_nodes, "TIMEOUT", 1e-3)
    (entry,) = (e for e in export()[1].of("ignored") if "World" in e.object)
    assert "Blender could not evaluate it" in entry.detail and "timed out" in entry.detail


LONG = pytest.mark.thorough
DISCS = [
    ("MULTIPLE_SCATTERING", 0.545),
    pytest.param("MULTIPLE_SCATTERING", 4.0, marks=LONG),
    pytest.param("SINGLE_SCATTERING", 1.5, marks=LONG),
    ("NISHITA", 0.545),
]


@pytest.mark.parametrize(("kind", "size"), DISCS)
def test_the_disc_of_a_sky_is_a_sun(scene, export, device, cycles_mean, kind, size) -> None:
    """Where Cycles has it, as bright, and its shadows as sharp; by direct light alone."""
    sky = new_world(scene).nodes.new("ShaderNodeTexSky")
    if kind not in sky.bl_rna.properties["sky_type"].enum_items:
        pytest.skip(f"this Blender has no sky {kind}")
    tree = scene.world.node_tree
    sky.sky_type, sky.sun_size = kind, math.radians(size)
    sky.sun_elevation, sky.sun_rotation = 0.7, 0.9
    finish(tree, add_node(tree, "ShaderNodeBackground", Color=sky.outputs[0], Strength=0.3))
    add_mesh("Plane").scale = (9, 9, 1)
    add_mesh("Cube", CUBE, location=(0.4, 0.2, 1.0))
    exported, report = export()
    suns = [light for light in exported.lights if light.kind == "sun"]
    assert len(suns) == 1 and "disc" in next(e.detail for e in report.of("approximated"))
    ours = render(device, exported, width=64, height=32, passes=64, photons=0)["Combined"]
    scene.cycles.max_bounces = 0
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BOX", 1.0
    theirs = cycles_mean(128, 1)
    blocks = [image[..., :3].reshape(8, 4, 16, 4, 3).mean(axis=(1, 3)) for image in (ours, theirs)]
    apart = np.abs(blocks[0] / blocks[1] - 1.0)
    assert np.median(apart) < 0.01 and np.percentile(apart, 95) < 0.03
