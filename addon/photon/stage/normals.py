# SPDX-License-Identifier: GPL-3.0-or-later
"""Normals of triangles, and of the vertices that they are about."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray


def unit(vectors: Any) -> NDArray[Any]:
    """Vectors (..., 3) of length 1, or 0, of the type that they have."""
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    found: NDArray[Any] = np.zeros_like(vectors)
    return np.divide(vectors, lengths, out=found, where=lengths > 0.0)


def longest_one(normals: NDArray[Any]) -> NDArray[np.float32]:
    """Corner normals (T, 3, 3), of which a triangle's longest is made 1."""
    squares = np.einsum("tij,tij->ti", normals, normals)
    longest = np.sqrt(np.fmax.reduce(squares, axis=1))  # of those that are numbers
    longest[longest == 0.0] = 1.0
    return np.asarray(normals / longest[:, None, None], np.float32)


def mixed(normals: NDArray[Any], mix: Callable[[Any], NDArray[Any]]) -> NDArray[Any]:
    """What lies between normals (..., 3), as long as what lies between their lengths."""
    lengths = np.linalg.norm(normals, axis=-1, keepdims=True)
    found: NDArray[Any] = unit(mix(normals)) * mix(lengths)
    return found


def face_normals(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """(T, 3) unit, or 0, of triangles (T, 3, 3)."""
    return unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))


def sums_about(
    triangles: NDArray[np.int32], values: NDArray[Any], count: int
) -> NDArray[np.float64]:
    """(count, n) of what corners (T, 3, n) have about each of so many vertices."""
    corners = triangles.reshape(-1)
    rows = values.reshape(len(corners), -1).T
    return np.stack([np.bincount(corners, row, count) for row in rows], axis=1)


def mean_about(
    triangles: NDArray[np.int32], values: NDArray[Any], count: int
) -> NDArray[np.float64]:
    """The same in the mean; 0 of vertices that have none."""
    number = np.bincount(triangles.reshape(-1), minlength=count)[:, None]
    found: NDArray[np.float64] = sums_about(triangles, values, count) / np.maximum(number, 1)
    return found
