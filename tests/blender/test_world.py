# SPDX-License-Identifier: GPL-3.0-or-later
"""What the world's nodes become."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest

from addon.blender.export import world_nodes
from addon.photon.scene import FOUND_BY
from tests.measure import render

from .build import (
    CUBE,
    add_mesh,
    add_node,
    add_object,
    finish,
    new_material,
    new_world,
    shader_material,
)

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
        ("Is Glossy Ray", {*FOUND_BY} - {"camera", "diffuse", "translucent", "media"}, "exact"),
        ("Is Transmission Ray", {"transmission", "translucent", "passing"}, "approximated"),
        ("Is Reflection Ray", {"diffuse", "glossy", "chains"}, "approximated"),
        ("Is Diffuse Ray", {"diffuse", "translucent"}, "approximated"),
        ("Is Volume Scatter Ray", {"media"}, "approximated"),
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
    found = ("camera", "diffuse", "transmission", "translucent", "media", "passing")
    assert export()[0].lights[0].found_by == found
    scene.world.cycles_visibility.transmission = False
    assert export()[0].lights[0].found_by == ("camera", "diffuse", "media")
    scene.world.cycles_visibility.scatter = False
    assert export()[0].lights[0].found_by == ("camera", "diffuse")


@pytest.mark.parametrize("hidden", [(), ("glossy",), ("transmission",), ("glossy", "transmission")])
@pytest.mark.parametrize(
    ("kind", "roughness"),
    [("Glass", 0.0), ("Glass", 0.5), ("Refraction", 0.5), ("Glossy", 0.3), ("Translucent", None)],
)
def test_a_world_that_some_rays_do_not_find(
    scene, export, cycles_mean, device, kind, roughness, hidden
) -> None:
    """Through glass, in it, and by rays and shadow rays: as Cycles shows it."""
    tree = new_world(scene)
    finish(tree, add_node(tree, "ShaderNodeBackground", Color=(0.9, 0.9, 0.9, 1.0)))
    for name in hidden:
        setattr(scene.world.cycles_visibility, name, False)
    as_cycles_shows_a_ball(scene, export, cycles_mean, device, kind, roughness)


@pytest.mark.parametrize("kind", ["Glass", "Translucent", "Diffuse"])
@pytest.mark.parametrize(
    "output", ["Is Glossy Ray", "Is Transmission Ray", "Is Diffuse Ray", "Ray Depth"]
)
def test_a_ball_in_a_world_by_light_path(scene, export, cycles_mean, device, kind, output) -> None:
    switched(new_world(scene), output)
    as_cycles_shows_a_ball(scene, export, cycles_mean, device, kind, None)


def as_cycles_shows_a_ball(scene, export, cycles_mean, device, kind, roughness) -> None:
    """Of one BSDF, in its middle."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=32, ring_count=16)
    material, tree = new_material()
    given = {} if roughness is None else {"Roughness": roughness}
    given |= {"IOR": 1.1} if kind in ("Glass", "Refraction") else {}
    node = "Anisotropic" if kind == "Glossy" else kind
    finish(tree, add_node(tree, f"ShaderNodeBsdf{node}", **given))
    bpy.context.object.data.materials.append(material)
    scene.camera.location.z, scene.camera.data.lens = 5.0, 80.0
    scene.render.resolution_x = scene.render.resolution_y = 24
    shown = cycles_mean(64, 0)[8:16, 8:16, :3].mean()
    settings = {"width": 24, "height": 24, "passes": 16, "photons": 0}
    ours = render(device, export()[0], **settings)["Combined"][8:16, 8:16, :3].mean()
    assert ours == pytest.approx(shown, abs=0.03)


def test_no_sun_behind_a_transparent_film(scene, export) -> None:
    """The disc of a sky is a lamp here, and no film of Cycles shows a sky that it lets through."""
    tree = new_world(scene)
    sky = add_node(tree, "ShaderNodeTexSky")
    finish(tree, add_node(tree, "ShaderNodeBackground", Color=sky.outputs[0]))
    for is_transparent in (False, True):
        scene.render.film_transparent = is_transparent
        (sun,) = (light for light in export()[0].lights if light.kind == "sun")
        assert ("camera" in sun.found_by) != is_transparent and "chains" in sun.found_by


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


def test_what_cannot_be_evaluated_is_named(scene, export, monkeypatch) -> None:
    """By the node that asks for more than a direction, or by what Blender said."""
    tree = new_world(scene)
    sky = tree.nodes.new("ShaderNodeTexSky")
    sky.sky_type = "PREETHAM"
    seen = tree.nodes.new("ShaderNodeCameraData")
    power = add_node(tree, "ShaderNodeGamma", Color=sky.outputs[0], Gamma=seen.outputs[1])
    finish(tree, add_node(tree, "ShaderNodeBackground", Color=power.outputs[0]))
    (entry,) = (e for e in export()[1].of("ignored") if "World" in e.object)
    assert "Gamma" in entry.feature and "'Camera Data'" in entry.detail
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
