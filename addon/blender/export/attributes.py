# SPDX-License-Identifier: GPL-3.0-or-later
"""Export what programs ask of meshes and objects: UV maps, generated coordinates, places."""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray

from .nodes.attributes import GENERATED, NORMAL, TANGENT, UV
from .tangents import loops_of, signed_tangents, undeformed, uv_of


def corner_attribute(
    what: tuple[str, ...], triangles: NDArray[np.int32], mesh: bpy.types.Mesh
) -> NDArray[np.float32] | None:
    """An attribute of a kind at triangles' corners (T, 3, 4); None if the mesh has none such."""
    found: NDArray[np.float64] | None = None
    if what[0] == GENERATED:
        found = generated(mesh)[triangles]
    elif what[0] == UV and (what[1] or len(mesh.uv_layers)):  # else nothing, unlike for tangents
        found = uv_of(mesh, triangles, what[1])
    elif what[0] == NORMAL:
        found = normals_of(mesh, triangles)
    elif what[0] == TANGENT:
        uv = uv_of(mesh, triangles, what[1])
        if uv is not None:
            points = _positions(mesh)[triangles]
            found = signed_tangents(points, normals_of(mesh, triangles), uv)
    if found is None:
        return None
    corners = np.zeros((len(triangles), 3, 4), np.float32)
    corners[..., 3] = 1.0
    corners[..., : found.shape[2]] = found
    return corners


def normals_of(mesh: bpy.types.Mesh, triangles: NDArray[np.int32]) -> NDArray[np.float64]:
    """Normals of triangles' corners (T, 3, 3), unit."""
    values = np.empty(3 * len(mesh.loops), np.float32)
    mesh.corner_normals.foreach_get("vector", values)
    return values.reshape(-1, 3)[loops_of(mesh, len(triangles))].astype(np.float64)


def _positions(mesh: bpy.types.Mesh) -> NDArray[np.float64]:
    values = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", values)
    return values.reshape(-1, 3).astype(np.float64)


def generated(mesh: bpy.types.Mesh) -> NDArray[np.float64]:
    """Where vertices (V, 3) are in the mesh's texture space, from 0 to 1, before modifiers."""
    size = 2.0 * np.array(mesh.texspace_size, np.float64)
    centred = undeformed(mesh) - np.array(mesh.texspace_location, np.float64)
    return np.divide(centred, size, out=np.zeros_like(centred), where=size != 0.0) + 0.5


def space_of(obj: bpy.types.Object, matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """(5, 4), as Scene.objects has it, of an object or instance that is placed by `matrix`."""
    found = np.zeros((5, 4))
    try:
        found[:3] = np.linalg.inv(matrix)[:3]
    except np.linalg.LinAlgError:  # flattened: its own space has no third dimension
        found[:3] = np.linalg.pinv(matrix)[:3]
    found[3] = obj.color[:]
    found[4, :3] = matrix[:3, 3]
    return found
