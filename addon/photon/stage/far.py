# SPDX-License-Identifier: GPL-3.0-or-later
"""Places beyond a box, ever farther apart."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FAR = 1e4  # [m] from the middle of the box; from there on there is nothing, as in Cycles

Array = NDArray[np.float64]


def far_ends(half: Array) -> Array:
    """(3,) how far the grid goes beyond a box of half these sizes [m], as `unwarped` counts."""
    found: Array = 1.0 + np.log(np.maximum(FAR / half, np.e))
    return found


def unwarped(ends: Array, count: int, aside: Array) -> Array:
    """(3, count) places from -ends to ends, which within 1 are even, and beyond ever farther
    apart; `aside`: (3,) of the ways to the next ones, by which those are off that are beyond 2, and
    less nearer to 1."""
    even = ends[:, None] * np.linspace(-1.0, 1.0, count)
    ways = aside[:, None] * 2.0 * ends[:, None] / (count - 1)
    even = even + ways * np.clip(np.abs(even) - 1.0, 0.0, 1.0)
    size = np.abs(even)
    found: Array = np.where(size > 1.0, np.sign(even) * np.exp(np.maximum(size - 1.0, 0.0)), even)
    return found
