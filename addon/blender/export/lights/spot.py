# SPDX-License-Identifier: GPL-3.0-or-later
"""Spotlights."""

from __future__ import annotations

from ....photon.scene import Light, spot_light, triple
from . import point
from .common import EVEN_SCALE, Lamp, finished


def read(lamp: Lamp) -> Light | None:
    axes = lamp.axes()
    if axes is None:
        return None
    across, axis, (wide, high, long) = axes
    stretch = wide / long, high / long
    if max(abs(x - 1.0) for x in stretch) <= EVEN_SCALE:
        stretch = (1.0, 1.0)
    radius, soft = point.size_of(lamp)
    light = spot_light(
        lamp.name,
        triple(lamp.matrix[:3, 3]),
        (1.0, 1.0, 1.0),
        axis,
        size=float(lamp.data.spot_size),
        blend=float(lamp.data.spot_blend),
        radius=radius,
        soft=soft,
        across=across,
        stretch=stretch,
    )
    return finished(lamp, light, point.unnormalized_factor(radius))
