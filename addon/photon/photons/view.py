# SPDX-License-Identifier: GPL-3.0-or-later
"""What the picture shows: places that gather photons, found by few rays through all of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..film.blocks import in_blocks

EYE_RAYS_A_SIDE = 64  # eye rays a side
CELL_WIDTH = 3.0  # eye rays a side of a cell, or a little more

BEYOND = 0.01  # of the places, on either side of each axis: some are far
MIX = np.int64(0x2545F4914F6CDD1D)  # odd, of many bits: cells' numbers differ

Doubles = NDArray[np.float64]


@dataclass(frozen=True)
class View:
    """Places that the picture shows, and cells of space, each about as large as another in it."""

    pixel: float  # how wide an eye ray's is at distance 1 from the eye
    eye: list[float] | None  # None: it is as wide everywhere
    places: Doubles  # (n, 3)
    normals: Doubles  # (n, 3) unit, geometric, on the side that is seen
    weights: Doubles  # (n,) how much of a pixel each is

    def cells(self, places: Doubles, wide: float = 1.0) -> NDArray[np.int64]:
        """Numbers of those that places (n, 3) are in, (n,); `wide`: times as wide as they would be.
        Few share one by chance."""
        numbers = np.empty(len(places), np.int64)

        def work(rows: slice) -> None:
            level = np.floor(np.log2(np.maximum(self.away(places[rows]), 1e-9)))
            at = np.floor(places[rows] / (CELL_WIDTH * wide * self.pixel * 2.0**level)[:, None])
            number = level.astype(np.int64)
            for axis in range(3):
                number = (number ^ at[:, axis].astype(np.int64)) * MIX
            numbers[rows] = number

        in_blocks(numbers.shape, work)
        return numbers

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
