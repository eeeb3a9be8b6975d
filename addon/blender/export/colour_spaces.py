# SPDX-License-Identifier: GPL-3.0-or-later
"""What a colour space of Blender's configuration is to a renderer, and conversions from it.

Cycles asks OpenColorIO the same (src/scene/colorspace.cpp): spaces that are the scene's linear one,
or sRGB's curve, are known by what they do, whatever their names; others are converted.
"""

from __future__ import annotations

import enum
import importlib
import sys
from functools import lru_cache
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

AT_ONCE = 1 << 20  # pixels


class Space(enum.Enum):
    """How numbers of an image stand for colours."""

    DATA = "data"  # for none
    LINEAR = "linear"  # as the scene's
    SRGB = "sRGB"  # coded by sRGB's curve
    OTHER = "other"


# By name, where there is no OpenColorIO to ask.
KNOWN = {"Linear Rec.709": Space.LINEAR, "scene_linear": Space.LINEAR, "sRGB": Space.SRGB}


def colour_space_of(settings: bpy.types.ColorManagedInputColorspaceSettings) -> Space:
    """The kind of an image's colour space."""
    if settings.is_data:
        return Space.DATA
    processor = _processor(settings.name)
    if processor is None:
        return KNOWN.get(settings.name, Space.OTHER)
    ramp = np.linspace(0.0, 1.0, 256, dtype=np.float32)
    probes = np.zeros((4, 256, 4), np.float32)
    for channel in range(3):
        probes[channel, :, channel] = probes[3, :, channel] = ramp
    found = probes.copy()
    processor.applyRGBA(found)
    if np.allclose(found[..., :3], probes[..., :3], rtol=0.0, atol=1e-5):
        return Space.LINEAR
    is_srgb = np.allclose(found[..., :3], decoded(probes[..., :3]), rtol=0.0, atol=1e-4)
    return Space.SRGB if is_srgb else Space.OTHER


def to_linear(name: str, pixels: NDArray[np.float32]) -> bool:
    """Convert (n, 4) colours in place, their alpha stays; False if there is no way to."""
    processor = _processor(name)
    if processor is None:
        return False
    for first in range(0, len(pixels), AT_ONCE):
        processor.applyRGBA(pixels[first : first + AT_ONCE])
    return True


def decoded(coded: NDArray[Any]) -> NDArray[Any]:
    """Linear numbers that sRGB's curve codes as these."""
    positive = np.maximum(coded, 0.0)
    curve: NDArray[Any] = np.where(
        positive < 0.04045, positive / 12.92, ((positive + 0.055) / 1.055) ** 2.4
    )
    return curve


def coded(linear: NDArray[Any]) -> NDArray[Any]:
    """The other way round."""
    positive = np.maximum(linear, 0.0)
    curve: NDArray[Any] = np.where(
        positive < 0.0031308, positive * 12.92, 1.055 * positive ** (1.0 / 2.4) - 0.055
    )
    return curve


def _processor(name: str) -> Any:
    """OpenColorIO's, from a space of Blender's configuration to the scene's; None: unknown."""
    library = _open_colour_io()
    if library is None:
        return None
    try:
        found = library.GetCurrentConfig().getProcessor(name, "scene_linear")
        return found.getDefaultCPUProcessor()
    except Exception:  # its own kinds, of which not all versions have the same
        return None


@lru_cache(maxsize=1)
def _open_colour_io() -> Any:
    """Blender's own, which knows its configuration; PyPI's bpy has it where Python does not
    look."""
    here = Path(bpy.utils.resource_path("LOCAL")) / "python"
    before = list(sys.path)
    sys.path += [str(folder.parent) for folder in here.glob("**/site-packages/PyOpenColorIO")]
    try:
        return importlib.import_module("PyOpenColorIO")
    except ImportError:
        return None
    finally:
        sys.path[:] = before
