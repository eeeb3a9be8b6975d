# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces that nodes move, against Cycles: their outline, and nearly all pixels within 1 %."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import bpy
import numpy as np
import pytest

from .build import add_light, add_node, finish, new_material
from .test_normals import (
    COLOUR,
    NEAR,
    bump,
    difference,
    displacement,
    of_middles,
    pictures,
    shown,
)

pytestmark = pytest.mark.blender

DIFFUSE = "ShaderNodeBsdfDiffuse"
METHODS = ("DISPLACEMENT", "BOTH")
CELL = 48  # [px] of a subject, in a cell 3 m wide
# Of the brightest pixel, where one is darker: Cycles packs normals to 0.001, which shows there.
GRAZED = 0.1
WITHIN = 0.92  # creases and outlines are as fine as pixels
Tree = bpy.types.NodeTree
Build = Callable[[Tree, bpy.types.Node], None]


def ball(smooth: bool = True) -> None:
    bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24, radius=1.0)
    (bpy.ops.object.shade_smooth if smooth else bpy.ops.object.shade_flat)()


def coarse(smooth: bool = True) -> None:
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2, radius=1.0)
    (bpy.ops.object.shade_smooth if smooth else bpy.ops.object.shade_flat)()


def patched(smooth: bool) -> None:
    """Of its faces every other one stays where it is, but for the corners of others."""
    coarse(smooth)
    mesh = bpy.context.object.data
    material, tree = new_material()
    finish(tree, add_node(tree, DIFFUSE, Color=COLOUR))
    mesh.materials.append(material)
    for polygon in mesh.polygons:
        polygon.material_index = polygon.index % 2


def sheet() -> None:
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=60, y_subdivisions=60, size=2.0)
    bpy.ops.object.shade_smooth()


def cube() -> None:
    """Smooth, so that its corners have normals of their own between sharp edges."""
    bpy.ops.mesh.primitive_cube_add(size=1.6)
    obj = bpy.context.object
    obj.modifiers.new("Bevel", "BEVEL").segments = 4
    obj.modifiers.new("Subdivision", "SUBSURF").render_levels = 3
    bpy.ops.object.shade_smooth()


def by_noise(coordinate: str, strength: float = 0.3) -> Build:
    def build(tree: Tree, shader: bpy.types.Node) -> None:
        place = add_node(tree, "ShaderNodeTexCoord").outputs[coordinate]
        noise = add_node(tree, "ShaderNodeTexNoise", Vector=place, Scale=2.0, Detail=0.0)
        node = add_node(tree, "ShaderNodeDisplacement", Height=noise.outputs[0], Scale=strength)
        output = next(x for x in tree.nodes if x.type == "OUTPUT_MATERIAL")
        tree.links.new(node.outputs[0], output.inputs["Displacement"])

    return build


def by_incoming(tree: Tree, shader: bpy.types.Node) -> None:
    """Where it is looked at along its normals."""
    way = add_node(tree, "ShaderNodeNewGeometry").outputs["Incoming"]
    noise = add_node(tree, "ShaderNodeTexNoise", Vector=way, Scale=1.0, Detail=0.0)
    move = add_node(tree, "ShaderNodeDisplacement", Height=noise.outputs[0], Scale=0.3)
    output = next(x for x in tree.nodes if x.type == "OUTPUT_MATERIAL")
    tree.links.new(move.outputs[0], output.inputs["Displacement"])


def straight_up(tree: Tree, shader: bpy.types.Node) -> None:
    """By a constant."""
    output = next(x for x in tree.nodes if x.type == "OUTPUT_MATERIAL")
    way = add_node(tree, "ShaderNodeCombineXYZ", X=0.2, Y=0.1, Z=0.3)
    tree.links.new(way.outputs[0], output.inputs["Displacement"])


CASES: Mapping[str, tuple[Callable[[], None], Build]] = {
    "ball, Object": (ball, by_noise("Object")),
    "ball, Generated": (ball, by_noise("Generated")),
    "ball, UV": (ball, by_noise("UV")),
    "flat ball": (lambda: ball(False), by_noise("Object")),
    "coarse ball": (coarse, by_noise("Object")),
    "patched": (lambda: patched(False), by_noise("Object")),
    "patched, smooth": (lambda: patched(True), by_noise("Object")),
    "sheet": (sheet, by_noise("UV")),
    "sheet by Normal": (sheet, by_noise("Normal")),
    "cube": (cube, by_noise("Generated", 0.2)),
    "ball in the world": (ball, displacement("WORLD")),
    "sheet and a bump": (sheet, displacement("OBJECT", also=bump(scale=13.0))),
    "by a constant": (ball, straight_up),
    "by Incoming": (ball, by_incoming),
    **{
        f"ball by vector {space}": (ball, displacement(space, vector=True))
        for space in ("TANGENT", "OBJECT", "WORLD")
    },
}


def lay_out(cases: Mapping[str, tuple[Callable[[], None], Build]], method: str) -> int:
    """A subject a case, turned and stretched, in rows under a sun; returns the rows' length."""
    across = math.ceil(math.sqrt(len(cases)))
    for number, (subject, build) in enumerate(cases.values()):
        subject()
        obj = bpy.context.object
        obj.location = 3.0 * (number % across), 3.0 * (number // across), 0.0
        obj.scale, obj.rotation_euler = (1.0, 0.8, 1.1), (0.2, 0.15, 0.7)
        material, tree = new_material()
        material.displacement_method = method
        node = add_node(tree, DIFFUSE, Color=COLOUR)
        finish(tree, node)
        build(tree, node)
        obj.data.materials.append(material)
    sun = add_light("Sun", "SUN", energy=3.0, angle=0.0)
    sun.rotation_euler = 0.7, 0.4, 0.0
    scene = bpy.context.scene
    scene.camera.data.type, scene.camera.data.ortho_scale = "ORTHO", 3.0 * across
    scene.camera.location = 1.5 * across - 1.5, 1.5 * across - 1.5, 10.0
    scene.render.resolution_x = scene.render.resolution_y = CELL * across
    return across


@pytest.mark.parametrize("method", METHODS)
def test_every_option(export, cycles_mean, device, method: str) -> None:
    across = lay_out(CASES, method)
    ours, cycles = pictures(export, cycles_mean, device)
    bad: dict[str, Any] = {}
    for number, name in enumerate(CASES):
        x, y = number % across * CELL, number // across * CELL
        cell = np.s_[y : y + CELL, x : x + CELL]
        found = difference(ours[cell], cycles[cell], GRAZED)
        within = float((found < NEAR).mean())
        assert len(found) > 200  # pixels that show it
        if within < WITHIN:
            bad[name] = f"{within:.1%}"
    assert not bad, bad


def plate() -> bpy.types.Object:
    """Four vertices, which Cycles makes as many as it sees."""
    bpy.ops.mesh.primitive_plane_add(size=2.4)
    return bpy.context.object


def cage() -> bpy.types.Object:
    bpy.ops.mesh.primitive_cube_add(size=2.4)
    bpy.ops.object.shade_smooth()
    return bpy.context.object


@pytest.mark.skipif(bpy.app.version < (5, 0, 0), reason="adaptive subdivision was experimental")
@pytest.mark.parametrize("space", ["PIXEL", "OBJECT"])
def test_adaptive_subdivision(export, cycles_mean, device, space: str) -> None:
    """As small as asked: here much smaller than what is seen, so all alike is no less."""
    add_light("Sun", "SUN", energy=3.0, angle=0.0).rotation_euler = 0.7, 0.4, 0.0
    for number, subject in enumerate((plate, cage)):
        obj = subject()
        obj.location.x = 3.0 * number
        obj.rotation_euler = (0.2, 0.15, 0.7)
        modifier = obj.modifiers.new("Subdivision", "SUBSURF")
        modifier.subdivision_type = "SIMPLE" if subject is plate else "CATMULL_CLARK"
        modifier.render_levels = 0 if subject is plate else 3
        modifier.use_adaptive_subdivision, modifier.adaptive_space = True, space
        modifier.adaptive_object_edge_length = 0.02
        material, tree = new_material()
        material.displacement_method = "DISPLACEMENT"
        node = add_node(tree, DIFFUSE, Color=COLOUR)
        finish(tree, node)
        by_noise("Generated")(tree, node)
        obj.data.materials.append(material)
    scene = bpy.context.scene
    scene.camera.data.type, scene.camera.data.ortho_scale = "ORTHO", 6.0
    scene.camera.location.x, scene.render.resolution_y = 1.5, 64
    scene.render.resolution_x = 128
    exported, report = export()
    assert [e.feature for e in report.of("approximated")] == 2 * ["Adaptive Subdivision"]
    ours = shown(device, exported, width=128, height=64)
    cycles = of_middles(cycles_mean)
    for half in (np.s_[:, :64], np.s_[:, 64:]):
        assert (difference(ours[half], cycles[half], GRAZED) < 0.03).mean() > WITHIN
