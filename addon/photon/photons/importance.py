# SPDX-License-Identifier: GPL-3.0-or-later
"""The importance of photons: which of few reach what the picture shows, and how they started."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import photon_stream_native as native
from numpy.typing import NDArray

from ..stage.tables import Tables
from .landed import trace_few
from .mapper import Mapper
from .view import Doubles, View

LIGHT = 0  # dimension of random numbers, as in glsl/lib/rng.glsl
# How closest_to weighs the distance to its start over that to where rays meet.
PULL = 1e-3
# Direct light counts up to so many times what photons bring: what it outshines shall be found, too.
OUTSHONE = 10.0
OF_PASS = 0xFFFFFFFF  # the element whose numbers are a pass's


@dataclass(frozen=True)
class Importance:
    """Photons that count, how each started, and what it counts for (mass)."""

    light: NDArray[np.int64]  # (n,) that each started at
    numbers: NDArray[np.float32]  # (n, 4) in [0, 1) that it started by
    rays: Doubles  # (n, 6) where it started, and where to
    mass: Doubles  # (n,) what it adds to the picture's variance, if none were aimed
    known: float  # the share of what the picture shows that some reached
    _by_light: dict[int, Importance] = field(init=False, default_factory=dict)
    _about: dict[bytes, tuple[NDArray[np.float32], Doubles]] = field(
        init=False, default_factory=dict
    )

    def of(self, light: int) -> Importance:
        """Those of a light."""
        if light not in self._by_light:
            own = self.light == light
            self._by_light[light] = self if own.all() else self.part(np.flatnonzero(own))
        return self._by_light[light]

    def counted(self, light: int) -> int:
        """How many are of a light."""
        return len(self.of(light).mass)

    def about(self, middle: Doubles) -> tuple[NDArray[np.float32], Doubles]:
        """The numbers (n, 4) by which photons of a light afar start about a middle, and how much
        less dense they are."""
        key = middle.tobytes()
        if key not in self._about:
            on_disc, larger = native.disc_about(middle, self.rays)
            self._about[key] = np.concatenate([self.numbers[:, :2], on_disc], axis=1), larger
        return self._about[key]

    def part(self, which: Any) -> Importance:
        """Some of them."""
        numbers, rays = (np.ascontiguousarray(x[which]) for x in (self.numbers, self.rays))
        return Importance(self.light[which], numbers, rays, self.mass[which], self.known)


def importance_of(
    mapper: Mapper,
    tables: Tables,
    view: View,
    seed: int,
    index: int,
    photons: int,
    wide: float,
    direct_by_photons: bool,
) -> Importance | None:
    """Trace photons of a pass; None if none of them is of any use. `wide`: as of `View.cells`;
    `direct_by_photons`: they bring the direct light, too.

    A light of n photons adds a / n to the irradiance's relative variance in each cell, of which a
    photon that brings a share of the cell's flux tells the share's square. Direct light, which has
    no such noise, is part of that flux.
    """
    landed, shown = trace_few(mapper, index, photons), view.cells(wide)
    cell, count = shown.at(landed.places), len(shown.numbers)
    there = np.flatnonzero(cell >= 0)
    first = 0 if direct_by_photons else landed.first
    direct, rows = np.split(there, [np.searchsorted(there, first)])
    own, flux = cell[rows], landed.flux[rows]
    total = np.bincount(own, flux, count)
    direct_total = np.bincount(cell[direct], landed.flux[direct], count)
    total = total + np.minimum(direct_total, OUTSHONE * total)
    known = (shown.seen > 0.0) & (total > 0.0)
    if not known.any():
        return None
    importance = np.divide(shown.seen, total**2, out=np.zeros(count), where=known)
    mass = np.bincount(landed.numbers[rows], importance[own] * flux**2, photons)
    number = np.flatnonzero(mass).astype(np.uint32)
    mass = mass[number]
    light = lights_of(tables, number, seed, index, photons)
    numbers, weight = numbers_of(tables, light, number, seed, index)
    # Of so many photons of each light.
    mass = mass * photons * tables.lights["chosen"][light].astype(np.float64)
    rays = np.zeros((len(number), 6))
    if tables.distant_lights:
        rays = mapper.rays(index, photons)[number].astype(np.float64)
        weight = weight * _widened(tables, light, rays)
    told = float(shown.seen[known].sum() / shown.seen.sum())
    return Importance(light, numbers, rays, mass / weight, told)


def lights_of(
    tables: Tables, number: NDArray[np.uint32], seed: int, index: int, photons: int
) -> NDArray[np.int64]:
    """The lights that photons start at (glsl/kernels/generator.glsl)."""
    shift = native.random_numbers(np.array([OF_PASS], np.uint32), seed, index, LIGHT)[0, 0]
    share = (number.astype(np.float32) + shift) / np.float32(photons)
    found = np.searchsorted(tables.lights["cdf"], share, side="right")
    lights: NDArray[np.int64] = np.minimum(found, len(tables.lights) - 1)
    return lights


def numbers_of(
    tables: Tables, light: NDArray[np.int64], number: NDArray[np.uint32], seed: int, index: int
) -> tuple[NDArray[np.float32], Doubles]:
    """What photons of a learning pass start by, and their flux over what it is where none are
    aimed (photon_sequence of glsl/lib/rng.glsl)."""
    numbers, weight = native.random_numbers(number, seed, index, LIGHT), np.ones(len(number))
    for own, aim in (tables.aims.by_light if tables.aims else {}).items():
        those = np.flatnonzero(light == own)
        numbers[those], weight[those] = native.aimed_numbers(
            aim.nodes, 0, numbers[those], number[those], seed=seed, pass_index=index
        )
    return numbers, weight


def _widened(tables: Tables, light: NDArray[np.int64], rays: Doubles) -> Doubles:
    """How much larger the discs are that aimed photons start on."""
    weight = np.ones(len(light))
    for own, aim in (tables.aims.by_light if tables.aims else {}).items():
        if own < tables.distant_lights:
            those = light == own
            weight[those] = native.disc_about(aim.middle, rays[those])[1]
    return weight


def closest_to(rays: Doubles, weight: Doubles, begin: Doubles) -> Doubles:
    """The place that rays (n, 6) pass by closest, in the mean of squares by their weights (n,); of
    rays that are alike, as far along them as `begin`."""
    origin, direction = rays[:, :3], rays[:, 3:]
    weighted, along = weight[:, None] * direction, np.einsum("nj,nj->n", origin, direction)
    whole, pull = weight.sum(), PULL * weight.sum()
    matrix = (whole + pull) * np.eye(3) - weighted.T @ direction
    toward = weight @ origin - along @ weighted + pull * begin
    found: Doubles = np.linalg.solve(matrix, toward)
    return found


def frames_about(n: Doubles) -> tuple[Doubles, Doubles]:
    """Both vectors across unit vectors (n, 3), as frame_about of glsl/lib/sampling.glsl."""
    s = np.where(n[:, 2] >= 0.0, 1.0, -1.0)
    a = -1.0 / (s + n[:, 2])
    b = n[:, 0] * n[:, 1] * a
    x = np.column_stack([1.0 + s * n[:, 0] ** 2 * a, s * b, -s * n[:, 0]])
    return x, np.column_stack([b, s + n[:, 1] ** 2 * a, -n[:, 1]])
