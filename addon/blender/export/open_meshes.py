# SPDX-License-Identifier: GPL-3.0-or-later
"""Open meshes, which bound no body: of glass they are sheets."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

GRID = 1e-5  # of a mesh's size: vertices of one cell are one
MOST_LEAN = 30.0  # of smooth normals [degrees], that caustics bear


def is_open(vertices: NDArray[np.floating[Any]], triangles: NDArray[np.integer[Any]]) -> bool:
    """Whether an edge of triangles (T, 3) has one only, vertices (V, 3) that coincide being one."""
    if not _has_rim(triangles):
        return False
    vertices = np.nan_to_num(vertices.astype(np.float64))
    low = vertices.min(axis=0)
    size = max(float((vertices.max(axis=0) - low).max()), 1e-30)
    cells = np.rint((vertices - low) / (size * GRID)).astype(np.int64)
    keys = (cells[:, 0] << 40) + (cells[:, 1] << 20) + cells[:, 2]
    return _has_rim(np.unique(keys, return_inverse=True)[1].reshape(-1)[triangles])


def _has_rim(triangles: NDArray[np.integer[Any]]) -> bool:
    t = triangles.astype(np.int64)
    is_flat = (t[:, 0] == t[:, 1]) | (t[:, 1] == t[:, 2]) | (t[:, 2] == t[:, 0])
    ends = np.sort(t[~is_flat][:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    _, faces = np.unique((ends[:, 0] << 32) + ends[:, 1], return_counts=True)
    return bool((faces == 1).any())


def lean_of(corners: NDArray[np.float32], normals: NDArray[np.float32]) -> float:
    """How far the corners' normals (T, 3, 3) of triangles (T, 3, 3) lean from these [degrees]: all
    but a twentieth of them less."""
    across = corners.astype(np.float64) - corners[:, :1]
    faces = np.cross(across[:, 1], across[:, 2])
    lengths = np.linalg.norm(faces, axis=1)
    there = lengths > 0.0
    if not there.any():
        return 0.0
    cosines = np.einsum("tci,ti->tc", normals[there], faces[there] / lengths[there, None])
    return float(np.degrees(np.arccos(np.percentile(cosines, 5.0).clip(-1.0, 1.0))))
