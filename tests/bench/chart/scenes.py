# SPDX-License-Identifier: GPL-3.0-or-later
"""The scenes of the chart and their references in two halves."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

BLEND_SCENES = Path(__file__).resolve().parents[3] / "blend_scenes"
SIZE = 256  # [px] of the square pictures
SCENES = (
    "cornell_classic",
    "door_ajar",
    "mirror_caustic",
    "caustic_in_mirror",
    "many_lights",
    "glossy_room",
    "cornell_mirror",
    "cornell_box",
    "studio",
    "daylight",
    "kitchen",
    "wine_glass",
    "pool",
    "ring",
    "glass_in_mirror",
    "sunlit_window",
    "glass_bulb",
    "frosted_glass",
)
# Of lamps that are made to have no size.
CAUSTICS = ("wine_glass", "pool", "ring", "glass_in_mirror", "sunlit_window")
# Left and lower edge [px] of the part of each picture that the page shows enlarged
CROPS = {
    "cornell_classic": (96, 24),
    "door_ajar": (96, 84),
    "mirror_caustic": (120, 140),
    "caustic_in_mirror": (96, 120),
    "many_lights": (150, 60),
    "glossy_room": (60, 50),
    "cornell_mirror": (30, 130),
    "cornell_box": (110, 20),
    "studio": (40, 80),
    "daylight": (60, 60),
    "kitchen": (60, 100),
    "wine_glass": (110, 90),
    "pool": (90, 70),
    "ring": (40, 70),
    "glass_in_mirror": (70, 50),
    "sunlit_window": (60, 50),
    "glass_bulb": (90, 110),
    "frosted_glass": (60, 70),
}
CROP = 80  # [px]


@dataclass(frozen=True)
class Reference:
    """Two pictures (h, w, 3) of independent noise, and how they were made."""

    a: Any
    b: Any
    notes: str

    @property
    def mean(self) -> Any:
        return (self.a + self.b) / 2


def blend_file(name: str) -> Path:
    return BLEND_SCENES / f"{name}.blend"


def reference_file(name: str) -> Path:
    return BLEND_SCENES / "references" / f"{name}_{SIZE}.exr"


def read_reference(name: str) -> Reference:
    """Both halves of a scene's reference, row 0 at the bottom."""
    import OpenEXR

    file = OpenEXR.File(str(reference_file(name)), separate_channels=True)
    channels = file.channels()
    a, b = (
        np.stack([channels[f"{half}.{c}"].pixels for c in "RGB"], -1)[::-1].astype(np.float64)
        for half in "AB"
    )
    return Reference(a, b, str(file.header().get("comments", "")))


def write_reference(name: str, reference: Reference) -> Path:
    """In half precision: 1e-7 of relMSE."""
    import OpenEXR

    channels = {
        f"{half}.{c}": np.ascontiguousarray(image[::-1, :, i].astype(np.float16))
        for half, image in (("A", reference.a), ("B", reference.b))
        for i, c in enumerate("RGB")
    }
    header = {
        "compression": OpenEXR.ZIP_COMPRESSION,
        "type": OpenEXR.scanlineimage,
        "comments": reference.notes,
    }
    path = reference_file(name)
    OpenEXR.File(header, channels).write(str(path))
    return path
