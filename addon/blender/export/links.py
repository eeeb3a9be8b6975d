# SPDX-License-Identifier: GPL-3.0-or-later
"""Follow the links of node trees: through reroutes, groups and what is muted."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import bpy

# The group nodes that were entered on the way to a node, outermost first.
Scope = tuple[bpy.types.Node, ...]
# Reroutes and groups in a row; more are taken for a loop.
DEPTH = 64


@dataclass(frozen=True)
class Nothing:
    """What stands for an input of a muted node that nothing is linked to, before Blender 5.0: in
    Cycles it is 0, whatever its value."""

    type: str
    name: str = ""


def source(
    socket: bpy.types.NodeSocket, scope: Scope, passed: list[str] | None = None
) -> tuple[bpy.types.Node | None, Any, Scope]:
    """Follow an input to what feeds it.

    Returns (node, its output socket, scope); node is None if nothing does, and the socket is then
    the unlinked input, maybe a group's, whose default value counts, if it has one. `passed` is told
    the types of the sockets of groups and muted nodes on the way.
    """
    passed = [] if passed is None else passed
    for _ in range(DEPTH):
        link = next((link for link in socket.links if link.is_valid and not link.is_muted), None)
        if link is None:
            return None, socket, scope
        node, output = link.from_node, link.from_socket
        if node.mute:
            inner = next((i for i in node.internal_links if i.to_socket == output), None)
            if inner is None:
                return None, socket, scope
            passed.append(output.type)
            socket = inner.from_socket
            if not socket.is_linked:
                return None, Nothing(output.type), scope
        elif node.type == "REROUTE":
            socket = node.inputs[0]
        elif node.type == "GROUP" and node.node_tree:
            inside = _group_output(node.node_tree, output.identifier)
            if inside is None:
                return None, output, scope
            passed += output.type, inside.type
            socket, scope = inside, (*scope, node)
        elif node.type == "GROUP_INPUT" and scope:
            outside = _by_identifier(scope[-1].inputs, output.identifier)
            if outside is None:
                return None, output, scope[:-1]
            passed += output.type, outside.type
            socket, scope = outside, scope[:-1]
        else:
            return node, output, scope
    return None, socket, scope


def linked(node: bpy.types.Node, name: str, scope: Scope) -> bool:
    """Whether the input of that name exists and is given."""
    socket = node.inputs.get(name)
    return socket is not None and is_given(socket, scope)


def is_given(socket: bpy.types.NodeSocket, scope: Scope) -> bool:
    """Whether an input has what a node gives, or the value of a group's input. Without, textures
    and shaders know coordinates and normals themselves; normals also where the group shows none,
    and before Blender 5.0, where Cycles itself took groups apart, all that a group is not given."""
    node, end, _ = source(socket, scope)
    if node is not None or bpy.app.version < (5, 0):
        return node is not None
    is_own = end == socket or isinstance(end, Nothing)
    return not is_own and not (end.hide_value and socket.name.endswith("Normal"))


def _group_output(tree: bpy.types.NodeTree, identifier: str) -> bpy.types.NodeSocket | None:
    outputs = [node for node in tree.nodes if node.type == "GROUP_OUTPUT"]
    active = [node for node in outputs if node.is_active_output]
    for node in active or outputs:
        return _by_identifier(node.inputs, identifier)
    return None


def _by_identifier(sockets: bpy.types.NodeInputs, identifier: str) -> bpy.types.NodeSocket | None:
    return next((socket for socket in sockets if socket.identifier == identifier), None)
