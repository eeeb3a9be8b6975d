# SPDX-License-Identifier: GPL-3.0-or-later
"""Read how nodes of a material move its surface, or bend its normals as if they did."""

from __future__ import annotations

from dataclasses import replace

import bpy

from ...photon.scene import Displacement, triple
from .graph import Graph
from .links import is_given
from .nodes.normals import bump_of_displacement
from .own_program import own_program
from .programs import Program, Value

SOCKET = "Displacement"


def bump_of(graph: Graph, output: bpy.types.Node, material: bpy.types.Material) -> Value | None:
    """The normal of the smooth surface that a material's displacement makes where the mesh stays
    as it is, or is coarser; None: the mesh's own."""
    method = material.displacement_method
    if method == "DISPLACEMENT" or not is_given(output.inputs[SOCKET], ()):
        return None
    if method == "BOTH" and bpy.app.version < (5, 0):
        what = "the bump is as Blender 5.0 makes it"
        graph.notes.approximated(graph.owner, "Displacement and Bump", what)
    # What shaders ask of the same nodes afterwards is of the normal that it makes.
    graph = replace(graph, undisplaced=method == "BOTH", _known={}, _reading=[])
    return bump_of_displacement(graph, output.inputs[SOCKET])


def displacement_of(
    graph: Graph, output: bpy.types.Node, material: bpy.types.Material
) -> Displacement | None:
    """How it moves vertices; None: it does not."""
    if material.displacement_method == "BUMP" or not is_given(output.inputs[SOCKET], ()):
        return None
    # Where the mesh is, for a program of its own: a scene is moved before it is lit.
    graph = replace(graph, program=Program(), displaced=None, _known={}, _reading=[])
    way = graph.value(output.inputs[SOCKET], ())
    turns = material.displacement_method == "DISPLACEMENT"
    smooths = not turns and bpy.app.version < (5, 2)
    if way.result is None:
        return None if way.is_just(0.0) else Displacement(triple(way.colour), (), turns, smooths)
    found = own_program(graph, SOCKET, {SOCKET: way.result})
    if found is None:
        return None
    program, results = found
    return Displacement(results[SOCKET], program, turns, smooths)
