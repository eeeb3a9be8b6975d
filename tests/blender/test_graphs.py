# SPDX-License-Identifier: GPL-3.0-or-later
"""Graphs as artists leave them behind: as Cycles has them, or a line in the report."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from collections.abc import Callable

import bpy
import numpy as np
import pytest

from .build import add_mesh, features, finish
from .node_cases import (
    COLOUR,
    OTHER,
    UV,
    Build,
    Case,
    U,
    V,
    first_of_each,
    lay_out,
    node,
    render_sheet,
    scaled,
)
from .node_sheets import SHEETS
from .test_nodes import compare

pytestmark = [pytest.mark.blender, pytest.mark.stability(72)]

MATH, MIX, HUE = "ShaderNodeMath", "ShaderNodeMixRGB", "ShaderNodeHueSaturation"
Tree, Socket = bpy.types.NodeTree, bpy.types.NodeSocket
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


def grouped(
    kind: str,
    inner: Callable[[Tree, Socket], Socket],
    given: Build | None,
    is_hidden: bool = False,
) -> Build:
    """A group of an input and an output of these types, and what is between; whether it shows
    no value for its input, as Blender makes those of normals."""

    def build(tree: Tree) -> Socket:
        group = bpy.data.node_groups.new("Group", "ShaderNodeTree")
        for way in ("INPUT", "OUTPUT"):
            made = group.interface.new_socket(way, in_out=way, socket_type=f"NodeSocket{kind}")
            made.hide_value = is_hidden and way == "INPUT"
        made.default_value = made.default_value
        entrance, exit_ = (group.nodes.new(f"NodeGroup{end}") for end in ("Input", "Output"))
        group.links.new(inner(group, entrance.outputs[0]), exit_.inputs[0])
        outer = tree.nodes.new("ShaderNodeGroup")
        outer.node_tree = group
        if given is not None:
            tree.links.new(given(tree), outer.inputs[0])
        else:
            defaults = {"Color": (0.2, 0.7, 0.4, 1.0), "Float": 0.6, "Vector": (0.0, 0.0, 0.0)}
            outer.inputs[0].default_value = defaults[kind]
        return outer.outputs[0]

    return build


def nested(depth: int) -> Callable[[Tree, Socket], Socket]:
    """Groups in groups; the innermost inverts."""

    def build(tree: Tree, socket: Socket) -> Socket:
        if not depth:
            return node("ShaderNodeInvert", {0: 1.0, 1: lambda _: socket})(tree)
        return grouped("Color", nested(depth - 1), lambda _: socket)(tree)

    return build


def plain(tree: Tree, socket: Socket) -> Socket:
    return socket


def rerouted(tree: Tree, socket: Socket) -> Socket:
    for _ in range(3):
        step = tree.nodes.new("NodeReroute")
        tree.links.new(socket, step.inputs[0])
        socket = step.outputs[0]
    return socket


def muted(build: Build) -> Build:
    def muting(tree: Tree) -> Socket:
        socket = build(tree)
        socket.node.mute = True
        return socket

    return muting


def no_longer(build: Build, name: str) -> Build:
    """A node without the link of an input, which is muted."""

    def muting(tree: Tree) -> Socket:
        socket = build(tree)
        socket.node.inputs[name].links[0].is_muted = True
        return socket

    return muting


def unlinked(tree: Tree) -> Socket:
    """A node whose links are muted."""
    socket = node(MIX, {0: V, 1: COLOUR, 2: (0.6, 0.2, 0.4, 1.0)})(tree)
    for link in socket.node.inputs[1].links:
        link.is_muted = True
    return socket


def chain(tree: Tree, socket: Socket) -> Socket:
    """Fifty nodes, one behind the other."""
    for number in range(50):
        adding = node(MATH, {1: 0.001}, operation=("ADD", "SUBTRACT")[number % 2])(tree)
        tree.links.new(socket, adding.node.inputs[0])
        socket = adding
    return socket


def chains(count: int) -> Build:
    """A group of such, so often, one behind the other."""

    def build(tree: Tree) -> Socket:
        first = socket = grouped("Float", chain, U)(tree)
        for _ in range(count - 1):
            group = tree.nodes.new("ShaderNodeGroup")
            group.node_tree = first.node.node_tree
            tree.links.new(socket, group.inputs[0])
            socket = group.outputs[0]
        return socket

    return build


def wide(count: int) -> Build:
    """Numbers that are all needed twice, at first in one order and then in the other."""

    def build(tree: Tree) -> Socket:
        angles = [scaled(U, i, i + 1.0) for i in range(count)]
        waves = [node(MATH, {0: angle}, operation="SINE")(tree) for angle in angles]
        socket = U(tree)
        for wave in (*waves, *reversed(waves)):
            inputs = {0: (lambda given: lambda _: given)(socket), 1: (lambda w: lambda _: w)(wave)}
            socket = node(MATH, inputs, operation="ADD")(tree)
        return socket

    return build


CHECKER, FACING, MAPPING = (f"ShaderNode{x}" for x in ("TexChecker", "LayerWeight", "Mapping"))
ZERO = node(MATH, {0: U, 1: U}, operation="SUBTRACT")
QUOTIENT = node(MATH, {0: V, 1: ZERO}, operation="DIVIDE")


def times(tree: Tree, socket: Socket) -> Socket:
    """As a number, that varies."""
    return node(MATH, {0: lambda _: socket, 1: U}, operation="MULTIPLY")(tree)


def menu(tree: Tree) -> Socket:
    """One of two colours."""
    made = tree.nodes.new("GeometryNodeMenuSwitch")
    made.data_type = "RGBA"
    tree.links.new(COLOUR(tree), made.inputs[1])
    made.inputs[0].default_value = made.enum_items[0].name
    return made.outputs[0]


def zone(tree: Tree) -> Socket:
    """A number, three times half of what it was."""
    entrance, exit_ = (tree.nodes.new(f"GeometryNodeRepeat{end}") for end in ("Input", "Output"))
    entrance.pair_with_output(exit_)
    exit_.repeat_items.clear()
    exit_.repeat_items.new("FLOAT", "Number")
    entrance.inputs[0].default_value = 3
    tree.links.new(U(tree), entrance.inputs[1])
    half = node(MATH, {0: lambda _: entrance.outputs[1], 1: 0.5}, operation="MULTIPLY")(tree)
    tree.links.new(half, exit_.inputs[0])
    return exit_.outputs[0]


def closure(tree: Tree) -> Socket:
    """A function of a colour."""
    entrance, exit_ = (tree.nodes.new(f"NodeClosure{end}") for end in ("Input", "Output"))
    called = tree.nodes.new("NodeEvaluateClosure")
    entrance.pair_with_output(exit_)
    for owner in (exit_, called):
        owner.input_items.new("RGBA", "Given")
        owner.output_items.new("RGBA", "Found")
    turned = node(HUE, {"Hue": 0.1, "Color": lambda _: entrance.outputs[0]})(tree)
    tree.links.new(turned, exit_.inputs[0])
    tree.links.new(exit_.outputs[0], called.inputs[0])
    tree.links.new(COLOUR(tree), called.inputs[1])
    return called.outputs[0]


def bundle(tree: Tree) -> Socket:
    """A colour in it."""
    packed, opened = (tree.nodes.new(f"Node{way}Bundle") for way in ("Combine", "Separate"))
    for made in (packed, opened):
        made.bundle_items.new("RGBA", "Colour")
    tree.links.new(COLOUR(tree), packed.inputs[0])
    tree.links.new(packed.outputs[0], opened.inputs[0])
    return opened.outputs[0]


def over_own(build: Build) -> Build:
    """Linked to the input of a group that has a value of its own."""

    def building(tree: Tree) -> Socket:
        socket = grouped("Color", times, None)(tree)
        tree.links.new(build(tree), socket.node.inputs[0])
        return socket

    return building


RESOLVED = (  # what Blender itself resolves, from 5.0 on
    Case("a menu", menu),
    Case("a zone", zone),
    Case("a closure", closure),
    Case("a bundle", bundle),
    Case("muted, of nothing, into a group", over_own(muted(node(HUE)))),
    Case("a reroute of nothing, into a group", over_own(node("NodeReroute"))),
)
CASES = (
    *(RESOLVED if bpy.app.version >= (5, 0) else ()),
    Case("a colour through a number", grouped("Float", plain, COLOUR)),
    Case("a vector through a number", grouped("Float", plain, UV)),
    Case("a number of a colour's default", grouped("Color", times, None)),
    Case("a number through a colour", grouped("Color", plain, V)),
    Case("groups in groups", grouped("Color", nested(3), COLOUR)),
    Case("an unlinked group", grouped("Color", nested(1), None)),
    Case("reroutes", grouped("Color", rerouted, COLOUR)),
    Case("muted", muted(node(HUE, {"Hue": 0.1, "Color": COLOUR}))),
    Case("muted conversion", muted(node("ShaderNodeRGBToBW", {0: COLOUR}))),
    Case("muted without inputs", muted(node("ShaderNodeRGB"))),
    Case("muted group", muted(grouped("Color", nested(0), COLOUR))),
    Case("muted, of nothing", muted(node(HUE)), -1.0),
    Case("muted number, of nothing", muted(node("ShaderNodeRGBToBW")), -1.0),
    Case("coordinates by what is muted", node(CHECKER, {"Vector": muted(node(MAPPING))})),
    Case(
        "normal by what is muted",
        node(FACING, {"Normal": muted(node(MAPPING))}, "Facing"),
        -1.0,
        uneven=True,
    ),
    Case("muted coordinates", no_longer(node(CHECKER, {"Vector": UV}), "Vector")),
    Case(
        "muted normal",
        no_longer(node(FACING, {"Normal": COLOUR}, "Facing"), "Normal"),
        -1.0,
        uneven=True,
    ),
    Case(
        "a group's own normal",
        node(FACING, {"Normal": grouped("Vector", plain, None, is_hidden=True)}, "Facing"),
        -1.0,
        uneven=True,
    ),
    Case(
        "a group's coordinates",
        node(CHECKER, {"Vector": grouped("Vector", plain, None, is_hidden=True)}),
    ),
    Case(
        "a group's normal",
        node(FACING, {"Normal": grouped("Vector", plain, None)}, "Facing"),
        -1.0,
        uneven=True,
    ),
    Case("muted links", unlinked),
    Case("no links", node(MIX, {0: V})),
    Case("500 nodes", chains(10)),
    Case("20 values", wide(20), -20.0, 40.0),
    Case("division by 0", node(MIX, {0: 0.5, 1: QUOTIENT, 2: OTHER})),
    Case("logarithm of 0", node(MATH, {0: ZERO, 1: 2.0}, operation="LOGARITHM"), -1.0, 1.0),
    Case("power of 0", node(MATH, {0: ZERO, 1: ZERO}, operation="POWER"), -1.0, 3.0),
)


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
