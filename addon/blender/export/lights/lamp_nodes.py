# SPDX-License-Identifier: GPL-3.0-or-later
"""What nodes of a lamp tell of its object; of what surfaces have: nothing, as in Cycles."""

from __future__ import annotations

from collections.abc import Mapping

import bpy
import numpy as np
from numpy.typing import NDArray

from ..graph import Graph, Reader
from ..links import Scope
from ..nodes import READERS
from ..nodes.attributes import of_attribute
from ..nodes.objects import read_nothing
from ..programs import Value
from ..properties import found_property

TELL_NOTHING = (
    "HAIR_INFO",
    "PARTICLE_INFO",
    "POINT_INFO",
    "VERTEX_COLOR",
    "VOLUME_INFO",
    "WIREFRAME",
)
OUTPUTS_OF_SURFACES = {"Backfacing", "Pointiness", "Random Per Island"}  # of Geometry


def readers_of(
    record: NDArray[np.float64], holders: tuple[bpy.types.ID, ...]
) -> Mapping[str, Reader]:
    """The readers of a lamp's nodes; `record` (6, 4): of its object, as of Scene.objects;
    `holders`: of its properties."""

    def read_info(
        graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
    ) -> Value:
        match output.name:
            case "Location":
                return Value.of(record[4, :3])
            case "Color":
                return Value.of(record[3])
            case "Alpha":
                return Value.of(record[3, 3])
            case "Object Index":
                return Value.of(record[5, 0])
            case "Random":
                return Value.of(record[4, 3])
        return Value.of(0.0)

    def read_attribute(
        graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
    ) -> Value:
        of_object = node.attribute_type in ("OBJECT", "INSTANCER")
        found = Value.of(found_property(holders if of_object else (), node.attribute_name))
        return of_attribute(found, output)

    nothing = dict.fromkeys(TELL_NOTHING, read_nothing)
    own = {"OBJECT_INFO": read_info, "ATTRIBUTE": read_attribute, "NEW_GEOMETRY": _read_geometry}
    return {**READERS, **nothing, **own}


def _read_geometry(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    if output.name in OUTPUTS_OF_SURFACES:
        return Value.of(0.0)
    return READERS["NEW_GEOMETRY"](graph, node, output, scope)
