# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's lights become lights of the renderer: a reader a kind, found by its Blender type."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

import bpy
import numpy as np
from numpy.typing import NDArray

from ....photon.scene import Image, Light
from ....photon.stage.kinds import light_kinds
from ..attributes import object_record
from ..report import Notes
from . import area, point, spot, sun
from .common import Lamp, limited, note_light, signed

__all__ = ["export_light", "seen"]

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
    lamp = Lamp(obj, matrix, record, f"Light '{obj.name}'", rays, notes, images)
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


def seen(lights: Iterable[Light]) -> list[Light]:
    """The lamps as the eye sees them in Cycles: if rays of lobes meet any, it sees all but suns,
    whether those meet these or not; else none."""
    all_of_them, kinds = list(lights), light_kinds()
    others = [x for x in all_of_them if x.kind != "sun"]
    if any(x.is_met_by_lobes and kinds[x.kind].is_met(x.parameters) for x in others):
        return all_of_them
    return [x if x.kind == "sun" else _unseen(x) for x in all_of_them]


def _unseen(light: Light) -> Light:
    return replace(light, found_by=tuple(x for x in light.found_by if x != "camera"))
