# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender has since 5.2, as Cycles renders it: sheets (Thin Wall), DirectX's normal maps,
Random Walk by another model."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy
import numpy as np
import pytest

from tests.measure import render

from .build import add_light, add_mesh, add_node, features, long_paths, new_world, shader_material

pytestmark = [
    pytest.mark.blender,
    pytest.mark.skipif(bpy.app.version < (5, 2), reason="Blender before 5.2 has none of it"),
]
PRINCIPLED = "ShaderNodeBsdfPrincipled"
COLOUR = (0.8, 0.45, 0.3, 1.0)
SHEET = {"Thin_Wall": True, "Base_Color": COLOUR}
SCATTERS = {"Base_Color": COLOUR, "Subsurface_Weight": 1.0, "Subsurface_Radius": (1.0, 0.4, 0.2)}
CASES: dict[str, dict[str, Any]] = {
    "clear sheet": {**SHEET, "Transmission_Weight": 1.0, "Roughness": 0.0},
    "rough sheet": {**SHEET, "Transmission_Weight": 1.0, "Roughness": 0.5},
    "leaf": {**SHEET, "Subsurface_Weight": 1.0, "Subsurface_Anisotropy": 0.3},
    "walk": {**SCATTERS, "Subsurface_Scale": 0.1},
    "legacy walk": {**SCATTERS, "Subsurface_Scale": 0.5},
}
BLOCK, SIZE = 8, 48


def subject(material: bpy.types.Material, is_ball: bool) -> None:
    if is_ball:
        bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24, radius=0.9)
        bpy.ops.object.shade_smooth()
    else:
        bpy.ops.mesh.primitive_plane_add(location=(0, 0, 0.2), rotation=(1.2, 0, 0.35))
    bpy.context.object.data.materials.append(material)


def pictures(scene: Any, export: Any, device: Any, cycles_mean: Callable[..., Any]) -> Any:
    """Means of blocks, a floor in even light and a lamp's about the subject, by us and Cycles."""
    checks = shader_material("ShaderNodeBsdfDiffuse", Color=(0.3, 0.4, 0.5, 1))
    add_mesh("Floor", location=(0, 0, -1), scale=(9, 9, 1)).data.materials.append(checks)
    world = new_world(scene)
    background = add_node(world, "ShaderNodeBackground", Color=(0.5, 0.5, 0.6, 1))
    world.links.new(background.outputs[0], world.nodes["World Output"].inputs[0])
    add_light(
        "Lamp", "AREA", energy=150, size=2.0, location=(2, 2, 4), rotation_euler=(-0.4, 0.4, 0)
    )
    # It sees no world, which Cycles shows through sheets though the film be transparent.
    scene.camera.location, scene.camera.rotation_euler = (0, -4, 3), (0.9, 0, 0)
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    long_paths(scene)
    theirs = cycles_mean(256, 1)[..., :3]
    settings = {"width": SIZE, "height": SIZE, "passes": 48, "transparent": True}
    exported, report = export()
    ours = render(device, exported, mirror_depth=12, **settings)["Combined"][..., :3]
    blocks = [x.reshape(6, BLOCK, 6, BLOCK, 3).mean(axis=(1, 3)) for x in (ours, theirs)]
    return *blocks, report


def assert_alike(ours: Any, theirs: Any) -> None:
    mean = theirs.mean(axis=(0, 1))
    assert ours.mean(axis=(0, 1)) == pytest.approx(mean, rel=0.015)
    off = np.abs(ours - theirs) / np.maximum(theirs, 0.1 * mean)
    assert np.median(off) < 0.015 and np.quantile(off, 0.95) < 0.05


@pytest.mark.parametrize("name", CASES)
def test_pictures(scene, export, device, cycles_mean, name) -> None:
    material = shader_material(PRINCIPLED, **CASES[name])
    if name == "legacy walk":
        node = material.node_tree.nodes["Principled BSDF"]
        node.subsurface_method = "RANDOM_WALK_LEGACY"
    subject(material, name not in ("clear sheet", "rough sheet"))
    ours, theirs, report = pictures(scene, export, device, cycles_mean)
    assert features(report, "approximated") == []
    assert_alike(ours, theirs)


@pytest.mark.parametrize("space", ["TANGENT", "WORLD"])
def test_normal_maps_of_directx(scene, export, device, cycles_mean, space) -> None:
    material = shader_material(PRINCIPLED, Roughness=1.0)
    tree = material.node_tree
    colour = add_node(tree, "ShaderNodeTexMagic", Scale=3.0).outputs["Color"]
    node = add_node(tree, "ShaderNodeNormalMap", Color=colour)
    node.space, node.convention = space, "DIRECTX"
    tree.links.new(node.outputs[0], tree.nodes["Principled BSDF"].inputs["Normal"])
    subject(material, False)
    ours, theirs, _ = pictures(scene, export, device, cycles_mean)
    assert_alike(ours, theirs)


def test_a_sheet_by_nodes_is_said(convert) -> None:
    material = shader_material(PRINCIPLED, Transmission_Weight=1.0)
    tree = material.node_tree
    checks = add_node(tree, "ShaderNodeTexChecker")
    tree.links.new(checks.outputs["Fac"], tree.nodes["Principled BSDF"].inputs["Thin Wall"])
    assert "Thin Wall by nodes" in features(convert(material)[1], "approximated")


def test_constants_that_nodes_hold(convert) -> None:
    """Vector, which stands for what Blender has worked out, too, Integer and Boolean."""
    material = shader_material("ShaderNodeBsdfDiffuse")
    tree = material.node_tree
    found = []
    for name, value in (("Vector", (0.1, 0.5, 0.9)), ("Boolean", True), ("Int", 1)):
        node = tree.nodes.new(f"FunctionNodeInput{name.replace('Boolean', 'Bool')}")
        setattr(node, {"Int": "integer"}.get(name, name.lower()), value)
        tree.links.new(node.outputs[0], tree.nodes["Diffuse BSDF"].inputs["Color"])
        converted, report = convert(material)
        assert features(report, "approximated") == []
        found.append(converted.diffuse)
    assert found[0] == pytest.approx((0.1, 0.5, 0.9))
    assert found[1] == found[2] == (1.0, 1.0, 1.0)
