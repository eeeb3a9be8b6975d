# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights: what they all have, and one of each kind in Blender's units.

A light's `power` is Blender's P = energy * colour * 2^exposure.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from ..errors import SceneError
from .checks import BLACK, RGB, check_finite
from .visibility import MOST_BOUNCES

# Half a spread [rad]: a narrower one is as good as parallel.
LEAST_SPREAD = 1e-3
# Who may find a light: the eye's rays; shadow rays of diffuse surfaces, of lobes that reflect, of
# those that let through, and of diffuse ones that do, of places in media; rays that lobes reflect,
# and those that pass through surfaces.
FOUND_BY = (
    "camera",
    "diffuse",
    "glossy",
    "transmission",
    "translucent",
    "media",
    "chains",
    "passing",
)
SURFACES = FOUND_BY[1:5]  # shadow rays of these
LIT = FOUND_BY[1:6]  # shadow rays of all kinds
GLOW = "glow"  # a kind
MOST_LINKED_SETS = 14  # of surfaces that lights tell apart: a float holds their bits with others


@dataclass(frozen=True)
class Light:
    """A light of one of the kinds of glsl/lights, whose files say what the parameters are, and in
    what unit the power is."""

    name: str
    kind: str
    position: RGB  # [m]
    power: RGB  # per channel, >= 0
    direction: RGB = (0.0, 0.0, -1.0)  # its axis
    parameters: Mapping[str, float | RGB] = field(default_factory=dict)
    across: RGB = (1.0, 0.0, 0.0)  # for kinds that are no bodies of revolution about the axis
    found_by: tuple[str, ...] = FOUND_BY
    casts_shadow: bool = True
    max_bounces: int = MOST_BOUNCES  # between it and the eye; 0: direct light alone
    # At a distance t [m] it is t^falloff t^2 / (smoothing + t^2) times as strong.
    falloff: int = 0  # 0: it falls off with the distance squared; 1; 2: not at all
    smoothing: float = 0.0  # [m^2]
    # How bright it is in each direction, times that: rows of even polar angles, from its direction
    # to behind it, of even azimuths, as IES files have them; none: equally.
    profile: tuple[tuple[float, ...], ...] = ()
    # The number of the scene's image of the colours that its power is multiplied by: of an area
    # light at each place on it, `across` to the right, else in each direction, where up is against
    # its own and `across` in the middle.
    gobo: int | None = None
    group: str = ""  # of Scene.light_groups
    subtracts: bool = False  # it takes away the light that it would give
    excludes: int = 0  # bits of the sets of Scene.linked that it does not light

    def check(self) -> None:
        """Raise SceneError naming the light and the first value out of its range."""
        who = f"light {self.name!r}"
        check_finite(f"{who}: position", self.position)
        check_finite(f"{who}: power", self.power, 0.0)
        for name, value in self.parameters.items():
            check_finite(f"{who}: {name}", value, 0.0)
        check_finite(f"{who}: smoothing", self.smoothing, 0.0)
        if self.profile:
            check_finite(f"{who}: profile", self.profile, 0.0)
            if len(self.profile) < 2 or not self.profile[0]:
                raise SceneError(f"{who}: a profile has two rows or more, of one column or more")
        if self.falloff not in (0, 1, 2):
            raise SceneError(f"{who}: falloff {self.falloff} is none of 0, 1, 2")
        for what, axis in (("direction", self.direction), ("across", self.across)):
            check_finite(f"{who}: {what}", axis)
            if not any(axis):
                raise SceneError(f"{who}: {what} {axis} has no length")
        if not 0 <= self.max_bounces <= MOST_BOUNCES:
            raise SceneError(
                f"{who}: max_bounces {self.max_bounces} is outside [0, {MOST_BOUNCES}]"
            )
        if self.excludes not in range(1 << MOST_LINKED_SETS):
            raise SceneError(f"{who}: excludes {self.excludes} has bits of no set")
        unknown = set(self.found_by) - set(FOUND_BY)
        if unknown:
            raise SceneError(f"{who}: found_by {unknown.pop()!r} is none of {', '.join(FOUND_BY)}")

    @property
    def images(self) -> tuple[object, ...]:
        """Numbers of the scene's images that it has."""
        own = (self.parameters["image"],) if "image" in self.parameters else ()
        return own if self.gobo is None else (*own, self.gobo)

    @property
    def cares_who_is_lit(self) -> bool:
        """Whether it brings something else than its flux, by how far and what a surface is."""
        all_kinds = {*LIT} <= set(self.found_by)
        falls_off = not (self.falloff or self.smoothing)
        is_for_all = all_kinds and falls_off and not self.excludes
        return not is_for_all or bool(self.parameters.get("soft"))

    @property
    def is_stretched(self) -> bool:
        """Whether its cone is not round."""
        return {self.parameters.get(f"stretch_{x}", 1.0) for x in "xy"} != {1.0}

    @property
    def lights_surfaces(self) -> bool:
        """Whether shadow rays of surfaces find it."""
        return not {*SURFACES}.isdisjoint(self.found_by)

    @property
    def is_asked(self) -> bool:
        """Whether shadow rays and photons ask for it."""
        return not {*LIT}.isdisjoint(self.found_by)

    def where_media(self, scatter: bool) -> Light:
        """The same where media `scatter` light. Where none does it is as if those found it that
        some surfaces find, so that nobody asks for what is in vain, or tells apart what is one."""
        if scatter:
            return self
        found = {*self.found_by} - {"media"} | ({"media"} if self.lights_surfaces else set())
        return replace(self, found_by=tuple(who for who in FOUND_BY if who in found))

    @property
    def unseen(self) -> Light:
        """The same, which the eye does not see."""
        return replace(self, found_by=tuple(who for who in self.found_by if who != "camera"))

    @property
    def is_met_by_lobes(self) -> bool:
        """Whether rays of some lobes find it."""
        return "chains" in self.found_by or "passing" in self.found_by


def point_light(
    name: str,
    position: RGB,
    power: RGB,
    radius: float = 0.0,
    soft: bool = False,
    found_by: tuple[str, ...] = FOUND_BY,
) -> Light:
    """A point light, or a sphere of a radius [m]; with a soft falloff a disc instead that faces
    whoever looks."""
    parameters = {"radius": radius, "soft": float(soft and radius > 0.0)}
    return Light(name, "point", position, power, parameters=parameters, found_by=found_by)


def glow_light(name: str, position: RGB, power: RGB, radius: float, surface: int = 0) -> Light:
    """What a medium emits about a place, as a ball of a radius [m], in a mesh of which a surface of
    the scene is; rays find it on their way."""
    parameters = {"radius": radius, "surface": float(surface)}
    return Light(name, GLOW, position, power, parameters=parameters, found_by=LIT)


def spot_light(
    name: str,
    position: RGB,
    power: RGB,
    direction: RGB = (0.0, 0.0, -1.0),
    *,
    size: float,
    blend: float,
    radius: float = 0.0,
    soft: bool = False,
    across: RGB = (1.0, 0.0, 0.0),
    stretch: tuple[float, float] = (1.0, 1.0),
    found_by: tuple[str, ...] = FOUND_BY,
) -> Light:
    """A spotlight, whose cone is `size` [rad] wide, in [0, pi], and fades in a share `blend` of
    it, in [0, 1]; SceneError for others. Then it is stretched, across and the other way."""
    if not 0.0 <= size <= np.pi * (1 + 1e-6):
        raise SceneError(f"light {name!r}: spot size {size} is outside [0, pi]")
    if not 0.0 <= blend <= 1.0:
        raise SceneError(f"light {name!r}: spot blend {blend} is outside [0, 1]")
    outer = 2.0 * math.sin(size / 4.0) ** 2  # 1 - cos(size / 2), exact for small angles
    parameters = {"radius": radius, "soft": float(soft and radius > 0.0)}
    parameters |= {"outer": outer, "inner": outer * (1.0 - blend)}
    parameters |= {"stretch_x": stretch[0], "stretch_y": stretch[1]}
    return Light(name, "spot", position, power, direction, parameters, across, found_by)


def area_light(
    name: str,
    position: RGB,
    power: RGB,
    direction: RGB = (0.0, 0.0, -1.0),
    across: RGB = (1.0, 0.0, 0.0),
    *,
    size: tuple[float, float],
    is_round: bool = False,
    spread: float = math.pi,
    found_by: tuple[str, ...] = FOUND_BY,
) -> Light:
    """A rectangle, or an ellipse, `size` [m] across and along. It shines as far as half of `spread`
    [rad] off its direction, all the flux of `power`; SceneError for no size, or a spread outside
    [0, pi]."""
    if not 0.0 <= spread <= np.pi * (1 + 1e-6):
        raise SceneError(f"light {name!r}: spread {spread} is outside [0, pi]")
    if not min(size) > 0.0:
        raise SceneError(f"light {name!r}: size {size} is not positive")
    half = min(max(spread / 2.0, LEAST_SPREAD), math.pi / 2)
    cotangent = 0.0 if spread >= math.pi * (1 - 1e-6) else 1.0 / math.tan(half)
    width, height = size
    parameters = {"width": width, "height": height, "round": float(is_round)}
    parameters |= {"cotangent": cotangent, "gain": 1.0 / (1.0 - half * cotangent)}
    return Light(name, "area", position, power, direction, parameters, across, found_by)


def sun_light(
    name: str,
    irradiance: RGB,
    direction: RGB = (0.0, 0.0, -1.0),
    angle: float = 0.0,
    found_by: tuple[str, ...] = FOUND_BY,
) -> Light:
    """A disc in the sky, `angle` [rad] wide, that brings `irradiance` [W/m^2] to what faces it;
    SceneError for an angle outside [0, pi]."""
    if not 0.0 <= angle <= np.pi * (1 + 1e-6):
        raise SceneError(f"light {name!r}: angle {angle} is outside [0, pi]")
    widest = 2.0 * math.sin(angle / 4.0) ** 2  # 1 - cos(angle / 2), exact for small angles
    parameters = {"widest": widest}
    return Light(name, "sun", BLACK, irradiance, direction, parameters, found_by=found_by)


def world_light(name: str, radiance: RGB, found_by: tuple[str, ...] = FOUND_BY) -> Light:
    """A world of one radiance [W/(m^2 sr)] from everywhere."""
    return Light(name, "world", BLACK, radiance, found_by=found_by)


def environment_light(
    name: str,
    image: int,
    factor: RGB = (1.0, 1.0, 1.0),
    up: RGB = (0.0, 0.0, 1.0),
    middle: RGB = (1.0, 0.0, 0.0),
    found_by: tuple[str, ...] = FOUND_BY,
) -> Light:
    """A world whose radiance is a factor times that of one of the scene's images, of all directions
    from `up` at its upper edge, and `middle` in the middle of its rows."""
    return Light(name, "environment", BLACK, factor, up, {"image": image}, middle, found_by)
