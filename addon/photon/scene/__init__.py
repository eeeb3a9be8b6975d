# SPDX-License-Identifier: GPL-3.0-or-later
"""What is rendered: plain values, no Blender, no device."""

from .camera import Camera, Lens, Motion
from .values import (
    BLACK,
    FOUND_BY,
    MIRROR,
    RGB,
    SNAPSHOT_VERSION,
    Light,
    Lobe,
    Material,
    Scene,
    phong,
    point_light,
    spot_light,
    world_light,
)
from .visibility import ALL_RAYS, HOLDOUT, MOST_BOUNCES, RAY_BITS, RAYS

__all__ = [
    "ALL_RAYS",
    "BLACK",
    "FOUND_BY",
    "HOLDOUT",
    "MIRROR",
    "MOST_BOUNCES",
    "RAYS",
    "RAY_BITS",
    "RGB",
    "SNAPSHOT_VERSION",
    "Camera",
    "Lens",
    "Light",
    "Lobe",
    "Material",
    "Motion",
    "Scene",
    "phong",
    "point_light",
    "spot_light",
    "world_light",
]
