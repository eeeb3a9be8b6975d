# SPDX-License-Identifier: GPL-3.0-or-later
"""Attributes that geometry nodes store on instances."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from .strands import TYPES, read_numbers

Numbers = NDArray[np.float64]
NO_NUMBER = 0x7FFFFFFF  # in persistent_id, behind the last level


@dataclass
class _Level:
    """Instances that one geometry holds."""

    geometry: Any  # which owns all of these
    points: Any  # their point cloud
    references: list[Any]
    chosen: NDArray[np.int32]  # (N,) the reference of each
    values: dict[str, Numbers | None] = field(default_factory=dict)

    def of(self, name: str) -> Numbers | None:
        """(N, 4), None if there is no such attribute."""
        if name not in self.values:
            self.values[name] = self._read(name)
        return self.values[name]

    def _read(self, name: str) -> Numbers | None:
        attribute = self.points.attributes.get(name)
        if attribute is None or attribute.data_type not in TYPES:
            return None
        of_value, width = TYPES[attribute.data_type]
        count = len(attribute.data)
        values = read_numbers(self.points, name, of_value, count * width).reshape(count, width)
        found = np.zeros((count, 4))
        found[:, 3] = 1.0
        found[:, : max(width, 3)] = np.repeat(values, 3, axis=1) if width == 1 else values
        return found


class Instances:
    """What is asked of instances, read once a geometry."""

    def __init__(self) -> None:
        self._levels: dict[tuple[int, ...], _Level | None] = {}

    def attribute(self, instance: bpy.types.DepsgraphObjectInstance, name: str) -> Numbers | None:
        """(4,): of the innermost instance that has such an attribute; None if none has."""
        parent = instance.parent
        if not hasattr(parent, "evaluated_geometry"):  # before Blender 5.0
            return None
        ids = [number for number in instance.persistent_id if number != NO_NUMBER][::-1]
        way: tuple[int, ...] = (parent.as_pointer(),)
        geometry, found = parent, None
        for at, number in enumerate(ids):
            level = self._level(way, geometry)
            if level is None or not 0 <= number < len(level.chosen):
                break
            geometry = level.references[level.chosen[number]]
            whole = isinstance(geometry, (bpy.types.Object, bpy.types.Collection))
            if at == len(ids) - 1 and not whole:
                break  # the number is that of a component beside the instances
            values = level.of(name)
            found = found if values is None else values[number]
            way = (*way, int(level.chosen[number]))
            if isinstance(geometry, bpy.types.Collection):
                break
        return found

    def _level(self, way: tuple[int, ...], geometry: Any) -> _Level | None:
        if way not in self._levels:
            self._levels[way] = _read_level(geometry)
        return self._levels[way]


def _read_level(geometry: Any) -> _Level | None:
    if isinstance(geometry, bpy.types.Object):
        geometry = geometry.evaluated_geometry()
    points = geometry.instances_pointcloud()
    if points is None or not len(points.points):
        return None
    chosen = np.empty(len(points.points), np.int32)
    points.attributes[".reference_index"].data.foreach_get("value", chosen)
    return _Level(geometry, points, geometry.instance_references(), chosen)
