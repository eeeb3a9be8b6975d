# SPDX-License-Identifier: GPL-3.0-or-later
"""Area lights."""

from __future__ import annotations

import math

from ....photon.scene import Light, area_light, triple
from ..camera import is_skewed
from .common import Lamp, finished


def read(lamp: Lamp) -> Light | None:
    axes = lamp.axes()
    if axes is None:
        return None
    data = lamp.data
    across, axis, (wide, high, _) = axes
    if is_skewed(lamp.matrix[:3, :3]):
        lamp.notes.approximated(lamp.owner, "Skewed transform", "its sides are at right angles")
    is_even = data.shape in ("SQUARE", "DISK")
    width, height = wide * data.size, high * (data.size if is_even else data.size_y)
    if not min(width, height) > 0.0:
        lamp.notes.exact(lamp.owner, "Size", "it is zero: dark, as in Cycles")
        return None
    is_round = data.shape in ("DISK", "ELLIPSE")
    light = area_light(
        lamp.name,
        triple(lamp.matrix[:3, 3]),
        (1.0, 1.0, 1.0),
        axis,
        across,
        size=(width, height),
        is_round=is_round,
        spread=float(data.spread),
    )
    return finished(lamp, light, width * height * (math.pi / 4 if is_round else 1.0))
