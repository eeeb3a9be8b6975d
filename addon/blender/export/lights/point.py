# SPDX-License-Identifier: GPL-3.0-or-later
"""Point lights."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ....photon.scene import Light, point_light, triple
from .common import Lamp, finished


def read(lamp: Lamp) -> Light:
    radius, soft = size_of(lamp)
    light = point_light(lamp.name, triple(lamp.matrix[:3, 3]), (1.0, 1.0, 1.0), radius, soft)
    if np.linalg.norm(lamp.matrix[:3, :3], axis=0).min() > 0.0:  # else it has no directions
        _, _, axes = lamp.matrix[:3, :3].T
        light = replace(light, direction=triple(-axes), across=triple(lamp.matrix[:3, 0]))
    return finished(lamp, light, unnormalized_factor(radius))


def size_of(lamp: Lamp) -> tuple[float, bool]:
    """The radius [m], and whether the falloff is soft."""
    radius = max(0.0, float(lamp.data.shadow_soft_size))
    return radius, bool(getattr(lamp.data, "use_soft_falloff", False))  # Blender 4.3 on


def unnormalized_factor(radius: float) -> float:
    """What Cycles multiplies by where Normalize is off: 4 for a light without size."""
    return 4.0 * math.pi * radius * radius if radius > 0.0 else 4.0
