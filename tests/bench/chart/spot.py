# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's spotlight profile, for the engines that take it as a table."""

from __future__ import annotations

import math
from typing import Any

import numpy as np


def spot_profile(angle: Any, size: float, blend: float) -> Any:
    """Intensity at an angle from the axis [rad], relative to P / (4 pi): t^2 (3 - 2 t)."""
    edge = math.cos(size / 2)
    width = (1.0 - edge) * blend
    inside = np.cos(angle) - edge
    t = np.clip(inside / width, 0.0, 1.0) if width > 0 else (inside > 0).astype(float)
    return t * t * (3.0 - 2.0 * t)
