# SPDX-License-Identifier: GPL-3.0-or-later
"""Pixel filters in closed form."""

from __future__ import annotations

import math


def below(name: str, width: float, x: float) -> float:
    """The share of a filter below an offset [px]."""
    if name == "box":
        return min(max(x + 0.5, 0.0), 1.0)
    if name == "gauss":
        return 0.5 * (1.0 + math.erf(x / (width / 4.0) / math.sqrt(2.0)))
    u = min(max(x / (2.0 * width) + 0.5, 0.0), 1.0)
    sines = (-0.48829, 0.14128 / 2, -0.01168 / 3)
    turn = 2.0 * math.pi
    return u + sum(b * math.sin(turn * k * u) for k, b in enumerate(sines, 1)) / (turn * 0.35875)
