# SPDX-License-Identifier: GPL-3.0-or-later
"""When passes are: what one draws for all pixels, by (seed, index) alone."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ..settings import Settings

_TABLE = 1 << 13


def instant(settings: Settings, index: int, shutter: tuple[float, ...]) -> float:
    """When a pass is, from the shutter's opening, 0, to its closing, 1; more often when it is more
    open. `shutter`: how open it is at even instants; (): all the time the same."""
    # Of 1500 steps by chance one that fills all dimensions evenly with those of r2_sequence and
    # second_sequence (glsl/lib/rng.glsl).
    drawn = float((_first(settings.seed) + index * 0.5445742427218005) % 1.0)
    if len(shutter) < 2 or not any(shutter):
        return drawn
    open_at = np.linspace(0.0, 1.0, _TABLE + 1)
    weight = np.interp(open_at, np.linspace(0.0, 1.0, len(shutter)), shutter)
    mass = np.concatenate([[0.0], np.cumsum(weight[1:] + weight[:-1])])
    return float(np.interp(drawn, mass / mass[-1], open_at))


@lru_cache(maxsize=16)
def _first(seed: int) -> float:
    """Where the sequence of a seed begins: by the third of the numbers that it draws."""
    return float(np.random.Generator(np.random.Philox(seed)).random(3)[2])
