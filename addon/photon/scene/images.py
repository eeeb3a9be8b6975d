# SPDX-License-Identifier: GPL-3.0-or-later
"""Images that lights refer to by number, and textures that programs of materials do."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import SceneError

# How a texture's channels are stored; whole numbers stand for 0 to 1.
TEXTURE_TYPES = tuple(map(np.dtype, (np.uint8, np.uint16, np.float16, np.float32)))
MOST_TEXELS = 65535  # of a texture's side
# Bits that are all set in what is not finite, by the bytes of a number.
_EXPONENTS = {2: (np.uint16, 0x7C00), 4: (np.uint32, 0x7F800000)}


@dataclass(frozen=True)
class Image:
    """Pixels in linear RGB; the first row is the lowest."""

    name: str
    pixels: NDArray[np.float32]  # (height, width, 3), finite, >= 0

    def check(self) -> None:
        """Raise SceneError naming the image if it is none."""
        shape, dtype = self.pixels.shape, self.pixels.dtype
        if len(shape) != 3 or shape[2] != 3 or not self.pixels.size or dtype != np.float32:
            raise SceneError(
                f"image {self.name!r}: expected float32[height, width, 3], "
                f"got {dtype.name}{list(shape)}"
            )
        if not (self.pixels.min() >= 0.0 and np.isfinite(self.pixels.max())):
            raise SceneError(f"image {self.name!r}: a pixel is not finite or below 0")


@dataclass(frozen=True)
class Texture:
    """Texels that the image node of a program reads; the first row is the lowest."""

    name: str
    pixels: NDArray[Any]  # (height, width, 1 or 4) of TEXTURE_TYPES: grey, or RGB and alpha; finite
    is_srgb: bool = False  # colours are interpolated as sRGB codes them, and decoded then
    tile: int = 0  # its UDIM number, if it is one of several that lie beside each other

    def check(self) -> None:
        """Raise SceneError naming the texture if it is none."""
        shape, dtype = self.pixels.shape, self.pixels.dtype
        types = [known.name for known in TEXTURE_TYPES]
        if len(shape) != 3 or shape[2] not in (1, 4) or not self.pixels.size:
            expected = "(height, width, 1 or 4)"
        elif dtype not in TEXTURE_TYPES:
            expected = f"one of {', '.join(types)}"
        elif max(shape) > MOST_TEXELS:
            expected = f"at most {MOST_TEXELS} texels a side"
        else:
            if not all_finite(self.pixels):
                raise SceneError(f"texture {self.name!r}: a texel is not finite")
            return
        raise SceneError(
            f"texture {self.name!r}: expected {expected}, got {dtype.name}{list(shape)}"
        )


def all_finite(pixels: NDArray[Any]) -> bool:
    """Whether no number is NaN or infinite; of half numbers faster than numpy's own."""
    if pixels.dtype.kind != "f":
        return True
    kind, exponent = _EXPONENTS[pixels.itemsize]
    return not any((row.view(kind) & exponent == exponent).any() for row in pixels)
