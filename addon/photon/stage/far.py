# SPDX-License-Identifier: GPL-3.0-or-later
"""Places beyond a box, ever farther apart."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

WITHIN = (
    3.0  # at the faces of the box: as many places are within as are from there to 20 times as far
)
FAR = 1e4  # [m] from the middle of the box; from there on there is nothing, as in Cycles

Array = NDArray[np.float64]


def far_ends(half: Array) -> Array:
    """(3,) how far the grid goes beyond a box of half these sizes [m], as `unwarped` counts."""
    found: Array = WITHIN + np.log(np.maximum(FAR / half, np.e))
    return found


def unwarped(ends: Array, count: int, aside: Array) -> Array:
    """(3, count) places from -ends to ends in halves of the box, which are even within it, and
    beyond ever farther apart; `aside`: (3,) parts of the way to the next ones, by which they are
    moved: not at all within, wholly from a way on beyond."""
    even = ends[:, None] * np.linspace(-1.0, 1.0, count)
    ways = aside[:, None] * 2.0 * ends[:, None] / (count - 1)
    even = even + ways * np.clip(np.abs(even) - WITHIN, 0.0, 1.0)
    beyond = np.maximum(np.abs(even) - WITHIN, 0.0)
    found: Array = np.where(beyond > 0.0, np.sign(even) * np.exp(beyond), even / WITHIN)
    return found
