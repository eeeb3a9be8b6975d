# SPDX-License-Identifier: GPL-3.0-or-later
"""Turn an image's numbers into what a texture stores, as Cycles stores them (src/scene/image.cpp,
image_oiio.cpp; its Blender exporter's image.cpp).

Bytes stay bytes, sRGB's curve included, and colours are multiplied by alpha as they are stored:
that is what Cycles interpolates.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .colour_spaces import coded

STRIP = 1 << 16  # texels
LARGEST_HALF = 65504.0

Floats = NDArray[np.float32]  # (height, width, 4)


def strips(count: int) -> Iterator[slice]:
    """Of so many texels."""
    return (slice(first, first + STRIP) for first in range(0, count, STRIP))


def by_strips(work: Callable[[slice], None], count: int) -> None:
    """Do something with all strips of so many texels, side by side."""
    with ThreadPoolExecutor() as pool:
        list(pool.map(work, strips(count)))


def as_integers(floats: Floats, dtype: Any) -> NDArray[Any]:
    """Numbers of 0 to 1 as integers of a type."""
    most = np.iinfo(dtype).max
    source = floats.reshape(-1, 4)
    found = np.empty(source.shape, dtype)

    def convert(strip: slice) -> None:
        scaled = source[strip] * np.float32(most)
        scaled += np.float32(0.5)
        if most > 255:  # what curves make of 1 may be more
            np.clip(scaled, 0.0, most, out=scaled)
        found[strip] = scaled

    by_strips(convert, len(source))
    return found.reshape(floats.shape)


def is_opaque(pixels: NDArray[Any]) -> bool:
    """Whether all alphas of integers are the most."""
    return bool(pixels[..., 3].min() == np.iinfo(pixels.dtype).max)


def associate(pixels: NDArray[Any], restores: bool = False) -> None:
    """Multiply colours by alpha in place; what is left over is cut off, as in Cycles. `restores`:
    what Blender has divided, and rounded; where alpha is 0 it has forgotten it."""
    flat = pixels.reshape(-1, 4)
    most = np.iinfo(pixels.dtype).max
    wide = np.uint16 if most == 255 else np.uint32
    half = wide(most // 2 if restores else 0)

    def multiply(strip: slice) -> None:
        part: NDArray[Any] = flat[strip].astype(wide)
        flat[strip, :3] = (part[:, :3] * part[:, 3:] + half) // most

    by_strips(multiply, len(flat))


def separate(floats: Floats) -> None:
    """Divide colours by alpha in place, where there is any."""
    alpha = floats[..., 3:]
    floats[..., :3] /= np.where(alpha <= 0.0, np.float32(1.0), alpha)


def restore(floats: Floats) -> None:
    """Multiply what was separated."""
    alpha = floats[..., 3:]
    floats[..., :3] *= np.where(alpha <= 0.0, np.float32(1.0), alpha)


def code_srgb(floats: Floats) -> None:
    """Code colours by sRGB's curve in place."""
    flat = floats.reshape(-1, 4)

    def code(strip: slice) -> None:
        flat[strip, :3] = coded(flat[strip, :3])

    by_strips(code, len(flat))


def cut_to_half(
    floats: Floats, times: int, restores: bool, separates: bool, is_rounded: bool
) -> None:
    """Multiply colours by alpha so often, the first time to restore them, and divide them by it
    again, in place, with no more bits than a half number has: Cycles' way to what it converts.
    Logarithmic spaces show the bits."""
    flat = floats.reshape(-1, 4)

    def cut(strip: slice) -> None:
        part = flat[strip]
        if is_rounded:
            part[:] = part.astype(np.float16)
        for time in range(times):
            if restores and time == 0:
                restore(part)
            else:
                part[:, :3] *= part[:, 3:]
        part.view(np.uint32)[:] &= np.uint32(0xFFFFE000)
        if separates:
            separate(part)

    by_strips(cut, len(flat))


def blacken_nonfinite(floats: Floats) -> int:
    """Make black, in place, what is not finite in any channel; how many pixels are."""
    flat = floats.reshape(-1, 4)
    count = 0
    for strip in strips(len(flat)):
        part = flat[strip]
        if not np.isfinite(part.sum()):  # a large sum only makes us look
            nonfinite = ~np.isfinite(part).all(axis=1)
            part[nonfinite] = 0.0
            count += int(nonfinite.sum())
    return count


def as_floats(floats: Floats, exactly: bool) -> NDArray[Any]:
    """Half numbers, if those can tell as much, or need not `exactly`; else as they are."""
    largest = max(float(floats.max()), -float(floats.min()))
    if largest > LARGEST_HALF:
        return floats
    half = np.empty(floats.shape, np.float16)
    source, found = floats.reshape(-1, 4), half.reshape(-1, 4)

    def convert(strip: slice) -> None:
        found[strip] = source[strip]

    by_strips(convert, len(source))
    if exactly and not all(
        np.array_equal(found[strip].astype(np.float32), source[strip])
        for strip in strips(len(source))
    ):
        return floats
    return half


def is_grey(pixels: NDArray[Any]) -> bool:
    """Whether it has no colours, and nothing shines through."""
    one = 1 if pixels.dtype.kind == "f" else np.iinfo(pixels.dtype).max
    flat = pixels.reshape(-1, 4)
    for strip in strips(len(flat)):
        part = flat[strip]
        r, g, b, a = part.T
        if not ((a == one).all() and (r == g).all() and (r == b).all()):
            return False
    return True


def halved(pixels: NDArray[Any], limit: int) -> NDArray[Any]:
    """The mean of so many texels each way that neither side is longer than `limit`: a power of
    two; what is left at the ends is left out."""
    height, width, channels = pixels.shape
    step = 1
    while max(height, width) > limit * step:
        step *= 2
    if step == 1:
        return pixels
    rows, columns = max(height // step, 1), max(width // step, 1)
    high, wide = min(step, height), min(step, width)
    found = np.empty((rows, columns, channels), pixels.dtype)
    for row in range(rows):
        part = pixels[row * high : (row + 1) * high, : columns * wide].astype(np.float32)
        mean = part.reshape(high, columns, wide, channels).mean(axis=(0, 2))
        found[row] = mean if pixels.dtype.kind == "f" else mean + 0.5
    return found
