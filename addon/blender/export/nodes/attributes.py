# SPDX-License-Identifier: GPL-3.0-or-later
"""Attribute, Color Attribute, Tangent, UV Map, Texture Coordinate: what the corners of triangles
have, and where a point is."""

from __future__ import annotations

import bpy
import numpy as np

from ..graph import Graph
from ..links import Scope
from ..programs import ZERO, Value
from . import geometry
from .geometry import GEOMETRY
from .mapping import in_space, normalized, transformed
from .vectors import combined, vector

# Kinds of attributes, most of them of a name.
GENERATED = "generated"
UNDISPLACED = "undisplaced"  # where they are in the object's space before materials move them
NORMAL = "normal"  # of the object's space, unit
TANGENT = "tangent"  # of a UV map, with the sign of the bitangent
UV = "uv"  # without a name the map that is active in renders
NAMED = "named"
FACTOR = "factor"  # as a number
COLOUR = "colour"  # without a name the one that is active in renders
OBJECT, INSTANCER = "object", "instancer"  # properties
POINTINESS, ISLAND = "pointiness", "island"  # what Geometry tells of a mesh
PARTICLE, PLACED_AT = "particle", "placed at"  # what instances are told
# What Cycles finds by these names of attributes, whatever the mesh has.
STANDARD = {
    "generated": (GENERATED,),
    "uv": (UV, ""),
    "pointiness": (POINTINESS,),
    "random_per_island": (ISLAND,),
}
FACTORS = ("Fac", "Factor")  # names of Attribute's output of a number, by Blender's version
TEXTURE_SPACE = "texture space"  # its location or size
# What all corners of an object have.
OF_OBJECTS = (OBJECT, INSTANCER, PARTICLE, PLACED_AT, TEXTURE_SPACE)
STRAND = "strand"  # what Hair Info and Point Info tell, by the names of their outputs


def attribute(graph: Graph, *what: str) -> Value:
    """What the corners of the meshes have of a kind, and maybe a name."""
    if graph.volume == "world" or (graph.volume and what[0] not in OF_OBJECTS):
        return generated_in(graph) if what[0] == GENERATED else ZERO
    number = Value.of(graph.context.attribute(*what))
    if what[0] in (NORMAL, TANGENT):  # of the point itself, as in Cycles
        return graph.program.emit("attribute", number=number, shift=Value.of((0.0, 0.0, 0.0, 0.0)))
    return graph.program.emit("attribute", number=number)


def generated_in(graph: Graph) -> Value:
    """Generated coordinates at a place of a volume: of the texture space of its mesh, as it is
    now; of the world where it is."""
    if graph.volume == "world":
        return here(graph, "position")
    middle, size = (attribute(graph, TEXTURE_SPACE, name) for name in ("location", "size"))
    return (here(graph, "object position") - middle) / (2.0 * size) + 0.5


def here(graph: Graph, what: str) -> Value:
    """What a point knows of itself, one of GEOMETRY."""
    if graph.volume and what not in ("position", "object position"):
        return graph.nothing_in_volume(what.capitalize())
    if graph.volume == "world":
        what = "position"
    if graph.undisplaced and what == "object position":
        return in_space(graph, here(graph, "position"), 0)
    if graph.undisplaced and what == "position":
        return undisplaced(graph)
    return graph.program.emit("geometry", which=Value.of(GEOMETRY[what]))


def undisplaced(graph: Graph) -> Value:
    """Where a point was before its material moved it, and from there as far along the surface that
    is there now as it is asked for, as in Cycles."""
    number, which = Value.of(graph.context.attribute(UNDISPLACED)), Value.of(GEOMETRY["position"])
    emit, nowhere = graph.program.emit, Value.of((0.0, 0.0, 0.0, 0.0))
    middle = in_space(graph, emit("attribute", number=number, shift=nowhere), 3)
    if graph.program.shift == (0.0, 0.0):
        return middle
    return middle + emit("geometry", which=which) - emit("geometry", which=which, shift=nowhere)


def read_coordinate(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Read an output of Texture Coordinate."""
    if getattr(node, "from_instancer", False) and output.name in ("Generated", "UV"):
        return attribute(graph, PLACED_AT, output.name)
    match output.name:
        case "Generated":
            return attribute(graph, GENERATED)
        case "Normal":
            return _object_normal_there(graph)
        case "UV":
            return attribute(graph, UV, "")
        case "Object" if node.object is not None:
            matrix = np.array(node.object.matrix_world, np.float64)
            return transformed(graph, here(graph, "position"), np.linalg.pinv(matrix)[:3])
        case "Object":
            return here(graph, "object position")
        case "Camera":
            return in_camera(graph)
        case "Window":
            return in_window(graph)
    incoming = here(graph, "incoming")
    return 0.0 - vector(graph, "REFLECT", incoming, smooth(graph), ZERO)


def smooth(graph: Graph) -> Value:
    """The normal of the smooth surface, which a material's displacement may have bent."""
    return graph.displaced or here(graph, "normal")


def object_normal(graph: Graph) -> Value:
    """The normal in the object's space, which a material's displacement may have bent."""
    return in_space(graph, graph.displaced, 2) if graph.displaced else here(graph, "object normal")


def _object_normal_there(graph: Graph) -> Value:
    """The normal in the object's space; beside the point, from Blender 5.2 on, as far on the
    straight way to that of a whole footprint beside it."""
    what = "object normal there"
    width = max(graph.program.shift)
    if width == 0.0 or graph.volume or bpy.app.version < (5, 2):
        return in_space(graph, graph.displaced, 2) if graph.displaced else here(graph, what)
    which = Value.of(GEOMETRY[what])
    whole = (*(float(x > 0.0) for x in graph.program.shift), 0.0, 0.0)
    own, there = (
        graph.program.emit("geometry", which=which, shift=Value.of(shift))
        for shift in ((0.0, 0.0, 0.0, 0.0), whole)
    )
    return normalized(graph, own + (there - own) * width)


def in_camera(graph: Graph) -> Value:
    """Where the point is, for the camera: it looks along its Z [m]."""
    if graph.context.camera is None:
        graph.notes.approximated(graph.owner, "Camera coordinates", "0 is used")
        return ZERO
    return transformed(graph, here(graph, "position"), graph.context.camera.to_camera[:3])


def in_window(graph: Graph) -> Value:
    """Where the picture shows the point, from 0 to 1."""
    view = graph.context.camera
    if view is None or view.camera.is_panorama:
        graph.notes.approximated(graph.owner, "Window coordinates", "0 is used")
        return ZERO
    found = transformed(graph, here(graph, "position"), view.to_window)
    found = found / found.part("z")
    return combined(graph, found.part("x"), found.part("y"), ZERO)


def read_uv_map(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Read UV Map."""
    if node.from_instancer:
        return attribute(graph, PLACED_AT, "UV")
    return attribute(graph, UV, node.uv_map)


def read_attribute(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Read Attribute; a property of the view layer, the scene or the world is constant."""
    name = node.attribute_name
    is_factor = output.name in FACTORS
    match node.attribute_type:
        case "GEOMETRY" if name in STANDARD:
            found = attribute(graph, *STANDARD[name])
        case "GEOMETRY":
            found = attribute(graph, FACTOR if is_factor else NAMED, name)
        case "OBJECT" | "INSTANCER":
            found = attribute(graph, OBJECT if node.attribute_type == "OBJECT" else INSTANCER, name)
        case _:
            found = Value.of(graph.context.of_view(name))
    return of_attribute(found, output)


def of_attribute(found: Value, output: bpy.types.NodeSocket) -> Value:
    """What an output of Attribute tells of it."""
    if output.name == "Alpha":
        return found.part("w")
    return found.part("average") if output.name in FACTORS else found


def read_colour(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Read Color Attribute."""
    found = attribute(graph, COLOUR, node.layer_name)
    return found.part("w") if output.name == "Alpha" else found


def read_tangent(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Read Tangent."""
    if node.direction_type == "UV_MAP":
        return on_surface(graph, attribute(graph, TANGENT, node.uv_map))
    return radial_tangent(graph, node.axis)


def read_geometry(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Read Geometry, some of which needs what meshes have."""
    match output.name:
        case "Position":
            return here(graph, "position")
        case "Tangent":
            return radial_tangent(graph, "Z")
        case "Pointiness":
            return attribute(graph, POINTINESS)
        case "Random Per Island":
            return attribute(graph, ISLAND)
    return geometry.read(graph, node, output, scope)


def radial_tangent(graph: Graph, axis: str) -> Value:
    """Along circles about an axis through the middle of generated coordinates."""
    at = attribute(graph, GENERATED) - 0.5
    x, y, z = (at.part(name) for name in "xyz")
    match axis:
        case "X":
            along = combined(graph, ZERO, 0.0 - z, y)
        case "Y":
            along = combined(graph, 0.0 - z, ZERO, x)
        case _:
            along = combined(graph, 0.0 - y, x, ZERO)
    return on_surface(graph, along)


def on_surface(graph: Graph, along: Value) -> Value:
    """A direction of the object's space in world space, square to the normal."""
    normal, turned = smooth(graph), in_space(graph, along, 5)
    across = normalized(graph, vector(graph, "CROSS_PRODUCT", turned, normal, ZERO))
    return vector(graph, "CROSS_PRODUCT", normal, across, ZERO)
