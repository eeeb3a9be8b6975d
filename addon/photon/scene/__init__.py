# SPDX-License-Identifier: GPL-3.0-or-later
"""What is rendered: plain values, no Blender, no device."""

from .camera import Camera, Lens, Motion
from .checks import BLACK, MOST_TRIANGLES, RGB, triple
from .displacement import Displacement
from .images import Image, Texture
from .lights import (
    FOUND_BY,
    GLOW,
    LIT,
    MOST_LINKED_SETS,
    Light,
    area_light,
    environment_light,
    glow_light,
    point_light,
    spot_light,
    sun_light,
    world_light,
)
from .materials import MIRROR, ROUNDING, SUBSURFACE, TRANSPARENT, Lobe, Material, phong, reflecting
from .media import COEFFICIENTS, NO_MEDIUM, Grid, Medium
from .moving import Moving
from .programs import Instruction, Result, Rows
from .values import SNAPSHOT_VERSION, TERMINATOR, Scene
from .visibility import ALL_RAYS, CATCHER, CAUSTICS, HOLDOUT, MOST_BOUNCES, RAY_BITS, RAYS

__all__ = [
    "ALL_RAYS",
    "BLACK",
    "CATCHER",
    "CAUSTICS",
    "COEFFICIENTS",
    "FOUND_BY",
    "GLOW",
    "HOLDOUT",
    "LIT",
    "MIRROR",
    "MOST_BOUNCES",
    "MOST_LINKED_SETS",
    "MOST_TRIANGLES",
    "NO_MEDIUM",
    "RAYS",
    "RAY_BITS",
    "RGB",
    "ROUNDING",
    "SNAPSHOT_VERSION",
    "SUBSURFACE",
    "TERMINATOR",
    "TRANSPARENT",
    "Camera",
    "Displacement",
    "Grid",
    "Image",
    "Instruction",
    "Lens",
    "Light",
    "Lobe",
    "Material",
    "Medium",
    "Motion",
    "Moving",
    "Result",
    "Rows",
    "Scene",
    "Texture",
    "area_light",
    "environment_light",
    "glow_light",
    "phong",
    "point_light",
    "reflecting",
    "spot_light",
    "sun_light",
    "triple",
    "world_light",
]
