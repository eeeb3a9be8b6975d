# SPDX-License-Identifier: GPL-3.0-or-later
"""Images of the world, and what directions are drawn from them by, as a table
(glsl/lights/environment.glsl)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...streams import TABLE_WIDTH
from ..scene import Image

LUMINANCE = np.array((0.2126, 0.7152, 0.0722), np.float32)  # of linear Rec. 709
ROWS_AT_ONCE = 256
Place = tuple[float, float, float]  # row of the table, width and height [px]


def environment_table(images: Sequence[Image]) -> tuple[NDArray[np.float32], tuple[Place, ...]]:
    """All images' texels (n, 4), one at least, and where each image begins."""
    sizes = [image.pixels.shape[:2] for image in images]
    rows = [-(-(1 + height + height * width) // TABLE_WIDTH) for height, width in sizes]
    first = np.concatenate([[0], np.cumsum(rows, dtype=int)])
    texels = np.zeros((max(int(first[-1]), 1) * TABLE_WIDTH, 4), np.float32)
    places = []
    for image, begin, (height, width) in zip(images, first, sizes, strict=False):
        at = int(begin) * TABLE_WIDTH
        _fill(texels[at : at + 1 + height + height * width], image.pixels)
        places.append((float(begin), float(width), float(height)))
    return texels, tuple(places)


def _fill(texels: NDArray[np.float32], pixels: NDArray[np.float32]) -> None:
    """Pixels are drawn by luminance times solid angle."""
    height, width = pixels.shape[:2]
    angles = solid_angles(height, width)
    of_pixels = texels[1 + height :].reshape(height, width, 4)
    emitted, total = np.zeros(height), np.zeros(3)
    for low in range(0, height, ROWS_AT_ONCE):
        rows = np.arange(low, min(low + ROWS_AT_ONCE, height))
        total += np.einsum("hwc,h->c", pixels[rows], angles[rows], dtype=np.float64)
        sums = np.cumsum(pixels[rows] @ LUMINANCE, axis=1, dtype=np.float64)
        emitted[rows] = sums[:, -1] * angles[rows]
        of_pixels[rows, :, :3] = pixels[rows]
        of_pixels[rows, :, 3] = sums / np.maximum(sums[:, -1:], np.finfo(np.float64).tiny)
    texels[0, :3] = total
    if emitted.any():
        texels[1 : 1 + height, 0] = np.cumsum(emitted) / emitted.sum()


def solid_angles(height: int, width: int) -> NDArray[np.float64]:
    """That of a pixel in each row [sr]."""
    sines = np.sin(np.pi * (np.arange(height + 1) / height - 0.5))
    angles: NDArray[np.float64] = np.diff(sines) * (2.0 * np.pi / width)
    return angles
