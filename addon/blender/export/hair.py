# SPDX-License-Identifier: GPL-3.0-or-later
"""Export the hair of particle systems, as Cycles reads it: along paths that Blender has made."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import bpy
import numpy as np
from numpy.typing import NDArray

from .colour_spaces import decoded
from .strands import Strands, tubes

Floats = NDArray[np.float64]
MOST_KEYS = 1_000_000  # of an object's hair; of more every second, fourth, ... is left out


def has_hair(obj: bpy.types.Object) -> bool:
    """Whether particle systems of an evaluated object are rendered as paths."""
    return any(True for _ in _systems(obj))


def hair_of(obj: bpy.types.Object, viewport: bool) -> tuple[Strands, bool]:
    """The hair of an evaluated object in its own space, of systems in a row; whether it is finer
    than what stands for it."""
    steps = [(modifier, _steps(modifier, viewport)) for modifier in _systems(obj)]
    counts = [len(_numbers(modifier)) * count for modifier, count in steps]
    every = 1
    while sum(counts) > MOST_KEYS * every:
        every *= 2
    points, radii, lengths, slots = [np.zeros((0, 3))], [np.zeros(0)], [], []
    to_local = np.linalg.pinv(np.array(obj.matrix_world, np.float64))
    for modifier, count in steps:
        settings = modifier.particle_system.settings
        taken = sorted({*range(0, count, every), count - 1})
        numbers = _numbers(modifier)
        found = _paths(obj, modifier.particle_system, numbers, taken)
        found = found @ to_local[:3, :3].T + to_local[:3, 3]
        points.append(found.reshape(-1, 3))
        radii.append(_radii(settings, found).reshape(-1))
        lengths += [len(taken)] * len(numbers)
        slots += [max(settings.material - 1, 0)] * len(numbers)
    firsts = np.cumsum([0, *lengths]).astype(np.int32)
    made = tubes(np.concatenate(points), np.concatenate(radii), firsts, 1)
    most = max(len(obj.material_slots) - 1, 0)
    return replace(made, slots=np.minimum(slots, most).astype(np.int32)), every > 1


def uv_of_hair(obj: bpy.types.Object, name: str) -> Floats | None:
    """(C, 2), where hair grows on the UV map of that name, or without one on that which is active
    in renders; None if there is none."""
    layers = obj.data.uv_layers
    for number, layer in enumerate(layers):
        if layer.name == name or (not name and layer.active_render):
            return np.array(
                [
                    modifier.particle_system.uv_on_emitter(
                        modifier, particle=_root(modifier, at), particle_no=at, uv_no=number
                    )
                    for modifier in _systems(obj)
                    for at in _numbers(modifier)
                ],
                np.float64,
            ).reshape(-1, 2)
    return None


def colour_of_hair(obj: bpy.types.Object, name: str) -> Floats | None:
    """(C, 3), of a colour attribute of that name where hair grows; None if there is none of bytes
    at corners, which are all that Blender tells hair of."""
    corners = (x for x in obj.data.attributes if x.domain == "CORNER")
    names = [x.name for x in corners if x.data_type == "BYTE_COLOR"]
    if name not in names:
        return None
    found = [
        modifier.particle_system.mcol_on_emitter(
            modifier, particle=_root(modifier, at), particle_no=at, vcol_no=names.index(name)
        )
        for modifier in _systems(obj)
        for at in _numbers(modifier)
    ]
    return decoded(np.array(found, np.float64).reshape(-1, 3))


def _systems(obj: bpy.types.Object) -> Iterator[bpy.types.ParticleSystemModifier]:
    for modifier in obj.modifiers:
        if modifier.type == "PARTICLE_SYSTEM" and modifier.show_render:
            settings = modifier.particle_system.settings
            if settings.type == "HAIR" and settings.render_type == "PATH":
                yield modifier


def _numbers(modifier: bpy.types.ParticleSystemModifier) -> range:
    """Of the hair: children in place of their parents, if there are any."""
    system = modifier.particle_system
    parents, children = len(system.particles), len(system.child_particles)
    if system.settings.child_type != "NONE" and children:
        return range(parents, parents + children)
    return range(parents + children)


def _root(modifier: bpy.types.ParticleSystemModifier, number: int) -> bpy.types.Particle:
    """A child has none of its own, and Blender asks for none then."""
    particles = modifier.particle_system.particles
    return particles[number if number < len(particles) else 0]


def _steps(modifier: bpy.types.ParticleSystemModifier, viewport: bool) -> int:
    """Points of a hair."""
    settings = modifier.particle_system.settings
    steps = (1 << (settings.display_step if viewport else settings.render_step)) + 1
    return steps + (settings.kink_extra_steps if settings.kink == "SPIRAL" else 0)


def _paths(
    obj: bpy.types.Object, system: bpy.types.ParticleSystem, numbers: range, taken: list[int]
) -> Floats:
    """Points (C, P, 3) in the world."""
    place = system.co_hair
    found = [place(obj, particle_no=number, step=step) for number in numbers for step in taken]
    return np.array(found, np.float64).reshape(len(numbers), len(taken), 3)


def _radii(settings: bpy.types.ParticleSettings, points: Floats) -> Floats:
    """(C, P), from root to tip by the way along the hair, as Cycles has it."""
    ways = np.linalg.norm(np.diff(points, axis=1), axis=2).cumsum(axis=1)
    ways = np.concatenate([np.zeros((len(ways), 1)), ways], axis=1)
    whole = ways[:, -1:]
    left = 1.0 - np.divide(ways, whole, out=np.zeros_like(ways), where=whole > 0.0)
    shape = float(settings.shape)
    power = 1.0 + shape if shape < 0.0 else 1.0 / max(1.0 - shape, 1e-6)
    root, tip = settings.root_radius, settings.tip_radius
    radii: Floats = 0.5 * settings.radius_scale * (left.clip(0.0) ** power * (root - tip) + tip)
    if settings.use_close_tip:
        radii[:, -1] = 0.0
    return radii
