# SPDX-License-Identifier: GPL-3.0-or-later
"""Attributes that geometry nodes store on instances."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from .strands import TYPES, read_numbers
from .triangles import read

Numbers = NDArray[np.float64]
NO_NUMBER = 0x7FFFFFFF  # in persistent_id, behind the last level
SAME_PLACE = 1e-4  # relative: as different as float32 products of one place may be


@dataclass
class _Level:
    """Instances that one geometry holds."""

    geometry: Any  # which owns all of these
    points: Any  # their point cloud
    references: list[Any]
    chosen: NDArray[np.int32]  # (N,) the reference of each
    transforms: Numbers  # (N, 4, 4)
    firsts: dict[int, int] | None  # which is the first of an id; None: they are numbered
    others: NDArray[np.intp]  # those that are not
    values: dict[str, Numbers | None] = field(default_factory=dict)

    def of(self, name: str) -> Numbers | None:
        """(N, 4), None if there is no such attribute."""
        if name not in self.values:
            self.values[name] = self._read(name)
        return self.values[name]

    def which(self, number: int, before: Numbers, whole: Numbers) -> int | None:
        """The instance that persistent_id has this number for, `before` what it is placed by and
        `whole` with it; None if there is none. Where points have ids, numbers are these; of several
        of one id all but the first have numbers of chance, and are known by their places."""
        if self.firsts is None:
            return number if 0 <= number < len(self.chosen) else None
        if number in self.firsts:
            return self.firsts[number]
        off = np.abs(before @ self.transforms[self.others] - whole).max(axis=(1, 2))
        nearest = int(off.argmin()) if len(off) else 0
        if not len(off) or off[nearest] > SAME_PLACE * np.abs(whole).max():
            return None
        return int(self.others[nearest])

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
        before, placed = (np.array(x.matrix_world, np.float64) for x in (parent, instance))
        for at, number in enumerate(ids):
            level = self._level(way, geometry)
            index = None if level is None else level.which(number, before, placed)
            if level is None or index is None:
                break
            geometry = level.references[level.chosen[index]]
            before = before @ level.transforms[index]
            whole = isinstance(geometry, (bpy.types.Object, bpy.types.Collection))
            if at == len(ids) - 1 and not whole:
                break  # the number is that of a component beside the instances
            values = level.of(name)
            found = found if values is None else values[index]
            way = (*way, int(level.chosen[index]))
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
    count = len(points.points)
    chosen = _integers(points, ".reference_index")
    columns = read_numbers(points, "instance_transform", "value", 16 * count).reshape(count, 4, 4)
    firsts, others = None, np.zeros(0, np.intp)
    if "id" in points.attributes:
        known, at = np.unique(_integers(points, "id"), return_index=True)
        firsts = dict(zip(known.tolist(), at.tolist(), strict=True))
        others = np.setdiff1d(np.arange(count), at)
    references = geometry.instance_references()
    return _Level(geometry, points, references, chosen, columns.swapaxes(1, 2), firsts, others)


def _integers(points: Any, name: str) -> NDArray[np.int32]:
    return read(points.attributes[name].data, "value", len(points.points), np.int32)


def hides_attributes(instance: bpy.types.DepsgraphObjectInstance) -> bool:
    """Whether geometry nodes placed it, and Blender, before 5.0, hides what they stored there."""
    if not instance.is_instance or instance.particle_system:
        return False
    parent = instance.parent
    nodes = any(modifier.type == "NODES" for modifier in parent.modifiers)
    return nodes and not hasattr(parent, "evaluated_geometry")
