# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes: copied out of Blender in their own space, and placed in the world."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import bpy
import numpy as np
from numpy.typing import NDArray

from ...photon.stage.normals import longest_one
from .strands import Strands
from .triangles import normals_of, positions_of, read, triangles_of

Read = TypeVar("Read")
IDENTITY = np.eye(3)
EVEN = 1e-6  # what rounds of the square of a transform that stretches nothing


@dataclass(frozen=True)
class Shape:
    """What of a mesh may change while the shutter is open."""

    vertices: NDArray[np.float32]  # (V, 3) [m]
    normals: NDArray[np.float32]  # (N, 3)
    is_flat: bool  # these are its triangles'

    def fits(self, other: Shape) -> bool:
        """Whether another one is of the same vertices."""
        shapes = self.vertices.shape == other.vertices.shape
        return shapes and (self.is_flat or self.normals.shape == other.normals.shape)

    def same(self, other: Shape) -> bool:
        """Whether another one is the same."""
        return self.fits(other) and np.array_equal(self.vertices, other.vertices)


@dataclass(frozen=True)
class LocalMesh(Shape):
    """A mesh in its own space, triangulated; instances share it."""

    triangles: NDArray[np.int32]  # (T, 3)
    corners: NDArray[np.int32]  # (T, 3) indices into normals
    slot: NDArray[np.int32]  # (T,) material slot

    @property
    def flat(self) -> NDArray[np.bool_]:
        """(T,) which triangles are not smooth: their corners have one normal."""
        return self.corners[:, 0] == self.corners[:, 1]


def read_mesh(obj: bpy.types.Object, read: Callable[[bpy.types.Mesh], Read]) -> Read:
    """What `read` copies out of Blender of the mesh of an object.

    In Edit Mode, where a file may have been saved, a mesh has no attributes, and without modifiers
    no vertices either: Blender makes one that has, as it does for Cycles.
    """
    if not obj.data.is_editmode:
        return read(obj.data)
    try:
        return read(obj.to_mesh())
    finally:
        obj.to_mesh_clear()


def local_mesh(mesh: bpy.types.Mesh) -> LocalMesh:
    """Copy a mesh out of Blender."""
    triangles, vertices = triangles_of(mesh), positions_of(mesh)
    normals, corners = normals_of(mesh, triangles, vertices)
    slots, faces = mesh.attributes.get("material_index"), triangles.faces
    return LocalMesh(
        vertices,
        normals,
        mesh.normals_domain == "FACE",
        triangles.vertices,
        corners,
        read(slots.data, "value", len(mesh.polygons), np.int32)[faces]
        if slots
        else np.zeros(len(faces), np.int32),
    )


def local_strands(strands: Strands) -> LocalMesh:
    """The triangles that stand for hair or a point cloud."""
    triangles = strands.triangles
    slots = np.zeros(len(triangles), np.int32)
    if len(strands.slots):
        slots = strands.slots[strands.curve[triangles[:, 0]]]
    return LocalMesh(strands.vertices, strands.normals, False, triangles, triangles, slots)


def shape_of(mesh: bpy.types.Mesh) -> Shape:
    """Copy what of a mesh may change out of Blender."""
    vertices = positions_of(mesh)
    normals, _ = normals_of(mesh, triangles_of(mesh), vertices)
    return Shape(vertices, normals, mesh.normals_domain == "FACE")


def placed(
    mesh: LocalMesh, matrix: NDArray[np.float64], stretched: bool
) -> tuple[NDArray[np.float64], NDArray[np.int32], NDArray[np.float32]]:
    """Return vertices, triangles and corner normals in world space; `stretched`: by the matrix.

    Normals go with the inverse transpose, and keep how long it makes them beside each other, so
    that interpolated they are as in the object's space, as Cycles has it; a triangle's longest is
    1. A mirroring transform reverses the winding, so the triangle's geometric normal stays on the
    side of its corner normals.
    """
    triangles, corners = mesh.triangles, mesh.corners
    if is_mirroring(matrix):
        triangles, corners = triangles[:, ::-1], corners[:, ::-1]
    normals = np.take(placed_normals(mesh.normals, matrix), corners, axis=0)
    return (
        placed_points(mesh.vertices, matrix),
        np.ascontiguousarray(triangles),
        longest_one(normals) if stretched else normals,
    )


def placed_points(points: NDArray[np.float32], matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return points (N, 3) in world space."""
    found: NDArray[np.float64] = points.astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
    return found


def placed_normals(
    normals: NDArray[np.float32], matrix: NDArray[np.float64]
) -> NDArray[np.float32]:
    """Return normals (N, 3) in world space: unit where nothing is stretched, elsewhere as long
    beside each other as the transform makes them, about 1 at most."""
    cofactor = cofactor_of(matrix)
    # Objects of millimetres or kilometres would under- or overflow in float32.
    cofactor /= np.sqrt(np.square(cofactor).sum(axis=0).max()) or 1.0
    turned = normals.astype(np.float64) @ (-cofactor if is_mirroring(matrix) else cofactor).T
    return turned.astype(np.float32)


def stretches(matrix: NDArray[np.float64]) -> bool:
    """Whether a transform changes how long things are beside each other."""
    products = matrix[:3, :3].T @ matrix[:3, :3]
    whole = products.trace()
    return not bool(np.abs(products - whole / 3.0 * IDENTITY).max() <= EVEN * whole)


def placed_tangents(
    tangents: NDArray[np.float64], matrix: NDArray[np.float64]
) -> NDArray[np.float32]:
    """Return a mesh's tangents (T, 3, 3) in world space, in the order of `placed`'s corners.

    They go with the inverse transpose, as Cycles has it. The longest is as long as 1.
    """
    found = tangents @ cofactor_of(matrix).T
    longest = np.abs(found).max(initial=0.0)
    found = found / longest if longest > 0.0 else found
    found = found[:, ::-1] if is_mirroring(matrix) else found
    return found.astype(np.float32)


def is_mirroring(matrix: NDArray[np.float64]) -> bool:
    """Whether a transform turns left hands into right ones."""
    return bool(np.linalg.det(matrix[:3, :3]) < 0.0)


def cofactor_of(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the inverse transpose (3, 3) of a transform times its determinant, which exists for
    flattened objects too."""
    x, y, z = matrix[:3, :3].T
    return np.column_stack((np.cross(y, z), np.cross(z, x), np.cross(x, y)))
