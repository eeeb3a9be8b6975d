# SPDX-License-Identifier: GPL-3.0-or-later
"""What is rendered: plain values, no Blender, no device."""

from .camera import Camera, Lens, Motion
from .checks import BLACK, RGB
from .lights import (
    FOUND_BY,
    Light,
    area_light,
    point_light,
    spot_light,
    sun_light,
    world_light,
)
from .values import (
    MIRROR,
    SNAPSHOT_VERSION,
    Lobe,
    Material,
    Scene,
    phong,
)

__all__ = [
    "BLACK",
    "FOUND_BY",
    "MIRROR",
    "RGB",
    "SNAPSHOT_VERSION",
    "Camera",
    "Lens",
    "Light",
    "Lobe",
    "Material",
    "Motion",
    "Scene",
    "area_light",
    "phong",
    "point_light",
    "spot_light",
    "sun_light",
    "world_light",
]
