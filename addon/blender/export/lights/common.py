# SPDX-License-Identifier: GPL-3.0-or-later
"""What lights of all kinds have: their place, their power, who sees them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ....photon.scene import MOST_BOUNCES, RAY_BITS, RGB, Image, Light, triple
from ..report import Notes
from .strength import strength_of

# Two axes count as equally long within matrix_world's float32 rounding.
EVEN_SCALE = 1e-4
# RNA names of what only EEVEE knows, with their neutral values.
EEVEE_FACTORS = {"diffuse_factor": "Diffuse", "specular_factor": "Specular"}


@dataclass(frozen=True)
class Lamp:
    """A light object that is being read."""

    obj: bpy.types.Object
    matrix: NDArray[np.float64]  # (4, 4) to the world
    record: NDArray[np.float64]  # (6, 4) as of Scene.objects
    owner: str  # "Light 'Sun'"
    rays: int  # bits of those that it is visible to
    scatters: bool  # it lights places in media
    notes: Notes
    images: list[Image]  # of the scene, to which its own are added

    @property
    def name(self) -> str:
        return str(self.obj.name)

    @property
    def data(self) -> Any:
        return self.obj.data

    def axes(self, has_size: bool = True) -> tuple[RGB, RGB, RGB] | None:
        """Its x axis, the direction that it shines in, and the lengths of its axes; None for one
        whose scale is zero, which is noted. Without a size it may be flat across its direction."""
        lengths = np.linalg.norm(self.matrix[:3, :3], axis=0)
        flat = lengths[:2] <= 0.0
        if not has_size and flat.any() and lengths[2] > 0.0:
            return (1.0, 0.0, 0.0), triple(-self.matrix[:3, 2] / lengths[2]), triple(lengths)
        if not lengths.min() > 0.0:
            self.notes.ignored(
                self.owner, "Transform", "its scale is zero, so the light is left out"
            )
            return None
        x, _, z = (self.matrix[:3, :3] / lengths).T
        return triple(x), triple(-z), triple(lengths)


def finished(lamp: Lamp, light: Light, unnormalized: float) -> Light:
    """A light of power 1 with the power that Cycles gives it, and found by whom Cycles shows it to.

    `unnormalized`: the factor on the power where Blender's Normalize is off. Each factor
    was checked against the irradiance that Cycles renders.
    """
    data, notes = lamp.data, lamp.notes
    power = np.array(data.color[:], np.float64) * data.energy
    power *= 2.0 ** getattr(data, "exposure", 0.0)  # Blender 4.4 on
    if getattr(data, "use_temperature", False):  # Blender 4.5 on
        power *= np.array(data.temperature_color[:], np.float64)
    if not getattr(data, "normalize", True):
        power *= unnormalized
    # 5.1 deprecates the switch: there, a light with a tree uses it.
    if data.node_tree and (bpy.app.version >= (5, 1) or data.use_nodes):
        strength = strength_of(lamp.obj, lamp.matrix, lamp.record, lamp.owner, notes)
        power *= strength.colour
        if strength.gobo is not None:
            light = replace(light, gobo=len(lamp.images))
            lamp.images.append(Image(lamp.name, strength.gobo))
        light = replace(
            light,
            falloff=strength.falloff,
            smoothing=strength.smoothing,
            profile=strength.profile,
        )
    if not np.isfinite(power).all():
        notes.approximated(lamp.owner, "Power", f"{_numbers(power)} W is not finite: set to 0")
        power = np.where(np.isfinite(power), power, 0.0)
    return replace(light, power=triple(power), found_by=_found_by(lamp))


def signed(light: Light) -> tuple[Light, ...]:
    """The light of a power of any sign as one that gives and one that takes away."""
    power = np.array(light.power)
    if power.min() >= 0.0:
        return (light,)
    away = replace(light, power=triple((-power).clip(0.0)), subtracts=True)
    given = replace(light, power=triple(power.clip(0.0)))
    return (given, away) if power.max() > 0.0 else (away,)


def found_by(visible: Mapping[str, object], is_met: bool = True) -> dict[str, bool]:
    """Who finds a light, by the kinds of rays that it is visible to: Cycles asks both kinds of what
    a diffuse lobe lets through. `is_met`: whether rays of lobes may meet it."""
    passes = bool(visible["transmission"])
    return {
        "camera": bool(visible["camera"]),
        "diffuse": bool(visible["diffuse"]),
        "glossy": bool(visible["glossy"]),
        "transmission": passes,
        "translucent": bool(visible["diffuse"]) and passes,
        "media": bool(visible["scatter"]),
        "chains": bool(visible["glossy"]) and is_met,
        "passing": passes and is_met,
    }


def by_rays(data: bpy.types.Light) -> bool:
    """Whether rays of lobes may meet a lamp."""
    cycles = getattr(data, "cycles", None)
    return bool(getattr(cycles, "use_multiple_importance_sampling", True))


def _found_by(lamp: Lamp) -> tuple[str, ...]:
    """As in Cycles: where its rays are not to find a sun, the eye's are not either."""
    visible = {name: lamp.rays & bit for name, bit in RAY_BITS.items()}
    visible["scatter"] = lamp.scatters
    is_met = by_rays(lamp.data)
    found = found_by(visible, is_met)
    found["camera"] &= is_met or lamp.data.type != "SUN"
    return tuple(name for name, is_found in found.items() if is_found)


def limited(light: Light, data: bpy.types.Light) -> Light:
    """The light with its Cast Shadow and Max Bounces."""
    cycles = getattr(data, "cycles", None)
    bounces = min(getattr(cycles, "max_bounces", MOST_BOUNCES), MOST_BOUNCES)
    # Cycles had a switch of its own up to Blender 4.2.
    shadow = data.use_shadow and getattr(cycles, "cast_shadow", True)
    return replace(light, casts_shadow=bool(shadow), max_bounces=bounces)


def note_light(lamp: Lamp) -> None:
    """Write down what the light asks for and the renderer does not know."""
    obj, data, name, notes = lamp.obj, lamp.data, lamp.owner, lamp.notes
    cycles = getattr(data, "cycles", None)
    if getattr(cycles, "max_bounces", MOST_BOUNCES) < MOST_BOUNCES:
        what = "its light in mirrors may have bounced as often before; none of its caustics escape"
        notes.approximated(name, "Max Bounces", what)
    for flag, label in EEVEE_FACTORS.items():
        if getattr(data, flag, 1.0) != 1.0:
            notes.ignored(name, f"{label} factor", "as in Cycles")
    linking = getattr(obj, "light_linking", None)
    if linking and linking.blocker_collection:
        notes.ignored(name, "Shadow Linking", "all things are in the way of its light")


def _numbers(values: NDArray[np.float64]) -> str:
    return "(" + ", ".join(f"{value:g}" for value in values) + ")"
