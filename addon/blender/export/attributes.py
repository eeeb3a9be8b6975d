# SPDX-License-Identifier: GPL-3.0-or-later
"""Export what programs ask of meshes and objects: UV maps, attributes, properties, places."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from .instances import Instances
from .nodes.attributes import (
    COLOUR,
    FACTOR,
    GENERATED,
    INSTANCER,
    NAMED,
    NORMAL,
    OBJECT,
    STRAND,
    TANGENT,
    UV,
)
from .properties import found_property
from .strands import TYPES
from .tangents import loops_of, signed_tangents, undeformed, uv_of

Numbers = NDArray[np.float64]
PROPERTIES = (OBJECT, INSTANCER)  # what all of an object has


def corner_attribute(
    what: tuple[str, ...], triangles: NDArray[np.int32], obj: bpy.types.Object, mesh: bpy.types.Mesh
) -> NDArray[np.float32]:
    """An attribute of a kind at triangles' corners (T, 3, 4); 0 if the mesh has none such."""
    found: Numbers | None = None
    if what[0] == GENERATED:
        found = generated(mesh)[triangles]
    elif what[0] == UV and (what[1] or len(mesh.uv_layers)):  # else nothing, unlike for tangents
        found = uv_of(mesh, triangles, what[1])
    elif what[0] in (NAMED, FACTOR):
        found = attribute_of(mesh, obj, triangles, what[1])
        found = as_number(found) if what[0] == FACTOR and found is not None else found
    elif what[0] == COLOUR:
        name = what[1] or mesh.attributes.default_color_name
        found = attribute_of(mesh, obj, triangles, name)
        if found is None:  # unlike others it has no alpha either
            return np.zeros((len(triangles), 3, 4), np.float32)
    elif what[0] == STRAND:
        return np.zeros((len(triangles), 3, 4), np.float32)
    elif what[0] == NORMAL:
        found = normals_of(mesh, triangles)
    elif what[0] == TANGENT:
        uv = uv_of(mesh, triangles, what[1])
        if uv is None:  # no sign of the bitangent tells so
            return np.zeros((len(triangles), 3, 4), np.float32)
        found = signed_tangents(_positions(mesh)[triangles], normals_of(mesh, triangles), uv)
    return padded(found, len(triangles))


def normals_of(mesh: bpy.types.Mesh, triangles: NDArray[np.int32]) -> Numbers:
    """Normals of triangles' corners (T, 3, 3), unit."""
    values = np.empty(3 * len(mesh.loops), np.float32)
    mesh.corner_normals.foreach_get("vector", values)
    return values.reshape(-1, 3)[loops_of(mesh, len(triangles))].astype(np.float64)


def _positions(mesh: bpy.types.Mesh) -> Numbers:
    values = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", values)
    return values.reshape(-1, 3).astype(np.float64)


def padded(found: Numbers | None, count: int) -> NDArray[np.float32]:
    """(T, 3, n) as (T, 3, 4): a number in all three, alpha 1 unless it has one; 0 of nothing."""
    corners = np.zeros((count, 3, 4), np.float32)
    corners[..., 3] = 1.0
    if found is not None:
        wide = np.repeat(found, 3, axis=2) if found.shape[2] == 1 else found
        corners[..., : wide.shape[2]] = wide
    return corners


def as_number(found: Numbers) -> Numbers:
    """(T, 3, 1): of two numbers the first, of more the mean of three, as Cycles has it."""
    if found.shape[2] < 3:
        return found[..., :1]
    mean: Numbers = found[..., :3].mean(axis=2, keepdims=True)
    return mean


def attribute_of(
    mesh: bpy.types.Mesh, obj: bpy.types.Object, triangles: NDArray[np.int32], name: str
) -> Numbers | None:
    """An attribute, or a vertex group, by name (T, 3, n); None if there is none that Cycles
    reads."""
    attribute = mesh.attributes.get(name)
    if attribute is None:
        weights = weights_of(mesh, obj, name)
        return None if weights is None else weights[triangles]
    if attribute.data_type not in TYPES:
        return None
    of_value, width = TYPES[attribute.data_type]
    values = np.empty(len(attribute.data) * width, np.float32)
    attribute.data.foreach_get(of_value, values)
    of_each = values.reshape(-1, width).astype(np.float64)
    mesh.calc_loop_triangles()
    match attribute.domain:
        case "POINT":
            return of_each[triangles]
        case "CORNER":
            loops = np.empty(3 * len(triangles), np.int32)
            mesh.loop_triangles.foreach_get("loops", loops)
            return of_each[loops].reshape(-1, 3, width)
        case "FACE":
            faces = np.empty(len(triangles), np.int32)
            mesh.loop_triangle_polygons.foreach_get("value", faces)
            return np.repeat(of_each[faces][:, None], 3, axis=1)
    return None


def weights_of(mesh: bpy.types.Mesh, obj: bpy.types.Object, name: str) -> Numbers | None:
    """The weights of a vertex group (V, 1)."""
    group = obj.vertex_groups.get(name)
    if group is None:
        return None
    found = np.zeros((len(mesh.vertices), 1))
    for vertex in mesh.vertices:
        for member in vertex.groups:
            if member.group == group.index:
                found[vertex.index] = member.weight
    return found


def property_of(
    instance: bpy.types.DepsgraphObjectInstance, what: tuple[str, ...], instances: Instances
) -> Numbers:
    """(4,): a property of an object or its data, or first of what it is an instance of, or an
    attribute of the instance; 0 if there is none."""
    holders: list[Any] = [instance.object, instance.object.data]
    if what[0] == INSTANCER and instance.is_instance:
        system = instance.particle_system
        stored = None if system else instances.attribute(instance, what[1])
        if stored is not None:
            return stored
        holders = [system.settings if system else None, instance.parent, *holders]
    return found_property(holders, what[1])


def generated(mesh: bpy.types.Mesh) -> Numbers:
    """Where vertices (V, 3) are in the mesh's texture space, from 0 to 1, before modifiers."""
    size = 2.0 * np.array(mesh.texspace_size, np.float64)
    centred = undeformed(mesh) - np.array(mesh.texspace_location, np.float64)
    return np.divide(centred, size, out=np.zeros_like(centred), where=size != 0.0) + 0.5


def space_of(instance: bpy.types.DepsgraphObjectInstance, matrix: Numbers) -> Numbers:
    """(6, 4), as Scene.objects has it, of an object or instance that is placed by `matrix`."""
    obj, found = instance.object, np.zeros((6, 4))
    try:
        found[:3] = np.linalg.inv(matrix)[:3]
    except np.linalg.LinAlgError:  # flattened: its own space has no third dimension
        found[:3] = np.linalg.pinv(matrix)[:3]
    found[3] = obj.color[:]
    found[4, :3] = matrix[:3, 3]
    number = instance.random_id if instance.is_instance else hashed_name(obj.name)
    found[4, 3] = (number & 0xFFFFFFFF) / 0xFFFFFFFF
    found[5, 0] = obj.pass_index
    return found


def hashed_name(name: str) -> int:
    """The number of 32 bits that Cycles makes of an object's name (util/hash.h)."""
    number = 0
    for byte in name.encode():
        number = (number * 37 + byte) & 0xFFFFFFFF
    return int(hashed(number))


def hashed(number: Any) -> Any:
    """The number of 32 bits that Cycles makes of a number, or each of an array of int64, and 0, by
    Jenkins' lookup3."""
    whole = 0xFFFFFFFF
    b = c = (0xDEADBEEF + (2 << 2) + 13) & whole
    a = (b + number) & whole
    for turn in (14, 11, 25, 16, 4, 14, 24):
        left = ((b << turn) | (b >> (32 - turn))) & whole
        c = ((c ^ b) - left) & whole
        a, b, c = b, c, a
    return b
