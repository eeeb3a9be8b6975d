# SPDX-License-Identifier: GPL-3.0-or-later
"""The space of a file's colours: linear Rec.709, unless it asks for another, Blender 5.0 on."""

from __future__ import annotations

from functools import lru_cache

import bpy
import numpy as np
from numpy.typing import NDArray

from .colour_spaces import to_linear
from .programs import LUMINANCE, Value, value

REC_709 = "Linear Rec.709"


def working_space() -> str:
    """Its name."""
    return str(getattr(getattr(bpy.data, "colorspace", None), "working_space", REC_709))


def from_rec709() -> NDArray[np.float64]:
    """(3, 3): what makes the file's colours of linear Rec.709."""
    return _from_rec709(working_space())


@lru_cache(maxsize=4)
def _from_rec709(space: str) -> NDArray[np.float64]:
    primaries = np.eye(3, 4, dtype=np.float32)
    if space == REC_709 or not to_linear(REC_709, primaries):
        return np.eye(3)
    return primaries[:, :3].T.astype(np.float64)


def luminance(colour: Value) -> Value:
    """A colour's, as a number."""
    if working_space() == REC_709:
        return colour.part("luminance")
    weights = luminance_weights()
    parts = (weight * colour.part(name) for name, weight in zip("xyz", weights, strict=True))
    return sum(parts, start=value(0.0))


def luminance_weights() -> NDArray[np.float64]:
    """(3,), of the file's colours."""
    found: NDArray[np.float64] = LUMINANCE @ np.linalg.inv(from_rec709())
    return found
