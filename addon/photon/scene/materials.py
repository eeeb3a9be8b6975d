# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials and their lobes: what surfaces reflect and emit."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import SceneError
from .checks import BLACK, RGB, check_finite, triple
from .displacement import Displacement
from .media import NO_MEDIUM, Medium
from .programs import Program, Varying, check_program

MIRROR = np.inf  # Phong exponent of a perfect mirror
GLASS = ("glass", "ggx_glass", "dispersive_glass", "ggx_dispersive_glass")
# Kinds of lobes whose colour is their reflectance head-on: black ones reflect at grazing angles.
COATS = ("coat", "bent_coat")  # whose colour is their tint
FRESNEL_LOBES = (*COATS, "ggx_dielectric", "ggx_metal", *GLASS)
TRANSPARENT = "transparent"  # light goes straight on
SUBSURFACE = "subsurface"  # it scatters below the surface
WHITE: RGB = (1.0, 1.0, 1.0)
ALPHAS = ("alpha", "alpha_x", "alpha_y")  # parameters of microfacets
ROUNDING = 1e-5  # of reflectances that add up to 1


@dataclass(frozen=True)
class Lobe:
    """A lobe of one of the kinds of glsl/bsdf, whose files say what colour and parameters are."""

    kind: str
    colour: RGB
    parameters: Mapping[str, float | RGB] = field(default_factory=dict)
    weight: float = 1.0  # times all that it reflects
    # The albedo of what it lies over, which has what the lobe lets through.
    covered: RGB = BLACK
    # Its colour, weight, covered or parameters that the material's program gives in place of those.
    varying: Varying = field(default_factory=dict)
    over: int | None = None  # the material's lobe that lies over this one, before it in their order

    def check(self, who: str) -> None:
        """Raise SceneError naming the lobe's owner and the first value out of its range."""
        check_finite(f"{who}: colour", self.colour, 0.0)
        check_finite(f"{who}: covered", self.covered, 0.0)
        check_finite(f"{who}: weight", self.weight, 0.0)
        for name, value in self.parameters.items():
            check_finite(f"{who}: {name}", value, 0.0)

    @property
    def reflects(self) -> bool:
        """Whether it does, or has what it covers do."""
        own = self.may_be("colour") or self.kind in FRESNEL_LOBES
        return (self.may_be("weight") and own) or self.may_be("covered")

    def may_be(self, name: str) -> bool:
        """Whether its colour, weight or covered may be more than 0 anywhere."""
        return name in self.varying or bool(np.max(getattr(self, name)) > 0.0)

    @property
    def roughness(self) -> tuple[float, float]:
        """Of microfacets as broad as the lobe, where it is sharpest, as glsl/bsdf has it; 1 where
        its alpha, roughness or exponent do not tell. The least and the most that it may be
        anywhere."""
        given: Mapping[str, Any] = self.parameters
        alphas = [given[name] for name in ALPHAS if name in given]
        if self.varying.keys() & {"exponent", "roughness", *ALPHAS}:
            return 0.0, 1.0
        if "exponent" in given:
            found = float((2.0 / (given["exponent"] + 2.0)) ** 0.25)
        elif "roughness" in given:
            found = float(given["roughness"])
        else:
            found = math.sqrt(min(alphas, default=1.0))
        return found, found

    @property
    def is_anisotropic(self) -> bool:
        """Whether it is rougher along its tangent than across, or the other way round."""
        given = {**self.parameters, **self.varying}
        return given.get("alpha_x") != given.get("alpha_y")

    def reflected_head_on(self) -> NDArray[np.float64]:
        """What it reflects itself to a viewer straight above, but for its weight; about that."""
        if self.kind in COATS:
            given: Mapping[str, Any] = self.parameters
            f0 = ((given["ior"] - 1.0) / (given["ior"] + 1.0)) ** 2
            return np.full(3, min(given["cover"], 1.0) * f0)
        if self.kind == "sheen":  # next to nothing
            return np.zeros(3)
        return np.array(self.colour, np.float64)

    def most(self, below: Any) -> NDArray[np.float64]:
        """The most that it and what lies below it reflect, per channel, if lobes there reflect this
        at most: head-on, or at grazing angles, where it may hide all that."""
        bright = self.kind in FRESNEL_LOBES or "colour" in self.varying
        own = np.array(WHITE if bright else self.colour, np.float64)
        weight = max(self.weight, 1.0) if "weight" in self.varying else self.weight
        covered = WHITE if "covered" in self.varying else self.covered
        through = 1.0 - np.minimum(self.reflected_head_on().max(), 1.0)
        under = through * (np.array(covered) + below)
        return np.maximum(weight * own, weight * self.reflected_head_on() + under)


def reflecting(lobes: tuple[Lobe, ...]) -> tuple[Lobe, ...]:
    """Those that do, in their order, but what is transparent first, unless something lies over it:
    of more than two the first is never left to chance, and others would seldom be drawn beside what
    lets most light through. What others would lie over lies under what is over these."""
    is_first = [lobe.kind == TRANSPARENT and lobe.over is None for lobe in lobes]
    order = sorted(range(len(lobes)), key=lambda at: not is_first[at])
    kept = [at for at in order if lobes[at].reflects]
    places = dict(zip(kept, range(len(kept)), strict=True))

    def over(at: int | None) -> int | None:
        while at is not None and at not in places:
            at = lobes[at].over
        return None if at is None else places[at]

    return tuple(replace(lobes[at], over=over(lobes[at].over)) for at in kept)


def phong(colour: RGB, exponent: float = MIRROR) -> Lobe:
    """The paper's specular lobe: a mirror, or Phong's."""
    if math.isinf(exponent) and exponent > 0.0:
        return Lobe("mirror", colour)
    return Lobe("phong", colour, {"exponent": exponent})


@dataclass(frozen=True)
class Material:
    """BSDF = albedo / pi of a diffuse lobe that nothing covers, and other lobes; and emission."""

    name: str
    diffuse: RGB = (0.8, 0.8, 0.8)  # albedo
    lobes: tuple[Lobe, ...] = ()
    emission: RGB = BLACK  # radiance on both sides [W/(m^2 sr)]
    holdout: bool = False  # the eye sees nothing there, and nothing behind it
    program: Program = ()
    # Its diffuse albedo, emission, the normal of its smooth surface, "base", or the shading normal
    # about that one, that the program gives.
    varying: Varying = field(default_factory=dict)
    medium: Medium = NO_MEDIUM  # inside a mesh that wears it
    # Whether its transparent lobe stops light straight from lamps and emissive meshes; the world's
    # and what surfaces scatter it lets through.
    shades_lamps: bool = False
    # Whether its lobes share what there is, whatever its program gives of each.
    is_mixture: bool = False
    displacement: Displacement | None = None

    def check(self) -> None:
        """Raise SceneError naming the material and the first value out of its range."""
        who = f"material {self.name!r}"
        check_finite(f"{who}: diffuse", self.diffuse, 0.0)
        check_finite(f"{who}: emission", self.emission, 0.0)
        self.medium.check(who)
        for number, lobe in enumerate(self.lobes):
            lobe.check(f"{who}: {lobe.kind}")
            if lobe.over is not None and lobe.over not in range(number):
                raise SceneError(f"{who}: {lobe.kind}: over = {lobe.over} is no lobe before it")
        check_program(who, self.program, [self.varying, *(lobe.varying for lobe in self.lobes)])
        if self.displacement:
            self.displacement.check(f"{who}: displacement")

    @property
    def programs(self) -> tuple[Program, ...]:
        """Its own, and those of its displacement and medium."""
        moves = self.displacement.program if self.displacement else ()
        return (self.program, moves, self.medium.program)

    @property
    def is_emissive(self) -> bool:
        """Whether its triangles are lights."""
        return max(self.emission) > 0 or self.emits_by_program

    @property
    def emits(self) -> bool:
        """Whether they are, or what is inside them emits light."""
        return self.is_emissive or self.medium.glows

    @property
    def emits_by_program(self) -> bool:
        """Whether its program tells what they emit."""
        return "emission" in self.varying

    @property
    def is_transparent(self) -> bool:
        """Whether light goes straight on through it, all of it or some."""
        return any(lobe.kind == TRANSPARENT and lobe.reflects for lobe in self.lobes)

    @property
    def only_bounds(self) -> bool:
        """Whether nothing is there but where a medium ends."""
        others = self.is_emissive or self.is_diffuse or self.holdout or self.shades_lamps
        lobes = [lobe for lobe in self.lobes if lobe.reflects]
        clear = all(x.kind == TRANSPARENT and x.colour == WHITE and not x.varying for x in lobes)
        return self.medium.is_there and clear and self.is_transparent and not others

    @property
    def filters_no_lamps(self) -> bool:
        """Whether it is transparent, but not to light straight from lamps."""
        return self.shades_lamps and self.is_transparent

    @property
    def is_diffuse(self) -> bool:
        """Whether photons land on it."""
        bare = max(self.diffuse) > 0 or "diffuse" in self.varying
        return bare or self.scatters_below or any(x.may_be("covered") for x in self.lobes)

    @property
    def scatters_below(self) -> bool:
        """Whether it scatters light below its surface."""
        return any(lobe.kind == SUBSURFACE and lobe.reflects for lobe in self.lobes)

    @property
    def is_anisotropic(self) -> bool:
        """Whether what it reflects depends on a tangent."""
        return any(lobe.reflects and lobe.is_anisotropic for lobe in self.lobes)

    def head_on(self) -> NDArray[np.float64]:
        """What it reflects of light from everywhere to a viewer straight above, and lets straight
        on, per channel."""
        return np.add(*self._parts_head_on())

    def _parts_head_on(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """What it reflects, and what goes straight on."""
        reflected, straight = np.array(self.diffuse, np.float64), np.zeros(3)
        passed: list[float] = []  # what gets through each, and through what lies over it
        for lobe in self.lobes:
            own, above = lobe.reflected_head_on(), 1.0 if lobe.over is None else passed[lobe.over]
            passed.append(above * (1.0 - min(own.max(), 1.0)))
            to = straight if lobe.kind == TRANSPARENT else reflected
            to += above * lobe.weight * own
            reflected += passed[-1] * np.array(lobe.covered)
        return reflected, straight

    def clamped(self) -> Material:
        """The material of which no lobe by itself reflects more than it receives, nor tints more
        than all of what it lets through."""
        lobes = tuple(map(_bounded, self.lobes))
        return replace(self, diffuse=_clamped(self.diffuse), lobes=lobes)

    @property
    def is_too_bright(self) -> bool:
        """Whether its lobes, if none is given by a program, reflect more than they receive in some
        channel."""
        return not self.program and bool(self.head_on().max() > 1.0 + ROUNDING)

    @property
    def may_be_too_bright(self) -> bool:
        """Whether they may somewhere, seen from anywhere, if its program gives as much of each as
        it may."""
        return self.is_too_bright or (not self.is_mixture and max(self._most()) > 1.0 + ROUNDING)

    def _most(self) -> NDArray[np.float64]:
        """The most that it may reflect and let straight on, per channel."""
        most = np.array(WHITE if "diffuse" in self.varying else self.diffuse, np.float64)
        below: list[Any] = [0.0] * len(self.lobes)  # each: what lobes there reflect at most
        for number in range(len(self.lobes) - 1, -1, -1):
            lobe = self.lobes[number]
            found = lobe.most(below[number])
            if lobe.over is None:
                most = most + found
            else:
                below[lobe.over] = below[lobe.over] + found
        return most

    def conserving(self) -> Material:
        """The material without a program that reflects no more than it receives in any channel:
        what scatters is scaled down to what goes not straight on, as seen head-on. Photons, which
        bounce until they are absorbed, meet it so; in GLSL as seen from where they come (conserved
        in lib/material_lobes.glsl)."""
        if not self.is_too_bright:
            return self
        reflected, straight = self._parts_head_on()
        left = np.maximum(1.0 - straight, 0.0)
        share = np.divide(left, reflected, out=np.ones(3), where=reflected > left)
        return replace(
            self,
            diffuse=triple(self.diffuse * share),
            lobes=tuple(_scaled(lobe, share) for lobe in self.lobes),
        )


def _scaled(lobe: Lobe, by: NDArray[np.float64]) -> Lobe:
    keeps = lobe.kind in (*COATS, TRANSPARENT)
    colour = lobe.colour if keeps else triple(lobe.colour * by)
    return replace(lobe, colour=colour, covered=triple(lobe.covered * by))


def _bounded(lobe: Lobe) -> Lobe:
    lobe = replace(lobe, colour=_clamped(lobe.colour), covered=_clamped(lobe.covered))
    return replace(lobe, weight=lobe.weight / max(lobe.weight * max(lobe.reflected_head_on()), 1.0))


def _clamped(colour: RGB) -> RGB:
    return triple(np.minimum(colour, 1.0))
