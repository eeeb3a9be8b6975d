# SPDX-License-Identifier: GPL-3.0-or-later
"""Export the world as lights."""

from __future__ import annotations

from dataclasses import replace

import bpy
import numpy as np

from ...photon.scene import (
    FOUND_BY,
    MOST_BOUNCES,
    NO_MEDIUM,
    RAYS,
    RGB,
    Image,
    Light,
    Medium,
    environment_light,
    sun_light,
    triple,
    world_light,
)
from .graph import Context
from .lights.common import found_by
from .materials import has_nodes
from .nodes import graph_of
from .radiance import ONE, Factor, Sum, radiance
from .report import Notes
from .shaders.volume import medium_of


def export_world(
    world: bpy.types.World | None,
    images: list[Image],
    notes: Notes,
    context: Context,
    is_shown: bool = True,
) -> tuple[tuple[Light, ...], Medium]:
    """Return the lights that the world is, and the medium that it fills all with, and append the
    images that the lights refer to; `context`: what its nodes know besides directions; `is_shown`:
    behind all else, as no transparent film shows it, nor a sky's sun."""
    if world is None:
        return (), NO_MEDIUM
    owner, medium = f"World '{world.name}'", NO_MEDIUM
    if has_nodes(world):
        graph = graph_of(world, owner, notes, context=context)
        total = radiance(graph, *graph.surface("OUTPUT_WORLD"))
        if output := graph.output("OUTPUT_WORLD"):
            medium = medium_of(graph, output, "world")
    else:
        total = Sum(ONE * np.array(world.color[:], np.float64))
    visible = _visible(world)
    lights = [
        world_light(world.name, colour, by)
        for colour, by in _by_factor(total.colour * visible, owner, notes)
    ]
    for name, environment, factor in total.images:
        middle, _, up = map(triple, environment.rows)
        found = _by_factor(factor * visible, owner, notes)
        lights += [
            environment_light(world.name, len(images), colour, up, middle, by)
            for colour, by in found
        ]
        if found:
            images.append(Image(name, environment.pixels))
    if not is_shown:
        visible[FOUND_BY.index("camera")] = 0.0
    lights += [
        sun_light(world.name, colour, disc.direction, disc.angle, by)
        for disc, factor in total.discs
        for colour, by in _by_factor(factor * disc.irradiance * visible, owner, notes)
    ]
    cycles = getattr(world, "cycles", None)
    bounces = min(getattr(cycles, "max_bounces", MOST_BOUNCES), MOST_BOUNCES)
    if bounces < MOST_BOUNCES and lights:
        what = "none of its light comes after so many; Cycles lets surfaces' own rays find some"
        notes.approximated(owner, "Max Bounces", what)
    if not notes.mentions(owner):
        notes.exact(owner, "Background")
    if medium.is_there and not medium.varies:
        notes.exact(owner, "Volume", "it hides the world, and suns, as in Cycles")
    return tuple(replace(light, max_bounces=bounces) for light in lights), medium


def _by_factor(factor: Factor, owner: str, notes: Notes) -> list[tuple[RGB, tuple[str, ...]]]:
    """Each factor that is not black, and those that find it."""
    valid = np.where(np.isfinite(factor), factor, 0.0).clip(0.0)
    if not np.array_equal(valid, factor):
        notes.approximated(owner, "Colour", "negative or not finite: clamped to 0")
    found: dict[RGB, tuple[str, ...]] = {}
    for by, (r, g, b) in zip(FOUND_BY, valid.tolist(), strict=True):
        if any((r, g, b)):
            found[r, g, b] = (*found.get((r, g, b), ()), by)
    return list(found.items())


def _visible(world: bpy.types.World) -> Factor:
    """(8, 1), of each of FOUND_BY: 0 for those that the world's ray visibility excludes."""
    flags = getattr(world, "cycles_visibility", None)
    found = found_by({name: getattr(flags, name, True) for name in (*RAYS, "scatter")})
    return np.array([[float(found[name])] for name in FOUND_BY])
