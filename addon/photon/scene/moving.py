# SPDX-License-Identifier: GPL-3.0-or-later
"""What moves of a scene while the shutter is open; see values.py for units."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import SceneError
from .checks import check_finite

# Arrays of one that files keep as such; the rest is a few numbers.
ARRAYS = ("offsets", "normals", "corners")


def _none(shape: tuple[int, ...], dtype: Any) -> Any:
    return field(default_factory=lambda: np.zeros(shape, dtype))


@dataclass(frozen=True)
class Moving:
    """How a run of a scene's vertices moves, and the triangles between them.

    What is given a step is at even instants, the first and the last of the exposure included. A
    shape goes straight from each to the next, and then matrices place it, which go straight, too,
    turn evenly about one axis, and stretch evenly.
    """

    vertices: tuple[int, int]  # the first one, and that after the last
    # (S, 4, 4) local to world; (0, 4, 4): the shape alone changes
    matrices: NDArray[np.float64] = _none((0, 4, 4), np.float64)
    placed: NDArray[np.float64] = field(default_factory=lambda: np.eye(4))  # the scene's vertices
    # (D, n, 3) [m] from the scene's vertices, where `placed` has them; (0, 0, 3): the shape stays
    offsets: NDArray[np.float32] = _none((0, 0, 3), np.float32)
    # (D, N, 3) there, too, as long as Scene.corner_normals; (D, 0, 3): triangles are flat
    normals: NDArray[np.float32] = _none((0, 0, 3), np.float32)
    corners: NDArray[np.int32] = _none((0, 3), np.int32)  # of the triangles in order, into these

    @property
    def bends(self) -> bool:
        """Whether its shape changes."""
        return len(self.offsets) > 0

    def owns(self, triangles: NDArray[np.int32]) -> NDArray[np.bool_]:
        """(T,) which of a scene's triangles (T, 3) are between its vertices."""
        first, last = self.vertices
        found: NDArray[np.bool_] = (triangles[:, 0] >= first) & (triangles[:, 0] < last)
        return found

    def check(self, vertices: int, triangles: NDArray[np.int32]) -> None:
        """Raise SceneError if it does not fit a scene of so many vertices, or is not finite."""
        first, last = self.vertices
        who = f"scene.moving, vertices {first} to {last}"
        if not 0 <= first <= last <= vertices:
            raise SceneError(f"{who}: the scene has {vertices}")
        for name in ("matrices", "placed"):
            check_finite(f"{who}: {name}", getattr(self, name))
        if self.matrices.shape[1:] != (4, 4) or self.placed.shape != (4, 4):
            raise SceneError(f"{who}: matrices are not (S, 4, 4)")
        if len(self.matrices) and np.linalg.matrix_rank(self.placed) < 4:
            raise SceneError(f"{who}: what has no volume is placed by no matrices")
        if not self.bends:
            return
        shape = len(self.offsets), last - first, 3
        if self.offsets.shape != shape or len(self.normals) != len(self.offsets):
            raise SceneError(f"{who}: offsets {self.offsets.shape}, expected {shape}")
        if not self.normals.shape[1]:
            return
        own = int(self.owns(triangles).sum())
        if self.corners.shape != (own, 3):
            raise SceneError(f"{who}: corners {self.corners.shape} of {own} triangles")
        if own and not 0 <= self.corners.min() <= self.corners.max() < self.normals.shape[1]:
            raise SceneError(f"{who}: corners are not below {self.normals.shape[1]}")

    def header(self) -> dict[str, Any]:
        """What of it a file's JSON holds."""
        return {
            "vertices": list(self.vertices),
            "matrices": self.matrices.tolist(),
            "placed": self.placed.tolist(),
        }

    @staticmethod
    def read(header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> Moving:
        """One of a file; raises whatever a malformed one leads to."""
        first, last = header["vertices"]
        matrices = np.array(header["matrices"], np.float64).reshape(-1, 4, 4)
        placed = np.array(header["placed"], np.float64)
        return Moving((first, last), matrices, placed, **{name: arrays[name] for name in ARRAYS})


def check_moving(moving: tuple[Moving, ...], vertices: int, triangles: NDArray[np.int32]) -> None:
    """Raise SceneError if one does not fit, or two have vertices in common."""
    for one in moving:
        one.check(vertices, triangles)
    runs = sorted(one.vertices for one in moving)
    for (_, last), (first, _) in pairwise(runs):
        if first < last:
            raise SceneError(f"scene.moving: vertex {first} moves in two ways")
