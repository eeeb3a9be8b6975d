# SPDX-License-Identifier: GPL-3.0-or-later
"""Export tangents: which way anisotropic reflections are stretched, as Cycles has it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from .coordinates import centred, uv_of
from .triangles import unit

# Radial tangents turn about an axis of the object: two coordinates take each other's place, and one
# its sign. About Y they don't turn, but that is Cycles' formula.
_AROUND = {
    "X": ((0, 0, 0), (0, 0, -1), (0, 1, 0)),
    "Y": ((0, 0, -1), (0, 0, 0), (1, 0, 0)),
    "Z": ((0, -1, 0), (1, 0, 0), (0, 0, 0)),
}


@dataclass(frozen=True)
class Tangent:
    """Where a material's tangents come from: an axis of the object, or a UV map."""

    axis: str = "Z"  # or "": the UV map
    uv_map: str = ""  # or "": the one that is active in renders


def corner_tangents(
    tangent: Tangent,
    triangles: NDArray[np.int32],
    points: NDArray[np.float32],
    normals: NDArray[np.float32],
    mesh: bpy.types.Mesh,
) -> NDArray[np.float64] | None:
    """Tangents (T, 3, 3) of a mesh's triangles, in its space; None if it has no such UV map.

    `points` and `normals` (T, 3, 3) are those of the triangles' corners.
    """
    if tangent.axis:
        return radial_tangents(mesh, triangles, tangent.axis)
    uv = uv_of(mesh, triangles, tangent.uv_map)
    return None if uv is None else uv_tangents(points, normals, uv)


def radial_tangents(
    mesh: bpy.types.Mesh, triangles: NDArray[np.int32], axis: str
) -> NDArray[np.float64]:
    """Tangents at triangles' corners (T, 3, 3), in the mesh's space: along circles about an axis
    through the middle of its texture space, as long as the way to it.

    They go by Generated coordinates: modifiers don't move them.
    """
    tangents: NDArray[np.float64] = centred(mesh) @ np.array(_AROUND[axis], np.float64).T
    return tangents[triangles]


def uv_tangents(
    points: NDArray[Any], normals: NDArray[Any], uv: NDArray[Any]
) -> NDArray[np.float64]:
    """Unit tangents (T, 3, 3) of corners at points, with normals and UV coordinates (T, 3, 2).

    MikkTSpace (Mikkelsen 2008): corners that share point, normal, UV and orientation have the mean
    of their triangles' directions of U, each projected on the corner's plane, by their angles.
    """
    return signed_tangents(points, normals, uv)[..., :3]


def signed_tangents(
    points: NDArray[Any], normals: NDArray[Any], uv: NDArray[Any]
) -> NDArray[np.float64]:
    """The same with the sign (T, 3, 4) of the bitangents: 1 where UV goes round as the triangle."""
    points, normals = points.astype(np.float64), normals.astype(np.float64)
    edges, ways = points[:, 1:] - points[:, :1], uv[:, 1:] - uv[:, :1]
    area = ways[:, 0, 0] * ways[:, 1, 1] - ways[:, 0, 1] * ways[:, 1, 0]
    along = ways[:, 1:, 1] * edges[:, 0] - ways[:, :1, 1] * edges[:, 1]
    across = ways[:, :1, 0] * edges[:, 1] - ways[:, 1:, 0] * edges[:, 0]
    along = np.sign(area)[:, None] * along
    good = (area != 0.0) & along.any(axis=1) & across.any(axis=1)
    before, after = np.roll(points, 1, axis=1) - points, np.roll(points, -1, axis=1) - points
    cosines = (_projected(before, normals) * _projected(after, normals)).sum(axis=2)
    shares = np.arccos(cosines.clip(-1.0, 1.0)) * good[:, None]
    own = shares[..., None] * _projected(along[:, None], normals)
    places = _places(points, normals, uv)
    groups = 2 * places + (area > 0.0)[:, None]
    sums = np.zeros((2 * int(places.max(initial=-1)) + 2, 3))
    np.add.at(sums, groups, own)
    # Where the map of a triangle is a line or a point, corners take what others have there.
    other = 2 * places + (sums[2 * places + 1].any(axis=2))
    taken = np.where(good[:, None], groups, other)
    signs = np.where(taken % 2 == 1, 1.0, -1.0)
    return np.concatenate((unit(sums[taken]), signs[..., None]), axis=2)


def _places(*values: NDArray[Any]) -> NDArray[np.int64]:
    """Numbers (T, 3) of corners, the same for those of the same values (T, 3, n)."""
    rows = np.concatenate([value.astype(np.float32) for value in values], axis=2) + np.float32(0.0)
    flat = np.ascontiguousarray(rows.reshape(-1, rows.shape[2]))
    keys = flat.view(np.dtype((np.void, flat.dtype.itemsize * flat.shape[1]))).reshape(-1)
    return np.unique(keys, return_inverse=True)[1].reshape(rows.shape[:2])


def _projected(vectors: NDArray[Any], normals: NDArray[Any]) -> NDArray[np.float64]:
    """Unit vectors along their projections on the planes of unit normals."""
    return unit(vectors - (vectors * normals).sum(axis=-1, keepdims=True) * normals)
