# SPDX-License-Identifier: GPL-3.0-or-later
"""In which spaces Cycles interpolates smooth normals: it moves to the world what it can
(apply_static_transforms), of meshes of one user."""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import bpy
from numpy.typing import NDArray

from ...photon.scene import Moving
from ...photon.stage.normals import unit


class Space(NamedTuple):
    """Of a mesh in the scene."""

    user: Hashable  # what it shares with others
    is_turned: bool  # it is stretched, and Cycles moves it to the world if it is alone
    moving: int | None  # its place in what moves


def user_of(instance: bpy.types.DepsgraphObjectInstance, key: tuple[int, bool]) -> Hashable:
    """Who shares an instance's mesh of a key: of an object with materials of its own Cycles makes
    another one."""
    slots = instance.object.material_slots
    if instance.is_instance or all(slot.link != "OBJECT" for slot in slots):
        return key
    return *key, instance.object.name


def make_unit(
    spaces: Sequence[Space], corner_normals: list[NDArray[Any]], moving: list[Moving]
) -> None:
    """Make normals unit, of meshes and of what moves, where Cycles interpolates them in the
    world."""
    users = Counter(space.user for space in spaces)
    for number, space in enumerate(spaces):
        if not space.is_turned or users[space.user] > 1:
            continue
        corner_normals[number] = unit(corner_normals[number])
        if space.moving is not None:
            one = moving[space.moving]
            moving[space.moving] = replace(one, normals=unit(one.normals))
