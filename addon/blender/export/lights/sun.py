# SPDX-License-Identifier: GPL-3.0-or-later
"""Suns."""

from __future__ import annotations

import math
from dataclasses import replace

from ....photon.scene import Light, sun_light
from .common import Lamp, finished


def read(lamp: Lamp) -> Light | None:
    axes = lamp.axes(has_size=False)
    if axes is None:
        return None
    angle = max(0.0, float(lamp.data.angle))
    light = replace(sun_light(lamp.name, (1.0, 1.0, 1.0), axes[1], angle), across=axes[0])
    return finished(lamp, light, math.pi * math.sin(angle / 2) ** 2 if angle > 0.0 else 1.0)
