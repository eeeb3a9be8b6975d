# SPDX-License-Identifier: GPL-3.0-or-later
"""Arithmetic of constants, as glsl/nodes/arithmetic.glsl and functions.glsl have it of what varies.

By the names of Blender's Math node: the number in the file, and the function of arrays.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[np.float64]
Function = Callable[..., Any]


def ratio(a: Numbers, b: Numbers) -> Numbers:
    return np.divide(a, b, out=np.zeros_like(a), where=b != 0.0)


def power(a: Numbers, b: Numbers) -> Numbers:
    """Of negative numbers to whole exponents alone."""
    size = np.power(np.abs(a), b)
    of_negative = np.where(b == np.floor(b), np.where(np.mod(b, 2.0) == 1.0, -size, size), 0.0)
    result = np.where(a < 0.0, of_negative, size)
    return np.where(b == 0.0, 1.0, np.where(a == 0.0, 0.0, result))


def _logarithm(a: Numbers, base: Numbers) -> Numbers:
    there = (a > 0.0) & (base > 0.0) & (base != 1.0)
    return np.where(there, np.log(np.where(there, a, 1.0)) / np.log(np.where(there, base, 2.0)), 0)


def _remainder(a: Numbers, b: Numbers) -> Numbers:
    return np.where(b != 0.0, a - b * np.trunc(ratio(a, b)), 0.0)


def _floored_remainder(a: Numbers, b: Numbers) -> Numbers:
    return np.where(b != 0.0, a - b * np.floor(ratio(a, b)), 0.0)


def _wrapped(a: Numbers, high: Numbers, low: Numbers) -> Numbers:
    span = high - low
    return np.where(span != 0.0, a - span * np.floor(ratio(a - low, span)), low)


def _smooth_minimum(a: Numbers, b: Numbers, distance: Numbers) -> Numbers:
    h = ratio(np.maximum(distance - np.abs(a - b), 0.0), distance)
    return np.minimum(a, b) - h * h * h * distance / 6.0


def _ping_pong(a: Numbers, scale: Numbers) -> Numbers:
    part = ratio(a - scale, 2.0 * scale)
    return np.where(scale != 0.0, np.abs((part - np.floor(part)) * scale * 2.0 - scale), 0.0)


def _smooth_step(a: Numbers) -> Numbers:
    x = np.clip(a, 0.0, 1.0)
    return x * x * (3.0 - 2.0 * x)


def _smoother_step(a: Numbers) -> Numbers:
    x = np.clip(a, 0.0, 1.0)
    return x * x * x * (x * (x * 6.0 - 15.0) + 10.0)


def _gamma(a: Numbers, b: Numbers) -> Numbers:
    return np.where(b == 0.0, 1.0, np.where(a > 0.0, np.power(np.maximum(a, 1e-300), b), a))


def _within(function: Function) -> Function:
    """As if what is outside of [-1, 1] were its end."""
    return lambda a: function(np.clip(a, -1.0, 1.0))


ARITHMETIC: dict[str, tuple[int, Function]] = {
    "ADD": (0, lambda a, b: a + b),
    "SUBTRACT": (1, lambda a, b: a - b),
    "MULTIPLY": (2, lambda a, b: a * b),
    "DIVIDE": (3, ratio),
    "MULTIPLY_ADD": (4, lambda a, b, c: a * b + c),
    "MIX": (5, lambda a, b, c: a + c * (b - a)),
    "ABSOLUTE": (6, np.abs),
    "MINIMUM": (7, np.minimum),
    "MAXIMUM": (8, np.maximum),
    "LESS_THAN": (9, np.less),
    "GREATER_THAN": (10, np.greater),
    "SIGN": (11, np.sign),
    "COMPARE": (12, lambda a, b, c: np.abs(a - b) <= np.maximum(c, 1e-5)),
    "SMOOTH_MIN": (13, _smooth_minimum),
    "SMOOTH_MAX": (14, lambda a, b, c: -_smooth_minimum(-a, -b, c)),
    "ROUND": (15, lambda a: np.floor(a + 0.5)),
    "FLOOR": (16, np.floor),
    "CEIL": (17, np.ceil),
    "TRUNC": (18, np.trunc),
    "FRACT": (19, lambda a: a - np.floor(a)),
    "MODULO": (20, _remainder),
    "FLOORED_MODULO": (21, _floored_remainder),
    "WRAP": (22, _wrapped),
    "SNAP": (23, lambda a, b: np.floor(ratio(a, b)) * b),
    "PINGPONG": (24, _ping_pong),
    # What other nodes have.
    "CLAMP": (25, lambda a, b, c: np.minimum(np.maximum(a, b), c)),
    "SMOOTHSTEP": (26, _smooth_step),
    "SMOOTHERSTEP": (27, _smoother_step),
}
FUNCTIONS: dict[str, tuple[int, Function]] = {
    "POWER": (0, power),
    "LOGARITHM": (1, _logarithm),
    "SQRT": (2, lambda a: np.sqrt(np.maximum(a, 0.0))),
    "INVERSE_SQRT": (3, lambda a: np.where(a > 0.0, np.maximum(a, 1e-300) ** -0.5, 0.0)),
    "EXPONENT": (4, np.exp),
    "SINE": (5, np.sin),
    "COSINE": (6, np.cos),
    "TANGENT": (7, np.tan),
    "ARCSINE": (8, _within(np.arcsin)),
    "ARCCOSINE": (9, _within(np.arccos)),
    "ARCTANGENT": (10, np.arctan),
    "ARCTAN2": (11, np.arctan2),
    "SINH": (12, np.sinh),
    "COSH": (13, np.cosh),
    "TANH": (14, np.tanh),
    "RADIANS": (15, np.radians),
    "DEGREES": (16, np.degrees),
    "GAMMA": (17, _gamma),  # the Gamma node's power
}
