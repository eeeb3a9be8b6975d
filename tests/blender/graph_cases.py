# SPDX-License-Identifier: GPL-3.0-or-later
"""Graphs as artists leave them behind: groups, reroutes, what is muted, long chains."""

from __future__ import annotations

from collections.abc import Callable

import bpy

from .node_cases import COLOUR, OTHER, UV, Build, Case, Socket, Tree, U, V, node, scaled

MATH, MIX, HUE = "ShaderNodeMath", "ShaderNodeMixRGB", "ShaderNodeHueSaturation"


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
