# SPDX-License-Identifier: GPL-3.0-or-later
"""The world lights by one radiance."""

from __future__ import annotations

import bpy
import pytest

from .build import add_node, finish

pytestmark = pytest.mark.blender


def new_world(scene: bpy.types.Scene) -> bpy.types.NodeTree:
    """Give the scene a world whose node tree holds nothing but an output."""
    world = scene.world = bpy.data.worlds.new("World")
    if bpy.app.version < (5, 0):
        world.use_nodes = True
    world.node_tree.nodes.clear()
    world.node_tree.nodes.new("ShaderNodeOutputWorld")
    return world.node_tree


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


def test_camera_ray_switch(scene, export) -> None:
    tree = new_world(scene)
    mix = tree.nodes.new("ShaderNodeMixShader")
    for index, level in ((1, 0.1), (2, 0.6)):
        shader = add_node(tree, "ShaderNodeBackground", Color=(level, level, level, 1))
        tree.links.new(shader.outputs[0], mix.inputs[index])
    path = tree.nodes.new("ShaderNodeLightPath")
    tree.links.new(path.outputs["Is Camera Ray"], mix.inputs[0])
    finish(tree, mix)
    exported, report = export()
    assert exported.lights[0].power == pytest.approx((0.6,) * 3)
    assert "Light Path" in [e.feature for e in report.of("approximated")]


def test_sky_texture_is_named(scene, export) -> None:
    tree = new_world(scene)
    sky = tree.nodes.new("ShaderNodeTexSky")
    finish(tree, add_node(tree, "ShaderNodeBackground", Color=sky.outputs[0]))
    entries = [e for e in export()[1].of("approximated") if "Color from" in e.feature]
    assert len(entries) == 1


def test_scene_wide_features_are_named(scene, export) -> None:
    """Rolling Shutter and Overscan among them, which are no part of the picture."""
    scene.render.use_motion_blur = True
    scene.cycles.rolling_shutter_type = "TOP"
    scene.eevee.use_overscan = True
    report = export()[1]
    assert [e.feature for e in report.of("approximated")] == ["Motion Blur"]
    assert [e.feature for e in report.of("ignored")] == ["Rolling Shutter", "Overscan"]


def test_sample_clamping_is_named(scene, export) -> None:
    """As Blender sets it for every new scene, too."""
    for name, default in (("direct", 0.0), ("indirect", 10.0)):
        setting = f"sample_clamp_{name}"
        assert scene.cycles.bl_rna.properties[setting].default == default
        setattr(scene.cycles, setting, default)
    found = [(e.object, e.feature) for e in export()[1].of("ignored")]
    assert found == [("Scene 'Scene'", "Clamp Indirect")]
    scene.cycles.sample_clamp_direct, scene.cycles.sample_clamp_indirect = 2.5, 0.0
    (entry,) = export()[1].of("ignored")
    assert entry.feature == "Clamp Direct" and "2.5" in entry.detail
