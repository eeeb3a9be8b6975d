# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps whose nodes tell directions, against Cycles."""

from __future__ import annotations

import math
from typing import Any

import bpy
import numpy as np
import pytest

from tests.measure import render
from tests.regression.blocks import block_means
from tests.regression.cycles import render_loaded

from .build import add_light, add_mesh, add_node, gone, nodes_of, shader_material

pytestmark = pytest.mark.blender

SIZE = 48


def lit_plane(kind: str, **properties: Any) -> Any:
    """A tilted lamp above a plane, with an image of a ramp and three bands."""
    scene = bpy.context.scene
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    plane = add_mesh("Plane", scale=(4, 4, 1))
    plane.data.materials.append(shader_material("ShaderNodeBsdfDiffuse", Color=(0.7, 0.7, 0.7, 1)))
    where = {"location": (0.3, 0.2, 3), "rotation_euler": (0.3, 0.2, 0.5)}
    lamp = add_light("Lamp", kind, **where, **{"energy": 500, "shadow_soft_size": 0, **properties})
    if kind == "SPOT":
        lamp.data.spot_size, lamp.data.spot_blend = 1.6, 0.1
    image = bpy.data.images.new("Slide", 32, 32, float_buffer=True)
    x, y = np.meshgrid(np.arange(32) / 31, np.arange(32) / 31)
    pixels = np.stack([x, 0.5 + 0.5 * np.cos(6 * np.pi * y), y, np.ones_like(x)], axis=-1)
    image.pixels.foreach_set(pixels.astype(np.float32).ravel())
    image.update()
    nodes_of(lamp.data)
    return lamp.data, image


def link(light: Any, texture: Any, kind: str, output: str) -> None:
    """A texture before the lamp, by an output of a node for coordinates; "": by none."""
    tree = light.node_tree
    if output:
        coordinates = add_node(tree, kind)
        tree.links.new(coordinates.outputs[output], texture.inputs["Vector"])
    emission = next(node for node in tree.nodes if node.type == "EMISSION")
    tree.links.new(texture.outputs["Color"], emission.inputs["Color"])


@pytest.mark.parametrize(
    ("lamp", "kind", "output", "radius"),
    [
        ("POINT", "ShaderNodeNewGeometry", "Incoming", 0.3),
        *(
            pytest.param(*case, marks=pytest.mark.thorough)
            for case in (
                ("SPOT", "", "", 0.0),  # of images the UV
                ("POINT", "ShaderNodeTexCoord", "Normal", 0.0),
                ("POINT", "ShaderNodeTexCoord", "UV", 0.0),
                ("SPOT", "ShaderNodeNewGeometry", "Incoming", 0.0),
                ("SPOT", "ShaderNodeTexCoord", "Normal", 0.3),
                ("POINT", "ShaderNodeNewGeometry", "Normal", 0.3),
            )
        ),
    ],
)
def test_slides(scene, export, device, lamp, kind, output, radius) -> None:
    """By shadow rays, and by photons alone."""
    light, image = lit_plane(lamp, shadow_soft_size=radius)
    texture = add_node(light.node_tree, "ShaderNodeTexImage")
    texture.image = image
    link(light, texture, kind, output)
    exported, report = export()
    (found,) = exported.lights
    assert exported.images[found.gobo].pixels.shape == (1024, 2048, 3)
    (entry,) = [entry for entry in report.entries if entry.status != "exact"]
    assert entry.object == "Light 'Lamp'" and "2048 x 1024 directions" in entry.detail
    theirs = block_means(render_loaded(256, seed=1))
    size = {"width": SIZE, "height": SIZE, "passes": 16}
    rays = render(device, exported, photons=1000, **size)["Combined"]
    landed = render(device, exported, photons=200000, direct_by_photons=True, **size)["Combined"]
    for ours, median, high in ((rays, 0.01, 0.03), (landed, 0.02, 0.08)):
        off = np.abs(block_means(ours[..., :3]) - theirs) / np.maximum(theirs, theirs.mean())
        assert np.median(off) < median and np.percentile(off, 95) < high
        assert ours[..., :3].mean() == pytest.approx(theirs.mean(), rel=0.005)


@pytest.mark.thorough
@pytest.mark.parametrize("shape", ["RECTANGLE", "ELLIPSE"])
def test_area_lights(scene, export, device, shape) -> None:
    """By UV: seen, by shadow rays and by photons."""
    light, image = lit_plane("AREA", shape=shape, size=2.0, size_y=1.2, energy=100)
    texture = add_node(light.node_tree, "ShaderNodeTexImage")
    texture.image = image
    link(light, texture, "ShaderNodeTexCoord", "UV")
    lamp = bpy.data.objects["Lamp"]
    lamp.visible_camera, lamp.location.z = True, 1.0
    bpy.data.objects["Plane"].location.z = -1.0
    size = {"width": SIZE, "height": SIZE, "passes": 32}
    for turned in (True, False):
        scene.camera.location.z = 0.0 if turned else 5.0
        scene.camera.rotation_euler = (math.pi if turned else 0.0, 0.0, 0.3)
        exported, report = export()
        assert "2048 x 1024 places" in str(report.of("approximated"))
        theirs = block_means(render_loaded(256, seed=1))
        rays = render(device, exported, photons=1000, **size)["Combined"]
        photons = {"photons": 50000, "direct_by_photons": True}
        landed = rays if turned else render(device, exported, **photons, **size)["Combined"]
        for ours in (rays, landed):
            off = np.abs(block_means(ours[..., :3]) - theirs) / np.maximum(theirs, theirs.mean())
            assert np.median(off) < 0.015 and np.percentile(off, 95) < 0.05, turned
            assert ours[..., :3].mean() == pytest.approx(theirs.mean(), rel=0.005)


def test_missing_images_are_magenta(scene, export) -> None:
    """In every direction, as in Cycles."""
    light, _ = lit_plane("SPOT")
    texture = add_node(light.node_tree, "ShaderNodeTexImage")
    texture.image = gone()
    link(light, texture, "", "")
    exported, report = export()
    (found,) = exported.lights
    assert found.gobo is not None
    assert np.allclose(exported.images[found.gobo].pixels[..., :3], (1.0, 0.0, 1.0), atol=1e-3)
    assert any("magenta" in entry.detail for entry in report.of("approximated"))


@pytest.mark.parametrize("case", ["area", "uneven", "position", "falloff"])
def test_what_is_not_done_is_named(scene, export, case) -> None:
    light, image = lit_plane("AREA" if case == "area" else "POINT")
    texture = add_node(light.node_tree, "ShaderNodeTexImage")
    texture.image = image
    link(light, texture, "ShaderNodeNewGeometry", "Position" if case == "position" else "Normal")
    if case == "uneven":
        bpy.data.objects["Lamp"].scale = 1, 2, 1
    if case == "falloff":
        falloff = add_node(light.node_tree, "ShaderNodeLightFalloff")
        coordinates = next(node for node in light.node_tree.nodes if node.type == "NEW_GEOMETRY")
        light.node_tree.links.new(coordinates.outputs["Normal"], falloff.inputs["Strength"])
        emission = next(node for node in light.node_tree.nodes if node.type == "EMISSION")
        light.node_tree.links.new(falloff.outputs["Linear"], emission.inputs["Strength"])
    exported, report = export()
    (found,) = exported.lights
    assert (found.gobo is not None) == (case == "falloff")
    assert found.falloff == (case == "falloff")
    lost = [entry for entry in report.of("approximated") if entry.object == "Light 'Lamp'"]
    assert lost and ("one value stands" in lost[0].detail or case == "position")
