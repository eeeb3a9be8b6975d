# SPDX-License-Identifier: GPL-3.0-or-later
"""Which rays meet surfaces, and how far lights go, as tables."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..kernels.records import LIGHT_LIMIT, VISIBILITY
from ..scene import ALL_RAYS, CAUSTICS, MOST_BOUNCES, TRANSPARENT, Light, Scene
from .kinds import Kind, lobe_kinds

LINKED_SET = 256  # what a set of Scene.linked is times this, beside bits of rays


def is_limited(lights: tuple[Light, ...]) -> bool:
    """Whether one of them casts no shadow, or not all of its light goes on."""
    return any(not x.casts_shadow or x.max_bounces < MOST_BOUNCES for x in lights)


def are_apart(lights: tuple[Light, ...], diffuse: bool = True, transmit: bool = True) -> bool:
    """Whether rays of some lobes find one of them, and those of others do not, of lobes some of
    which may be `diffuse`, and some may `transmit`."""
    found = [set(light.found_by) for light in lights if light.is_met_by_lobes]
    hidden = diffuse and any("diffuse" not in by for by in found)
    return hidden or (transmit and any(("chains" in by) != ("passing" in by) for by in found))


def are_linked(scene: Scene, lights: tuple[Light, ...]) -> bool:
    """Whether some light does not light all surfaces."""
    return len(scene.linked) > 0 or len(scene.excludes) > 0 or any(x.excludes for x in lights)


def casts_caustics(name: str) -> bool:
    """Whether light by a lobe of a kind is a caustic."""
    return name != TRANSPARENT and not lobe_kinds()[name].is_diffuse


def lacking_caustics(scene: Scene, lobes: Collection[Kind]) -> int:
    """Bits of CAUSTICS: of those that a scene with such lobes would have, and is not to have."""
    some = [kind for kind in lobes if casts_caustics(kind.name)]
    there = {"reflective": bool(some), "refractive": any(kind.transmits for kind in some)}
    lacking = [there[name] and name not in scene.caustics for name in CAUSTICS]
    return sum(1 << bit for bit, name in enumerate(lacking) if name)


def knows_rays(scene: Scene, lights: tuple[Light, ...]) -> bool:
    """Whether something may depend on which ray it is."""
    held_out = any(material.holdout for material in scene.materials)
    transparent = any(material.is_transparent for material in scene.materials)
    lacking = len(scene.caustics) < len(CAUSTICS)
    limited = is_limited(lights) or are_apart(lights)
    hidden = len(scene.visible) > 0 or are_linked(scene, lights)
    return hidden or held_out or limited or transparent or lacking


def visibility_table(scene: Scene) -> NDArray[Any]:
    """(S,) of VISIBILITY, one at least."""
    table = VISIBILITY.zeros(max(len(scene.surfaces), 1))
    table["rays"] = ALL_RAYS
    if len(scene.visible):
        table["rays"] = scene.visible
    if len(scene.linked):
        table["rays"] += LINKED_SET * scene.linked.astype(np.float32)
    return table


def limit_table(lights: tuple[Light, ...], count: int) -> NDArray[Any]:
    """(count,) of LIGHT_LIMIT, those of some lights first; of the others nothing is limited."""
    table = LIGHT_LIMIT.zeros(count)
    table["bounces"], table["shadowed"] = MOST_BOUNCES, 1.0
    for row, light in zip(table, lights, strict=False):
        row["bounces"], row["shadowed"] = light.max_bounces, float(light.casts_shadow)
    return table
