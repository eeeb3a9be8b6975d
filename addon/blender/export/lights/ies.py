# SPDX-License-Identifier: GPL-3.0-or-later
"""IES files (ANSI/IES LM-63): how bright a lamp is in each direction, as Cycles reads them."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
# Candela become the watts of a lamp as bright: 4 pi sr at the efficacy of daylight [lm/W].
WATTS = 4.0 * math.pi / 177.83
# What Cycles takes for a profile that it cannot read.
UNREADABLE = 100.0
ROWS, COLUMNS = 361, 72  # of a profile: polar angles from the axis to behind it; azimuths


@dataclass(frozen=True)
class Ies:
    """Factors (h, v) at horizontal and vertical angles [deg], which increase."""

    horizontal: Floats
    vertical: Floats
    factors: Floats

    def at(self, horizontal: Floats, vertical: Floats) -> Floats:
        """At every pair of angles, (v, h): cubic between those given, 0 beyond, never below."""
        by_vertical = _cubic(self.vertical, self.factors.T, vertical, self._poles())
        # From 0 to 360 the file's last column is its first one.
        ring = (self.factors.shape[0] - 2, 1)
        found = _cubic(self.horizontal, by_vertical.T, horizontal, ring)
        return np.maximum(found.T, 0.0)

    def _poles(self) -> tuple[int | None, int | None]:
        """Beyond a pole comes what is before it."""
        low, high = self.vertical[0] < 1e-5, self.vertical[-1] > 180.0 - 1e-5
        return (1 if low else None), (len(self.vertical) - 2 if high else None)

    def profile(self) -> tuple[tuple[float, ...], ...]:
        """Rows from the axis to behind it, of COLUMNS azimuths, or of one for all."""
        azimuths = np.arange(COLUMNS) * (360.0 / COLUMNS)
        table = self.at(azimuths, np.linspace(0.0, 180.0, ROWS))
        if np.ptp(table, axis=1).max() <= 1e-6 * table.max():
            table = table[:, :1]
        return tuple(tuple(row) for row in table.tolist())


def read_ies(text: str) -> Ies | None:
    """None for what Cycles cannot read."""
    text = text.replace("\r\n", "\n")
    found = re.search(r"\nTILT=([^\n]*)\n?", text)
    if not found:
        return None
    try:
        numbers = [float(word) for word in text[found.end() :].replace(",", " ").split()]
        if found[1].strip().startswith("INCLUDE"):
            numbers = numbers[2 + 2 * int(numbers[1]) :]
        return _read(numbers)
    except (ValueError, IndexError):
        return None


def _read(numbers: list[float]) -> Ies | None:
    """Of what follows the line of the tilt."""
    multiplier, v, h, kind = numbers[2], int(numbers[3]), int(numbers[4]), int(numbers[5])
    factor = multiplier * numbers[10] * numbers[11] * WATTS
    rest = np.array(numbers[13 : 13 + v + h + v * h])
    if len(rest) < v + h + v * h or min(v, h) < 1:
        return None
    vertical, horizontal = rest[:v], rest[v : v + h]
    factors = factor * rest[v + h :].reshape(h, v)
    if kind == 1:
        return _type_c(horizontal, vertical, factors)
    return _type_b(horizontal, vertical, factors) if kind == 2 else None


def _type_c(h: Floats, v: Floats, factors: Floats) -> Ies | None:
    """Around the axis: what is given of it is mirrored."""
    if h[0] == 90.0:
        h = h - 90.0
    if h[0] != 0.0:
        return None
    if len(h) == 1:
        h, factors = np.array([0.0, 360.0]), factors[[0, 0]]
    for end in (90.0, 180.0):
        if h[-1] == end:
            h = np.concatenate([h, 2.0 * end - h[-2::-1]])
            factors = np.concatenate([factors, factors[-2::-1]])
    if h[-1] != 360.0:
        # Some files leave the last one out, which is the first.
        if 360.0 - h[-1] not in (h[-1] - h[-2], h[1] - h[0]):
            return None
        h, factors = np.append(h, 360.0), np.concatenate([factors, factors[:1]])
    if not (v[0] == 0.0 or (v[0] == 90.0 and v[-1] == 180.0)):
        return None
    return Ies(h, v, factors)


def _type_b(h: Floats, v: Floats, factors: Floats) -> Ies | None:
    """About an axis at a right angle: horizontal and vertical angles change places, both [-90, 90]
    or half of it, which is mirrored."""
    h, v, factors = v, h, factors.T
    if h[-1] != 90.0 or v[-1] != 90.0:
        return None
    if h[0] == 0.0:
        h = np.concatenate([90.0 - h[:0:-1], 90.0 + h])
        factors = np.concatenate([factors[:0:-1], factors])
    elif h[0] == -90.0:
        h = h + 90.0
    if v[0] == 0.0:
        v = np.concatenate([90.0 - v[:0:-1], 90.0 + v])
        factors = np.concatenate([factors[:, :0:-1], factors], axis=1)
    elif v[0] == -90.0:
        v = v + 90.0
    return Ies(np.append(h, 360.0), v, np.concatenate([factors, factors[:1]]))


def _cubic(
    knots: Floats, values: Floats, at: Floats, beyond: tuple[int | None, int | None]
) -> Floats:
    """Catmull and Rom's curve through values (n, ...) at knots; `beyond`: which value comes before
    the first and after the last, or else the one at hand. 0 outside."""
    first = np.clip(np.searchsorted(knots, at, side="left") - 1, 0, len(knots) - 2)
    x = (at - knots[first]) / (knots[first + 1] - knots[first])
    before, after = first - 1, first + 2
    before = np.where(before >= 0, before, first if beyond[0] is None else beyond[0])
    last = first + 1 if beyond[1] is None else beyond[1]
    after = np.where(after < len(knots), after, last)
    a, b, c, d = values[before], values[first], values[first + 1], values[after]
    x = x.reshape(-1, *[1] * (values.ndim - 1))
    curve = b + 0.5 * x * (c - a + x * (2 * a - 5 * b + 4 * c - d + x * (3 * (b - c) + d - a)))
    inside = (at >= knots[0]) & (at <= knots[-1])
    found: Floats = np.where(inside.reshape(x.shape), curve, 0.0)
    return found
