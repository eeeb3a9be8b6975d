# SPDX-License-Identifier: GPL-3.0-or-later
"""What a pass draws once for all pixels; it depends on (seed, index) alone."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from ..settings import PixelFilter, Settings

_TABLE = 1 << 13


def pixel_jitter(settings: Settings, index: int) -> tuple[float, float]:
    """Where each eye ray of a pass goes, seen from its pixel's corner [px].

    The R2 sequence (Roberts 2018), shifted by the seed; filters other than the box draw from it
    in proportion to themselves, so that every ray weighs the same.
    """
    step = np.array([0.7548776662466927, 0.5698402909980532])
    drawn = (_first_jitter(settings.seed) + index * step) % 1.0
    if settings.pixel_filter != "box":
        mass, offsets = _inverse(settings.pixel_filter)
        drawn = 0.5 + settings.pixel_width * np.interp(drawn, mass, offsets)
    return float(drawn[0]), float(drawn[1])


@lru_cache(maxsize=16)
def _first_jitter(seed: int) -> Any:
    return np.random.Generator(np.random.Philox(seed)).random(2)


@lru_cache(maxsize=4)
def _inverse(name: PixelFilter) -> tuple[Any, Any]:
    """How much of a filter of width 1 lies below offsets from the pixel's centre, and those."""
    reach = {"gauss": 1.5, "blackman_harris": 1.0}[name]
    x = np.linspace(-reach, reach, _TABLE + 1)
    weight = _gauss(x) if name == "gauss" else _blackman_harris(x)
    mass = np.concatenate([[0.0], np.cumsum(weight[1:] + weight[:-1])])
    return mass / mass[-1], x


def _gauss(x: Any) -> Any:
    """Cycles': Blender's width is four standard deviations."""
    return np.exp(-8.0 * x**2)


def _blackman_harris(x: Any) -> Any:
    """Harris 1978, the window of four terms: Blender's width is half of it."""
    phase = np.pi * (x + 1.0)
    terms = (0.35875, -0.48829, 0.14128, -0.01168)
    return sum(term * np.cos(k * phase) for k, term in enumerate(terms))
