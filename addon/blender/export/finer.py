# SPDX-License-Identifier: GPL-3.0-or-later
"""What Cycles sees between the pixels of an Environment Texture, as an image of more of them."""

from __future__ import annotations

from math import floor

import numpy as np
from numpy.typing import NDArray

# Pixels of the longer side, at least: what is between those is linear in light, of whatever image.
LENGTH = 1024


def times_finer(width: int, height: int) -> int:
    """How many pixels, each way, become of one: an odd number, so one of them is where it was."""
    longest = max(width, height)
    return -(-LENGTH // longest) // 2 * 2 + 1 if longest < LENGTH else 1


def finer(pixels: NDArray[np.float32], interpolation: str, times: int) -> NDArray[np.float32]:
    """Images (h, w, channels) as (times h, times w, channels), by the interpolation of a node.

    Both axes repeat, as Cycles has it.
    """
    height, width, channels = pixels.shape
    found = np.empty((height * times, width * times, channels), np.float32)
    for channel in range(channels):  # one after the other: large images are of gigabytes
        rows = _along(pixels[..., channel], interpolation, times)
        found[..., channel] = _along(rows.T, interpolation, times).T
    return found


def _along(pixels: NDArray[np.float32], interpolation: str, times: int) -> NDArray[np.float32]:
    """(times n, m) of (n, m)."""
    found = np.zeros((pixels.shape[0] * times, pixels.shape[1]), np.float32)
    for own in range(times):
        place = (own + 0.5) / times - 0.5  # from the middle of a pixel
        first = floor(place) if interpolation != "Closest" else 0
        for step, weight in _weights(interpolation, place - first):
            if weight:
                found[own::times] += np.float32(weight) * np.roll(pixels, -first - step, axis=0)
    return found


def _weights(interpolation: str, part: float) -> list[tuple[int, float]]:
    """Steps and weights of the pixels about a place, so far from the first to the next."""
    if interpolation == "Closest":
        return [(0, 1.0)]
    if interpolation == "Linear":
        return [(0, 1.0 - part), (1, part)]
    # Cubic and Smart: the uniform cubic B-spline.
    rest = 1.0 - part
    inner = [2.0 / 3.0 - x * x * (1.0 - 0.5 * x) for x in (part, rest)]
    return [(-1, rest**3 / 6.0), (0, inner[0]), (1, inner[1]), (2, part**3 / 6.0)]
