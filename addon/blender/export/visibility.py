# SPDX-License-Identifier: GPL-3.0-or-later
"""Export to which rays objects are visible, as Cycles has it."""

from __future__ import annotations

import bpy

from ...photon.scene import ALL_RAYS, HOLDOUT, RAY_BITS
from .report import Notes


def visible_bits(instance: bpy.types.DepsgraphObjectInstance, layer: bpy.types.ViewLayer) -> int:
    """Bits of Scene.visible of an object, or of an instance: what its instancer may be seen by,
    too; the collections of a view layer count for the instancer."""
    obj = instance.object
    placed_by = instance.parent if instance.is_instance else obj
    bits = ALL_RAYS
    for name, bit in RAY_BITS.items():
        flag = f"visible_{name}"
        if not (getattr(obj, flag, True) and getattr(placed_by, flag, True)):
            bits &= ~bit
    in_collections = placed_by.original
    if in_collections.holdout_get(view_layer=layer):
        return bits | HOLDOUT
    if in_collections.indirect_only_get(view_layer=layer):
        bits &= ~RAY_BITS["camera"]
    return bits


def note_light_groups(layer: bpy.types.ViewLayer, notes: Notes) -> None:
    """Write down that what a view layer's light groups send is not told apart."""
    names = ", ".join(f"Combined_{group.name}" for group in layer.lightgroups)
    if names:
        notes.ignored(f"View Layer '{layer.name}'", "Light Groups", f"there are no passes {names}")
