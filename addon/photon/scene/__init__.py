# SPDX-License-Identifier: GPL-3.0-or-later
"""What is rendered: plain values, no Blender, no device."""

from .camera import Camera, Lens, Motion
from .images import Image
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
    environment_light,
    phong,
    point_light,
    spot_light,
    world_light,
)

__all__ = [
    "BLACK",
    "FOUND_BY",
    "MIRROR",
    "RGB",
    "SNAPSHOT_VERSION",
    "Camera",
    "Image",
    "Lens",
    "Light",
    "Lobe",
    "Material",
    "Motion",
    "Scene",
    "environment_light",
    "phong",
    "point_light",
    "spot_light",
    "world_light",
]
