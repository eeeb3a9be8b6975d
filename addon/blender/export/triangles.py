# SPDX-License-Identifier: GPL-3.0-or-later
"""The triangles of a mesh, and the normals of their corners."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int32]


@dataclass(frozen=True)
class Triangles:
    """By a mesh's attributes, which are plain arrays: what Blender computes for each element on the
    way, such as a triangle's vertices or material, takes a hundred times as long."""

    vertices: Ints  # (T, 3)
    loops: Ints  # (T, 3)
    faces: Ints  # (T,)


def triangles_of(mesh: bpy.types.Mesh) -> Triangles:
    """Copy them out of Blender."""
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    if not count:
        none = np.zeros((0, 3), np.int32)
        return Triangles(none, none, none[:, 0])
    loops = read(mesh.loop_triangles, "loops", 3 * count, np.int32).reshape(-1, 3)
    faces = read(mesh.loop_triangle_polygons, "value", count, np.int32)
    vertex_of = read(mesh.attributes[".corner_vert"].data, "value", len(mesh.loops), np.int32)
    return Triangles(vertex_of[loops], loops, faces)


def are_flat(mesh: bpy.types.Mesh, triangles: Triangles) -> NDArray[np.bool_]:
    """(T,), whether they are not smooth: then Cycles takes their own normals, which of a face that
    is not plane are several. Where edges are sharp, or normals given, none is: the normals of
    corners tell."""
    sharp = mesh.attributes.get("sharp_face")
    domain = mesh.normals_domain
    if domain != "CORNER" or sharp is None or mesh.has_custom_normals or _has_sharp_edges(mesh):
        return np.full(len(triangles.faces), domain == "FACE")
    return read(sharp.data, "value", len(mesh.polygons), np.bool_)[triangles.faces]


def positions_of(mesh: bpy.types.Mesh) -> NDArray[np.float32]:
    """(V, 3)."""
    count = len(mesh.vertices)
    if not count:
        return np.zeros((0, 3), np.float32)
    return read(mesh.attributes["position"].data, "vector", 3 * count).reshape(-1, 3)


def normals_of(
    mesh: bpy.types.Mesh, triangles: Triangles, positions: NDArray[np.float32]
) -> tuple[NDArray[np.float32], Ints]:
    """Normals (N, 3), and which of them corners (T, 3) have."""
    flat = are_flat(mesh, triangles)
    if flat.all():
        normals, corners = np.zeros((0, 3), np.float32), triangles.loops.copy()
    elif _has_vertex_normals(mesh):  # a sixth of the corners'
        normals = read(mesh.vertex_normals, "vector", 3 * len(mesh.vertices)).reshape(-1, 3)
        corners = triangles.vertices.copy()
    else:
        normals = read(mesh.corner_normals, "vector", 3 * len(mesh.loops)).reshape(-1, 3)
        corners = triangles.loops.copy()
    own = geometric_normals(positions[triangles.vertices[flat]])
    corners[flat] = (len(normals) + np.arange(len(own), dtype=np.int32))[:, None]
    return np.concatenate([normals, own]), corners


def _has_vertex_normals(mesh: bpy.types.Mesh) -> bool:
    """Whether all smooth faces about a vertex have one normal there. Before Blender 5.2 Cycles
    takes it where faces beside them are flat, too, if no edge is sharp."""
    if mesh.normals_domain == "POINT":
        return True
    if bpy.app.version >= (5, 2) or mesh.has_custom_normals:
        return False
    return not _has_sharp_edges(mesh)


def _has_sharp_edges(mesh: bpy.types.Mesh) -> bool:
    sharp = mesh.attributes.get("sharp_edge")
    return sharp is not None and bool(read(sharp.data, "value", len(mesh.edges), np.bool_).any())


def geometric_normals(corners: NDArray[np.float32]) -> NDArray[np.float32]:
    """Unit normals (T, 3) of triangles (T, 3, 3) themselves; 0 of those without any area."""
    a, b, c = np.moveaxis(corners.astype(np.float64), 1, 0)
    return unit(np.cross(b - a, c - a)).astype(np.float32)


def read(items: Any, name: str, count: int, dtype: Any = np.float32) -> NDArray[Any]:
    """Return `count` numbers: what the items of a Blender collection call `name`."""
    values = np.empty(count, dtype)
    items.foreach_get(name, values)
    return values


def unit(vectors: NDArray[Any]) -> NDArray[np.float64]:
    """Vectors (..., 3) of length 1; those of no length stay."""
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.divide(vectors, lengths, out=np.zeros_like(vectors), where=lengths > 0.0)
