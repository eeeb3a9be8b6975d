# SPDX-License-Identifier: GPL-3.0-or-later
"""What the picture shows: places that gather photons, found by few rays through all of it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import photon_stream_native as native
from numpy.typing import NDArray

EYE_RAYS_A_SIDE = 64  # eye rays a side
CELL_WIDTH = 3.0  # eye rays a side of a cell, or a little more

NEAR = 0.1  # the quantile of distances to the places that counts as near
BEYOND = 0.01  # of the places, on either side of each axis: some are far

Doubles = NDArray[np.float64]


@dataclass(frozen=True)
class ShownCells:
    """Cells of what the picture shows."""

    width: float  # at distance 1 from the eye
    eye: list[float] | None
    numbers: NDArray[np.int64]  # (c,) of these, in order
    seen: Doubles  # (c,) how much is seen of each

    def at(
        self, places: NDArray[np.float32], facing: NDArray[np.float32] | None = None
    ) -> NDArray[np.int32]:
        """Which of them places (n, 4) of photons are in, (n,), or -1; `facing` (n,): their packed
        normals, where cells are by side."""
        own = native.view_cells(places, self.width, self.eye, facing)
        return native.cells_among(self.numbers, own)


@dataclass(frozen=True)
class View:
    """Places that the picture shows, and cells of space, each about as large as another in it."""

    pixel: float  # how wide an eye ray's is at distance 1 from the eye
    eye: list[float] | None  # None: it is as wide everywhere
    places: Doubles  # (n, 3)
    normals: Doubles  # (n, 3) unit, geometric, on the side that is seen
    weights: Doubles  # (n,) how much of a pixel each is

    @cached_property
    def _texels(self) -> NDArray[np.float32]:
        """(n, 4) the places, as photons' are."""
        return np.column_stack([self.places, np.zeros(len(self.places))]).astype(np.float32)

    @cached_property
    def middle(self) -> Doubles:
        """(3,) the median of the places."""
        found: Doubles = np.median(self.places, axis=0)
        return found

    @cached_property
    def near(self) -> float:
        """How far the nearer ones are from the eye, or 1."""
        return float(np.quantile(self.away(self.places), NEAR))

    def cells(self, wide: float, by_side: bool = False) -> ShownCells:
        """Those of the places; `wide`: times as wide as they would be; `by_side`: where cells are
        of what faces about one way, so that one place has six. Few share a number by chance."""
        normals = native.pack_directions(self.normals.astype(np.float32)) if by_side else None
        width = CELL_WIDTH * wide * self.pixel
        own = native.view_cells(self._texels, width, self.eye, normals)
        numbers, which = np.unique(own, return_inverse=True)
        seen: Doubles = np.bincount(which, self.weights, len(numbers)).astype(np.float64)
        return ShownCells(width, self.eye, numbers, seen)

    def away(self, places: Doubles) -> Doubles:
        """How far they are from the eye, or 1."""
        if self.eye is None:
            return np.ones(len(places))
        far: Doubles = np.linalg.norm(places - np.array(self.eye), axis=1)
        return far

    def bounds(self) -> Doubles:
        """(2, 3) the lowest and the highest corner of the box about most of the places."""
        found: Doubles = np.quantile(self.places, (BEYOND, 1.0 - BEYOND), axis=0)
        return found

    def box(self) -> NDArray[np.float32]:
        """That box, and as much again on all sides."""
        low, high = self.bounds()
        margin = (high - low).max() / 2.0
        return np.array([low - margin, high + margin], np.float32)
