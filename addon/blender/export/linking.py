# SPDX-License-Identifier: GPL-3.0-or-later
"""Which lights light which objects, by Blender's Light Linking.

A lamp or emissive object may name a collection: what is in it is lit by it alone, or all but that.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...photon.scene import MOST_LINKED_SETS
from .report import Notes

# By an object's name and its library: whether a light's collection includes or excludes it.
Named = tuple[str, str]
Members = dict[Named, bool]


class Linking:
    """Of a scene: objects that the same lights light are one set; set 0 is of those that no
    collection names."""

    def __init__(self, depsgraph: bpy.types.Depsgraph, notes: Notes) -> None:
        """What is too much is noted."""
        self._members: dict[Named, Members] = {}
        # What is placed by instances alone is none of the depsgraph's objects.
        for obj in (x for x in depsgraph.ids if isinstance(x, bpy.types.Object)):
            if receivers := _receivers(obj.original):
                self._members[_named(obj.original)] = dict(_members(receivers))
        named = dict.fromkeys(name for some in self._members.values() for name in some)
        kinds = [tuple(some.get(name) for some in self._members.values()) for name in named]
        sets = dict.fromkeys([(None,) * len(self._members), *kinds])
        if len(sets) > MOST_LINKED_SETS:
            what = f"{len(sets)} sets of objects: from {MOST_LINKED_SETS} on, as no collection's"
            notes.approximated(f"Scene '{depsgraph.scene.name}'", "Light Linking", what)
        numbers = {kind: number for number, kind in enumerate(list(sets)[:MOST_LINKED_SETS])}
        self._sets = {name: numbers.get(kind, 0) for name, kind in zip(named, kinds, strict=True)}
        self._excluded = {
            light: sum(
                1 << number
                for kind, number in numbers.items()
                if not _lights(kind[at], {*some.values()})
            )
            for at, (light, some) in enumerate(self._members.items())
        }

    def set_of(self, instance: bpy.types.DepsgraphObjectInstance) -> int:
        """The set that an object or instance is in: its instancer's, if that is in any."""
        placed_by = instance.parent if instance.is_instance else instance.object
        own = self._sets.get(_named(instance.object.original), 0)
        return self._sets.get(_named(placed_by.original), 0) or own

    def excluded_by(self, instance: bpy.types.DepsgraphObjectInstance) -> int:
        """Bits of sets that the light of an object or instance does not light."""
        return self._excluded.get(_named(instance.object.original), 0)


def linked_arrays(links: list[tuple[int, int]]) -> dict[str, NDArray[Any]]:
    """Of each surface its set and the sets that it does not light, arrays of Scene; none where all
    are alike."""
    if not any(map(any, links)):
        return {}
    linked, excludes = np.array(links).T
    return {"linked": linked.astype(np.uint8), "excludes": excludes.astype(np.uint16)}


def _lights(state: bool | None, states: set[bool]) -> bool:
    """Whether a light whose collection has such members lights what is one, or none."""
    if True in states:
        return state is True
    return state is not False


def _named(obj: bpy.types.Object) -> Named:
    return obj.name, obj.library.filepath if obj.library else ""


def _receivers(obj: bpy.types.Object) -> bpy.types.Collection | None:
    linking = getattr(obj, "light_linking", None)
    return linking.receiver_collection if linking else None


def _members(collection: bpy.types.Collection) -> Iterator[tuple[Named, bool]]:
    """What is in collections in it, each by the state of its own, and then what is in it itself:
    the last one counts."""
    for child, entry in zip(collection.children, collection.collection_children, strict=True):
        for obj in child.all_objects:
            yield _named(obj), entry.light_linking.link_state == "INCLUDE"
    for obj, entry in zip(collection.objects, collection.collection_objects, strict=True):
        yield _named(obj), entry.light_linking.link_state == "INCLUDE"
