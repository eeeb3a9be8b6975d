# SPDX-License-Identifier: GPL-3.0-or-later
"""Export what programs ask of meshes and objects: UV maps, attributes, properties, places."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from .colour_spaces import decoded
from .coordinates import generated, loops_of, uv_of
from .hashes import WHOLE, hashed, hashed_name
from .instances import Instances
from .mesh_shape import of_vertices, pointiness, random_per_island
from .nodes.attributes import (
    COLOUR,
    FACTOR,
    GENERATED,
    INSTANCER,
    ISLAND,
    NAMED,
    NORMAL,
    OBJECT,
    PARTICLE,
    PLACED_AT,
    POINTINESS,
    STANDARD,
    STRAND,
    TANGENT,
    TEXTURE_SPACE,
    UNDISPLACED,
    UV,
)
from .properties import found_property
from .strands import TYPES
from .tangents import signed_tangents
from .triangles import normals_of, positions_of, read, triangles_of

Numbers = NDArray[np.float64]
# Names that Cycles keeps for attributes of its own, most of them of volumes: a mesh's is not read.
KEPT_NAMES = {
    "color", "density", "flame", "heat", "temperature", "velocity",
    "motion_P", "particle", "ptex_uv", "shadow_transparency", "undisplaced", *STANDARD,
}  # fmt: skip
OF_INSTANCES = (OBJECT, INSTANCER, PARTICLE, PLACED_AT)  # what all of an object or instance has


def corner_attribute(
    what: tuple[str, ...], triangles: NDArray[np.int32], obj: bpy.types.Object, mesh: bpy.types.Mesh
) -> NDArray[np.float32]:
    """An attribute of a kind at triangles' corners (T, 3, 4); 0 if the mesh has none such."""
    found: Numbers | None = None
    nothing = np.zeros((len(triangles), 3, 4), np.float32)
    if what[0] == GENERATED:
        found = generated(mesh)[triangles]
    elif what[0] == TEXTURE_SPACE:
        own = np.array(getattr(mesh, f"texspace_{what[1]}"), np.float64)
        found = np.broadcast_to(own, (len(triangles), 3, 3))
    elif what[0] == UNDISPLACED:
        found = positions_of(mesh)[triangles].astype(np.float64)
    elif what[0] == UV and (what[1] or len(mesh.uv_layers)):  # else nothing, unlike for tangents
        found = uv_of(mesh, triangles, what[1])
        if found is None:  # of another domain, or of three numbers
            found = attribute_of(mesh, obj, triangles, what[1])
    elif what[0] in (NAMED, FACTOR):
        found = attribute_of(mesh, obj, triangles, what[1])
        found = as_number(found) if what[0] == FACTOR and found is not None else found
    elif what[0] == COLOUR:
        name = what[1] or mesh.attributes.default_color_name
        found = attribute_of(mesh, obj, triangles, name)
        if found is None:  # unlike others it has no alpha either
            return nothing
    elif what[0] == STRAND:
        return nothing
    elif what[0] == POINTINESS:
        found = pointiness(mesh)[triangles]
    elif what[0] == ISLAND:
        found = np.repeat(random_per_island(mesh)[triangles[:, :1]], 3, axis=1)
    elif what[0] == NORMAL:
        found = corner_normals(mesh)
    elif what[0] == TANGENT:
        uv = uv_of(mesh, triangles, what[1])
        if uv is None:  # no sign of the bitangent tells so
            return nothing
        places = positions_of(mesh)[triangles].astype(np.float64)
        found = signed_tangents(places, corner_normals(mesh), uv)
    return padded(found, len(triangles))


def corner_normals(mesh: bpy.types.Mesh) -> Numbers:
    """Normals of triangles' corners (T, 3, 3), unit."""
    normals, corners = normals_of(mesh, triangles_of(mesh), positions_of(mesh))
    return normals[corners].astype(np.float64)


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
    if name in KEPT_NAMES:
        return None
    attribute = mesh.attributes.get(name)
    if attribute is None:
        weights = weights_of(mesh, obj, name)
        return None if weights is None else weights[triangles]
    if attribute.data_type not in TYPES:
        return None
    of_value, width = TYPES[attribute.data_type]
    values = read(attribute.data, of_value, len(attribute.data) * width)
    of_each = values.reshape(-1, width).astype(np.float64)
    mesh.calc_loop_triangles()
    match attribute.domain:
        case "POINT":
            return of_each[triangles]
        case "EDGE":
            return _of_vertices(mesh, attribute, of_each)[triangles]
        case "CORNER":
            return of_each[loops_of(mesh, len(triangles))]
        case "FACE":
            faces = read(mesh.loop_triangle_polygons, "value", len(triangles), np.int32)
            return np.repeat(of_each[faces][:, None], 3, axis=1)
    return None


def _of_vertices(mesh: bpy.types.Mesh, attribute: bpy.types.Attribute, of_each: Numbers) -> Numbers:
    """What edges have (E, n) as vertices have it (V, n), as Blender makes it."""
    kind = attribute.data_type
    if kind == "BYTE_COLOR":  # it averages the bytes
        codes = read(attribute.data, "color_srgb", of_each.size)
        mean = np.rint(255.0 * of_vertices(mesh, codes.reshape(-1, 4).astype(np.float64))) / 255.0
        return np.column_stack((decoded(mean[:, :3]), mean[:, 3]))
    found = of_vertices(mesh, of_each)
    if kind == "BOOLEAN":
        return np.ceil(found)
    return np.floor(found + 0.5) if kind in ("INT", "INT8") else found


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


def instance_attribute(
    instance: bpy.types.DepsgraphObjectInstance,
    what: tuple[str, ...],
    instances: Instances,
    frame: float,
) -> Numbers:
    """(4,), of a kind of OF_INSTANCES: a property of an object or its data, or first of what it is
    an instance of, or an attribute of the instance; its particle; its place; 0 if there is none."""
    if what[0] == PARTICLE:
        return particle_of(instance, what[1], frame)
    if what[0] == PLACED_AT:
        return placed_at(instance, what[1])
    holders: list[Any] = [instance.object, instance.object.data]
    if what[0] == INSTANCER and instance.is_instance:
        system = instance.particle_system
        stored = None if system else instances.attribute(instance, what[1])
        if stored is not None:
            return stored
        holders = [system.settings if system else None, instance.parent, *holders]
    return found_property(holders, what[1])


def particle_of(instance: bpy.types.DepsgraphObjectInstance, name: str, frame: float) -> Numbers:
    """(4,): what Particle Info tells of the particle that an instance stands for. What stands for
    none, or for a child, has Cycles' first: of number 0, and nothing else."""
    system = instance.particle_system if instance.is_instance else None
    number = instance.persistent_id[0]
    if system is None or number >= len(system.particles):
        return np.full(4, hashed(0) / WHOLE if name == "Random" else 0.0)
    particle, found = system.particles[number], np.ones(4)
    match name:
        case "Index":
            found[:3] = number
        case "Random":
            found[:3] = hashed(number) / WHOLE
        case "Age":
            found[:3] = frame - particle.birth_time
        case "Lifetime" | "Size":
            found[:3] = getattr(particle, name.lower())
        case _:  # Location, Velocity, Angular Velocity
            found[:3] = getattr(particle, name.lower().replace(" ", "_"))
    return found


def placed_at(instance: bpy.types.DepsgraphObjectInstance, name: str) -> Numbers:
    """(4,): Generated or UV coordinates of where an instancer has placed an instance."""
    found = np.array((0.0, 0.0, 0.0, 1.0))
    if instance.is_instance and name == "UV":
        found[:2] = instance.uv
    elif instance.is_instance:
        found[:3] = 0.5 * np.array(instance.orco) - 0.5
    return found


def object_record(instance: bpy.types.DepsgraphObjectInstance, matrix: Numbers) -> Numbers:
    """(6, 4), as Scene.objects has it, of an object or instance that is placed by `matrix`."""
    obj, found = instance.object, np.zeros((6, 4))
    try:
        found[:3] = np.linalg.inv(matrix)[:3]
    except np.linalg.LinAlgError:  # flattened: its own space has no third dimension
        found[:3] = np.linalg.pinv(matrix)[:3]
    found[3] = obj.color[:]
    found[4, :3] = matrix[:3, 3]
    number = instance.random_id if instance.is_instance else hashed_name(obj.name)
    found[4, 3] = (number & WHOLE) / WHOLE
    found[5, 0] = obj.pass_index
    return found
