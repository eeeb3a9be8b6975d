# SPDX-License-Identifier: GPL-3.0-or-later
"""Images that lights refer to by number."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import SceneError


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
