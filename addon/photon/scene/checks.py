# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers of a scene, and what all are asked."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from ..errors import SceneError

MOST_TRIANGLES = (1 << 24) - 1  # of a scene: float32 numbers them
RGB = tuple[float, float, float]  # or x, y, z
BLACK: RGB = (0.0, 0.0, 0.0)
NUMBERS = frozenset((float, int))


def triple(numbers: Iterable[float]) -> RGB:
    """Three numbers of any type, a colour's or a vector's, as a scene's values have them."""
    x, y, z = map(float, numbers)
    return x, y, z


def check_finite(what: str, values: Any, low: float = -np.inf) -> None:
    """Raise SceneError unless all numbers are finite and at least `low`."""
    # Scenes have thousands of colours and constants: numpy takes ten times as long for so few.
    is_plain = type(values) is tuple and NUMBERS.issuperset(map(type, values))
    if is_plain and all(math.isfinite(number) and number >= low for number in values):
        return
    array = np.asarray(values, np.float64)
    if not (np.isfinite(array).all() and (array >= low).all()):
        raise SceneError(f"{what} = {values} is not finite or below {low}")
