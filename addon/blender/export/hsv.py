# SPDX-License-Identifier: GPL-3.0-or-later
"""Colours by hue and saturation, and what Blender blends, of constants: the twins of
glsl/lib/hsv.glsl, glsl/nodes/blend.glsl and blend_hue.glsl. Colours are (3,)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .arithmetic import ratio

Numbers = NDArray[np.float64]
Blend = Callable[[Numbers, Numbers, float], Any]


def _hue(rgb: Numbers) -> float:
    """A sixth of the circle is 1/6; 0 of greys."""
    r, g, b = rgb
    v, span = rgb.max(), rgb.max() - rgb.min()
    if span == 0.0:
        return 0.0
    sixths = (g - b) / span if r == v else 2 + (b - r) / span if g == v else 4 + (r - g) / span
    return float((sixths + 6.0 if sixths < 0.0 else sixths) / 6.0)


def rgb_to_hsv(rgb: Numbers) -> Numbers:
    v, span = rgb.max(), rgb.max() - rgb.min()
    if v == 0.0 or span == 0.0:
        return np.array((0.0, 0.0, v))
    return np.array((_hue(rgb), span / v, v))


def hsv_to_rgb(hsv: Numbers) -> Numbers:
    h, s, v = hsv
    h = 0.0 if h == 1.0 else h * 6.0
    i = np.floor(h)
    f = h - i
    p, q, t = v * (1.0 - s), v * (1.0 - s * f), v * (1.0 - s * (1.0 - f))
    sixths = ((v, t, p), (q, v, p), (p, v, t), (p, q, v), (t, p, v))
    return np.array(sixths[int(i)] if i in range(5) else (v, p, q))


def rgb_to_hsl(rgb: Numbers) -> Numbers:
    high, low = rgb.max(), rgb.min()
    lightness = min(1.0, 0.5 * (high + low))
    if high == low:
        return np.array((0.0, 0.0, lightness))
    whole = 2.0 - high - low if lightness > 0.5 else high + low
    return np.array((_hue(rgb), (high - low) / whole, lightness))


def hsl_to_rgb(hsl: Numbers) -> Numbers:
    h, s, lightness = hsl
    x, y, z = np.abs(h * 6.0 - np.array((3.0, 2.0, 4.0)))
    n = np.clip((x - 1.0, 2.0 - y, 2.0 - z), 0.0, 1.0)
    return (n - 0.5) * (1.0 - abs(2.0 * lightness - 1.0)) * s + lightness


def hue_saturation(change: Numbers, rgb: Numbers) -> Numbers:
    """`change` (4,): added to the hue, factors of saturation and value, and how much of it."""
    hue, saturation, value, share = change
    h, s, v = rgb_to_hsv(rgb)
    new = np.array(((h + hue + 0.5) % 1.0, np.clip(s * saturation, 0.0, 1.0), v * value))
    return np.maximum(rgb + share * (hsv_to_rgb(new) - rgb), 0.0)


def _screen(a: Numbers, b: Numbers, t: float) -> Any:
    return 1.0 - (1.0 - t + t * (1.0 - b)) * (1.0 - a)


def _overlay(a: Numbers, b: Numbers, t: float) -> Any:
    bright = 1.0 - (1.0 - t + 2.0 * t * (1.0 - b)) * (1.0 - a)
    return np.where(a < 0.5, a * (1.0 - t + 2.0 * t * b), bright)


def _divide(a: Numbers, b: Numbers, t: float) -> Any:
    return np.where(b != 0.0, (1.0 - t) * a + t * ratio(a, b), a)


def _exclusion(a: Numbers, b: Numbers, t: float) -> Any:
    return np.maximum(a + t * (b - 2.0 * a * b), 0.0)


def _dodge(a: Numbers, b: Numbers, t: float) -> Any:
    left = 1.0 - t * b
    found = np.where(left <= 0.0, 1.0, np.minimum(ratio(a, left), 1.0))
    return np.where(a == 0.0, 0.0, found)


def _burn(a: Numbers, b: Numbers, t: float) -> Any:
    left = 1.0 - t + t * b
    return np.where(left <= 0.0, 0.0, np.clip(1.0 - ratio(1.0 - a, left), 0.0, 1.0))


def _soft_light(a: Numbers, b: Numbers, t: float) -> Any:
    soft = (1.0 - a) * b * a + a * (1.0 - (1.0 - b) * (1.0 - a))
    return a + t * (soft - a)


def _of_hue(*given: int) -> Blend:
    """a with channels of b's HSV."""

    def blend(a: Numbers, b: Numbers, t: float) -> Any:
        own, other = rgb_to_hsv(a), rgb_to_hsv(b)
        if other[1] == 0.0:
            return a
        own[list(given)] = other[list(given)]
        return a + t * (hsv_to_rgb(own) - a)

    return blend


def _saturation(a: Numbers, b: Numbers, t: float) -> Any:
    own, other = rgb_to_hsv(a), rgb_to_hsv(b)
    if own[1] == 0.0:
        return a
    own[1] += t * (other[1] - own[1])
    return hsv_to_rgb(own)


def _value(a: Numbers, b: Numbers, t: float) -> Any:
    own, other = rgb_to_hsv(a), rgb_to_hsv(b)
    own[2] += t * (other[2] - own[2])
    return hsv_to_rgb(own)


# By Blender's names: the numbers in the files, and the functions.
CONVERSIONS: dict[str, tuple[int, Callable[[Numbers], Numbers]]] = {
    "RGB to HSV": (0, rgb_to_hsv),
    "HSV to RGB": (1, hsv_to_rgb),
    "RGB to HSL": (2, rgb_to_hsl),
    "HSL to RGB": (3, hsl_to_rgb),
}
BLENDS: dict[str, tuple[int, Blend]] = {
    "SCREEN": (0, _screen),
    "OVERLAY": (1, _overlay),
    "DIVIDE": (2, _divide),
    "EXCLUSION": (3, _exclusion),
    "DODGE": (4, _dodge),
    "BURN": (5, _burn),
    "SOFT_LIGHT": (6, _soft_light),
}
HUE_BLENDS: dict[str, tuple[int, Blend]] = {
    "HUE": (0, _of_hue(0)),
    "SATURATION": (1, _saturation),
    "VALUE": (2, _value),
    "COLOR": (3, _of_hue(0, 1)),
}
