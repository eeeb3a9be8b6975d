# SPDX-License-Identifier: GPL-3.0-or-later
"""Graphs as artists leave them behind: as Cycles has them, or a line in the report."""

from __future__ import annotations

import math
import os
import subprocess
import sys

import bpy
import numpy as np
import pytest

from .build import add_light, add_mesh, add_node, features, finish, new_world, nodes_of
from .graph_cases import CASES, MATH, MIX, chains, wide
from .node_cases import (
    COLOUR,
    Build,
    Case,
    Tree,
    U,
    V,
    first_of_each,
    lay_out,
    node,
    render_sheet,
)
from .node_sheets import SHEETS
from .test_nodes import compare

pytestmark = [pytest.mark.blender, pytest.mark.stability(72)]

SLOWEST = 5.0  # [s]
COMPILE = """
import sys, time
from addon.photon.prepare import prepare
from addon.photon.scene import Scene
from addon.photon.settings import Settings
from addon.streams import Device
scene, device = Scene.load(sys.argv[1]), Device()
before = time.perf_counter(), time.process_time()
renderer = prepare(scene, Settings(width=8, height=8, photons=0, backend="fragment"), device)
renderer.render_pass()
print(min(time.perf_counter() - before[0], time.process_time() - before[1]))
"""


def test_against_cycles(export, cycles_mean, device) -> None:
    compare(export, cycles_mean, device, "fragment", CASES)


def colour_of(tree: Tree, build: Build) -> None:
    finish(tree, node("ShaderNodeBsdfDiffuse", {0: build})(tree).node)


def test_a_circle_is_noted(convert) -> None:
    material = bpy.data.materials.new("Material")
    tree = material.node_tree
    tree.nodes.clear()
    tree.nodes.new("ShaderNodeOutputMaterial")
    first, second = (node(MIX, {0: U})(tree) for _ in range(2))
    tree.links.new(first, second.node.inputs[1])
    tree.links.new(second, first.node.inputs[1])
    colour_of(tree, lambda _: second)
    _, report = convert(material)
    links_are_off = any(not link.is_valid for link in tree.links)
    assert links_are_off or any("circle" in entry.detail for entry in report.entries)


@pytest.mark.parametrize("of_world", [False, True])
def test_a_circle_of_shaders_is_noted(scene, export, of_world) -> None:
    """In place of what would go around there is nothing."""
    if of_world:
        scene.world = owner = bpy.data.worlds.new("World")
    else:
        owner = bpy.data.materials.new("Material")
        add_mesh("Plane").data.materials.append(owner)
    tree = owner.node_tree
    first, second = (tree.nodes.new("ShaderNodeMixShader") for _ in range(2))
    tree.links.new(first.outputs[0], second.inputs[1])
    tree.links.new(second.outputs[0], first.inputs[1])
    finish(tree, second)
    report = export()[1]
    links_are_off = any(not link.is_valid for link in tree.links)
    assert links_are_off or any("circle" in entry.detail for entry in report.entries)


@pytest.mark.parametrize(
    ("build", "feature"),
    [
        (node(MATH, {0: math.nan, 1: 1.0}), "Color" if bpy.app.version >= (5, 0) else "Value"),
        (chains(13), "'Math"),
        (wide(66), "Nodes"),
    ],
)
def test_what_is_noted(convert, device, build, feature) -> None:
    """Not a number; nodes too far from the output; too many values at a time."""
    material = bpy.data.materials.new("Material")
    tree = material.node_tree
    tree.nodes.clear()
    tree.nodes.new("ShaderNodeOutputMaterial")
    colour_of(tree, build)
    converted, report = convert(material)
    assert any(name.startswith(feature) for name in features(report, "approximated"))
    assert converted.name == "Material"


def test_every_node_compiles_soon(export, tmp_path, measured) -> None:
    """All at once, where no driver has kept any."""
    lay_out(first_of_each(SHEETS))
    export()[0].save(tmp_path / "scene.npz")
    environment = {**os.environ, "MESA_SHADER_CACHE_DISABLE": "true"}
    command = [sys.executable, "-c", COMPILE, str(tmp_path / "scene.npz")]
    found = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    spent = float(found.stdout.split()[-1])
    assert measured("compiling every node at once", spent, " s") < SLOWEST


def test_thousands_of_constants(convert) -> None:
    """Many ramps share one table."""
    material = bpy.data.materials.new("Material")
    tree = material.node_tree
    tree.nodes.clear()
    tree.nodes.new("ShaderNodeOutputMaterial")
    ramps = [node("ShaderNodeValToRGB", {0: x})(tree) for x in (U, V)]
    colour_of(tree, node(MIX, {0: 0.5, 1: lambda _: ramps[0], 2: lambda _: ramps[1]}))
    converted, _ = convert(material)
    tables = {o for i in converted.program for o in i.operands if hasattr(o, "rows")}
    assert len(tables) == 1


def test_what_casts_no_shadow(export, cycles_mean, device) -> None:
    """A surface that is transparent to shadow rays alone."""
    material = bpy.data.materials.new("Ghost")
    tree = material.node_tree
    tree.nodes.clear()
    tree.nodes.new("ShaderNodeOutputMaterial")
    mixed = node("ShaderNodeMixShader", {0: node("ShaderNodeLightPath", output="Is Shadow Ray")})(
        tree
    )
    for number, kind in ((1, "Diffuse"), (2, "Transparent")):
        shader = tree.nodes.new(f"ShaderNodeBsdf{kind}")
        tree.links.new(shader.outputs[0], mixed.node.inputs[number])
    finish(tree, mixed.node)
    columns, rows = lay_out([Case("floor", COLOUR)] * 4)
    ghost = add_mesh("Ghost", location=(1.0, 1.0, 0.4), scale=(0.3, 0.3, 0.3))
    ghost.data.materials.append(material)
    bpy.data.objects["Sun"].rotation_euler = (0.6, 0.0, 0.0)
    scene, _ = export()
    ours = render_sheet(device, scene, columns, rows, "fragment")
    bpy.context.scene.cycles.max_bounces = 0
    cycles = cycles_mean(1, 0)[..., :3].clip(0.0, 1.0)
    off = np.abs(ours - cycles).max(axis=2) > 0.01 * np.maximum(cycles.max(axis=2), 0.1)
    assert off.mean() < 0.01


@pytest.mark.parametrize("other", ["ALL", "EEVEE"])
@pytest.mark.parametrize("whose", ["light", "world"])
def test_cycles_own_output_counts(scene, export, whose: str, other: str) -> None:
    """Of lights and worlds as of materials, and all are as they were afterwards."""
    if whose == "world":
        tree, kind = new_world(scene), "Background"
    else:
        light = add_light("Lamp", "POINT", energy=1.0).data
        tree, kind = nodes_of(light), "Emission"
    tree.nodes.clear()
    for target, strength in ((other, 5.0), ("CYCLES", 2.0)):
        out = tree.nodes.new(f"ShaderNodeOutput{whose.capitalize()}")
        out.target = target
        shader = add_node(tree, f"ShaderNode{kind}", Strength=strength, Color=(1.0,) * 4)
        tree.links.new(shader.outputs[0], out.inputs["Surface"])
    tree.nodes[0].is_active_output = True
    (found,) = export()[0].lights
    assert found.power == (2.0,) * 3
    assert len(bpy.data.worlds) <= 1 and len(bpy.data.lights) <= 1
    assert [x.target for x in tree.nodes if x.type.startswith("OUTPUT")] == [other, "CYCLES"]
