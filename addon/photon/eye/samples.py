# SPDX-License-Identifier: GPL-3.0-or-later
"""What a pass draws once for all pixels; it depends on (seed, index) alone."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from ..settings import PixelFilter, Settings

_TABLE = 1 << 13
_HIGHEST, _WORD = 1 << 31, (1 << 32) - 1


def pixel_jitter(settings: Settings, index: int) -> tuple[float, float]:
    """Where each eye ray of a pass goes, seen from its pixel's corner [px].

    Sobol's sequence in two dimensions, scrambled by the seed; filters other than the box draw from
    it in proportion to themselves, so that every ray weighs the same.
    """
    drawn = np.array(_scrambled_sobol(settings.seed, index))
    if settings.pixel_filter != "box":
        mass, offsets = _inverse(settings.pixel_filter)
        drawn = 0.5 + settings.pixel_width * np.interp(drawn, mass, offsets)
    return float(drawn[0]), float(drawn[1])


def instant(settings: Settings, index: int, shutter: tuple[float, ...]) -> float:
    """When a pass is, from the shutter's opening, 0, to its closing, 1; more often when it is more
    open. `shutter`: how open it is at even instants; (): all the time the same."""
    # Of 1500 steps by chance one that fills all dimensions evenly with R2's and those of the lens
    # (second_sequence of glsl/lib/rng.glsl).
    drawn = float((_first(settings.seed)[2] + index * 0.5445742427218005) % 1.0)
    if len(shutter) < 2 or not any(shutter):
        return drawn
    open_at = np.linspace(0.0, 1.0, _TABLE + 1)
    weight = np.interp(open_at, np.linspace(0.0, 1.0, len(shutter)), shutter)
    mass = np.concatenate([[0.0], np.cumsum(weight[1:] + weight[:-1])])
    return float(np.interp(drawn, mass / mass[-1], open_at))


def _scrambled_sobol(seed: int, index: int) -> tuple[float, float]:
    """A point in [0, 1)^2: of each 2^k from a multiple on there is one in each of 2^k equal parts,
    however halves cut these; else they are by chance (Burley 2020)."""
    second, direction = 0, _HIGHEST
    for bit in range(index.bit_length()):
        second ^= direction * (index >> bit & 1)
        direction ^= direction >> 1
    one, other = _scrambles(seed)
    # The first is the index itself, its bits reversed.
    return _owen(index, one), _owen(_reversed(second), other)


def _owen(bits: int, random: int) -> float:
    """A number of 32 bits, the lowest first, as one in [0, 1): each bit is turned round as those
    before it say (Laine & Karras 2011)."""
    bits = bits ^ bits * 0x3D20ADEA & _WORD
    bits = (bits + random) * (random >> 16 | 1) & _WORD
    bits = bits ^ bits * 0x05526C56 & _WORD
    bits = bits ^ bits * 0x53A22864 & _WORD
    return _reversed(bits) / (1 << 32)


def _reversed(bits: int) -> int:
    return int(f"{bits:032b}"[::-1], 2)


@lru_cache(maxsize=16)
def _scrambles(seed: int) -> tuple[int, int]:
    """Numbers of 32 bits of a seed."""
    one, other = np.random.Generator(np.random.Philox(seed)).integers(1 << 32, size=2)
    return int(one), int(other)


@lru_cache(maxsize=16)
def _first(seed: int) -> Any:
    """Where the sequence of a seed begins, as the third."""
    return np.random.Generator(np.random.Philox(seed)).random(3)


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
