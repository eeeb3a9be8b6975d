# SPDX-License-Identifier: GPL-3.0-or-later
"""Illuminance in false colours, with iso-lines and a legend in lux."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

# Steps of a decade of the scale of illuminances that standards recommend (EN 12464-1).
STEPS = (1.0, 1.5, 2.0, 3.0, 5.0, 7.5)
CLASSES = 13  # between iso-lines: two decades
# Viridis (van der Walt & Smith 2015, CC0) at even distances: dark is little, for every eye.
COLOURS = ((68, 1, 84), (59, 82, 139), (33, 145, 140), (94, 201, 98), (253, 231, 37))
# Letters: rows of three dots, from the top.
_FONT = {
    "0": (7, 5, 5, 5, 7),
    "1": (2, 6, 2, 2, 7),
    "2": (7, 1, 7, 4, 7),
    "3": (7, 1, 7, 1, 7),
    "4": (5, 5, 7, 1, 1),
    "5": (7, 4, 7, 1, 7),
    "6": (7, 4, 7, 5, 7),
    "7": (7, 1, 2, 2, 2),
    "8": (7, 5, 7, 5, 7),
    "9": (7, 5, 7, 1, 7),
    ".": (0, 0, 0, 0, 2),
    "l": (6, 2, 2, 2, 7),
    "x": (0, 5, 2, 5, 0),
    " ": (0, 0, 0, 0, 0),
}


def limits(most: float) -> NDArray[np.float64]:
    """(CLASSES,) ascending steps of the scale, the last the least that is no less than `most`."""
    decade = math.floor(math.log10(most))
    scale = [step * 10.0**power for power in range(decade - 4, decade + 2) for step in STEPS]
    last = next(i for i, step in enumerate(scale) if step >= most * (1.0 - 1e-6))
    return np.array(scale[last - CLASSES + 1 : last + 1])


def false_colour(
    lux: NDArray[Any], most: float | None = None, legend_inside: bool = False
) -> NDArray[np.uint8]:
    """(h, w) or (h, w, 1) [lx], row 0 at the bottom, as (h, w', 3) sRGB, row 0 at the bottom: with
    a legend to the right, or inside if it has to be of the same size.

    `most` is the top of the scale [lx]; None: what one pixel in a hundred exceeds. Where nothing
    falls it is black.
    """
    lux = np.asarray(lux, np.float64).reshape(np.shape(lux)[:2])
    lux = np.where(np.isfinite(lux), lux, 0.0)
    lit = lux[lux > 0.0]
    steps = limits(most or (float(np.quantile(lit, 0.99)) if len(lit) else 1.0))
    picture = coloured(lux, steps)
    number = np.searchsorted(steps, lux)
    line = np.zeros(lux.shape, bool)
    line[:, 1:] |= number[:, 1:] != number[:, :-1]
    line[1:] |= number[1:] != number[:-1]
    picture[line & (lux > 0.0)] = 0
    beside = legend(len(picture), steps)
    if not legend_inside:
        return np.concatenate([picture, beside], axis=1)
    if 2 * beside.shape[1] <= picture.shape[1]:  # else it would hide the picture
        picture[:, -beside.shape[1] :] = beside
    return picture


def scene_linear(srgb: NDArray[np.uint8]) -> NDArray[np.float32]:
    """What the view transform Standard shows as these colours."""
    x = np.arange(256) / 255.0
    linear = np.where(x <= 0.04045, x / 12.92, ((x + 0.055) / 1.055) ** 2.4).astype(np.float32)
    return linear[srgb]


def coloured(lux: NDArray[Any], steps: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Colours of (…) [lx], (…, 3): even in the logarithm between the first step and the last."""
    with np.errstate(divide="ignore"):
        at = (np.log(lux) - math.log(steps[0])) / math.log(steps[-1] / steps[0])
    places = np.linspace(0.0, 1.0, len(COLOURS))
    channels = [np.interp(at, places, channel) for channel in np.array(COLOURS, float).T]
    colours: NDArray[np.uint8] = np.rint(np.stack(channels, axis=-1)).astype(np.uint8)
    colours[lux <= 0.0] = 0
    return colours


def legend(height: int, steps: NDArray[np.float64]) -> NDArray[np.uint8]:
    """(height, w, 3), row 0 at the bottom: a bar of the colours, and the steps beside it."""
    size = max(1, height // 200)
    row = 7 * size  # that a label takes
    labels = [f"{step:g}" for step in steps]
    labels[-1] += " lx"
    width = (4 * max(map(len, labels)) + 10) * size
    made = np.zeros((height, width, 3), np.uint8)
    edge = min(row, height // 4)
    at = np.linspace(0.0, 1.0, max(height - 2 * edge, 1))
    bar = steps[0] * (steps[-1] / steps[0]) ** at
    made[edge : edge + len(bar), size : 5 * size] = coloured(bar, steps)[:, None]
    free = -1
    for step, label in zip(steps[::-1], labels[::-1], strict=True):
        share = math.log(step / steps[0]) / math.log(steps[-1] / steps[0])
        middle = edge + round(share * (len(bar) - 1))
        made[middle, size : 6 * size] = 255
        if free < 0 or middle <= free:  # else it would lie over the one above
            _write(made, label, middle - 2 * size, 7 * size, size)
            free = middle - row
    return made


def _write(picture: NDArray[np.uint8], text: str, bottom: int, left: int, size: int) -> None:
    for letter in text:
        for line, dots in enumerate(reversed(_FONT[letter])):
            for column in range(3):
                if dots >> (2 - column) & 1:
                    y, x = bottom + line * size, left + column * size
                    picture[max(y, 0) : max(y + size, 0), x : x + size] = 255
        left += 4 * size
