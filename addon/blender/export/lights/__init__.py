# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's lights become lights of the renderer: a reader a kind, found by its Blender type."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import bpy
import numpy as np
from numpy.typing import NDArray

from ....photon.scene import Image, Light
from ....photon.stage.kinds import light_kinds
from ..attributes import object_record
from ..report import Notes
from ..visibility import is_visible
from . import area, point, spot, sun
from .common import Lamp, by_rays, limited, note_light, signed

__all__ = ["Lamps"]

READERS: dict[str, Callable[[Lamp], Light | None]] = {
    "AREA": area.read,
    "POINT": point.read,
    "SPOT": spot.read,
    "SUN": sun.read,
}


def export_light(
    instance: bpy.types.DepsgraphObjectInstance,
    matrix: NDArray[np.float64],
    rays: int,
    images: list[Image],
    notes: Notes,
) -> tuple[Light, ...]:
    """Return the light placed by `matrix` and visible to these `rays` (bits), two if it takes light
    away and gives some; none if it is left out. Images that it refers to are appended."""
    obj, record = instance.object, object_record(instance, matrix)
    scatters = is_visible(instance, "volume_scatter")
    lamp = Lamp(obj, matrix, record, f"Light '{obj.name}'", rays, scatters, notes, images)
    if obj.data.type not in READERS:
        notes.ignored(lamp.owner, f"{obj.data.type.capitalize()} light", "it is left out")
        return ()
    if not np.isfinite(matrix).all():
        notes.ignored(lamp.owner, "Transform", "it is not finite, so the light is left out")
        return ()
    if obj.data.type == "AREA" and getattr(getattr(obj.data, "cycles", None), "is_portal", False):
        notes.exact(lamp.owner, "Portal", "it tells where the world shines in, and does not light")
        return ()
    note_light(lamp)
    light = READERS[obj.data.type](lamp)
    if not notes.mentions(lamp.owner):
        notes.exact(lamp.owner, f"{obj.data.type.capitalize()} light")
    return signed(limited(light, obj.data)) if light else ()


class Lamps:
    """The lamps of a scene."""

    def __init__(self, images: list[Image], notes: Notes) -> None:
        """Those images are appended to that they refer to."""
        self._images, self._notes = images, notes
        self._lights: list[Light] = []
        self._are_met = False

    def add(
        self,
        instance: bpy.types.DepsgraphObjectInstance,
        matrix: NDArray[np.float64],
        rays: int,
        group: str,
        excludes: int,
    ) -> None:
        """Read one, placed by `matrix`, visible to these `rays` (bits) and of a light group, which
        does not light some sets (bits)."""
        found = export_light(instance, matrix, rays, self._images, self._notes)
        self._lights += [replace(x, group=group, excludes=excludes) for x in found]
        self._are_met |= by_rays(instance.object.data) and any(map(_has_size, found))

    def as_the_eye_sees(self) -> list[Light]:
        """If rays of lobes may meet any in Cycles, it sees all but suns, whether those may meet
        these or not; else none."""
        if self._are_met:
            return self._lights
        return [x if x.kind == "sun" else x.unseen for x in self._lights]


def _has_size(light: Light) -> bool:
    kind = light_kinds()[light.kind]
    return light.kind != "sun" and kind.is_met(light.parameters) and any(light.power)
