# SPDX-License-Identifier: GPL-3.0-or-later
"""Photons start at the lights and places that count. A few photons traced before find these.

All of it is a function of seed and scene, made again by whoever needs it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..stage.aims import Aim, Aims
from ..stage.geometry import Mesh
from ..stage.kinds import light_kinds
from ..stage.tables import Tables
from .importance import Importance, importance_of
from .landed import trace_few
from .mapper import Mapper
from .photon_portals import portals_by, sees_lamp, sees_no_lamp
from .portals import LIFT, NO_PORTALS, portals_of
from .starts import (
    ENOUGH_PHOTONS,
    NO_AIMS,
    Starts,
    even_shares,
    proposed,
    starts_by,
    variance,
)
from .surroundings import Surrounded, faces_about, is_small, surrounded
from .toward import aims_toward
from .view import View

LEARNING_PASS = 1 << 31  # and above: numbers that no pass of a picture has
FIRST_PHOTONS, MOST_FIRST = 4096, 16384  # of each group of lights, and of all at most
# Then, where it may be worth it, of all, twice: each time by the importance found before.
PHOTONS = (1 << 16, 1 << 16)
PORTAL_PASS = LEARNING_PASS + 8  # and the next two: of photons that look for portals
RARE_PASS = LEARNING_PASS + 12  # of photons that tell whether any land
WIDE = 2.5  # how much wider cells are for the first photons
# Where half of what is seen has no photon, more look for it: of light from afar at all distances.
ENOUGH_KNOWN = 0.5
# A light that leaves more of the variance than this shall be told of by enough photons.
MUCH = 0.1
PROMISING = 1.3  # over the variance without; by a half of the photons, of the other half
# Where less is gained photons start by flux alone, whatever the view: so they serve the next one.
LEAST_GAIN_OF_SHARES = 2.0
LEAST_GAIN = 1.5
# A light of so much less flux than another has so few photons by flux that a pass of them spoils
# the mean of all.
OUTSHINES = 16.0
# Photons of a near light start at once by what the picture shows, where few reach that: passes that
# tell where.
TOWARD_PASS = LEARNING_PASS + 16
# Where a pass's photons land less often than this, for they leave the scene, all passes know.
FEW_LAND = 0.1
# From surfaces that emit half of them go to the box about what is shown; and those of a light of
# which so few count there start toward it, before they tell.
RARELY_LAND = 0.01
MOST_PLACES = 256  # that are asked whether a light shines on them
# Where there is one near light it is seldom worth while: so it is asked for when that takes little
# of what was rendered.
PASSES_OF_ONE = 16


class Aiming:
    """Lets photons of a pass start where they count.

    Where all lights are near and about as bright, what the passes after the first ones know is
    learned before the first of them: a first picture does not wait for it. Else all passes know:
    one of few photons where they count would spoil the mean of all.
    """

    def __init__(
        self,
        mapper: Mapper,
        tables: Tables,
        seed: int,
        look: Callable[[], View],
        mesh: Mesh,
        at_once: bool = False,
        eye: list[float] | None = None,
        *,
        direct_by_photons: bool,
    ) -> None:
        """`look` finds what the picture shows, of a mesh; `at_once`: all passes shall know; `eye`:
        where it is, if there is one; `direct_by_photons`: they bring the direct light, too."""
        self._mapper, self._tables, self._seed, self._look = mapper, tables, seed, look
        self._direct_by_photons = direct_by_photons
        self._plain = self._used = Starts(tables.by_flux, None)
        self._learned: Starts | None = None
        self._view: View | None = None
        self._surrounded: Surrounded | None = None
        self._is_small = False  # the picture, beside what light from afar comes to
        self._proposed: Mapping[int, Aim] = NO_AIMS  # for light from afar
        self._mesh = mesh
        tables.set_shadow_portals(NO_PORTALS)
        tables.set_photon_portals(NO_PORTALS)
        self._seeks = sees_no_lamp(mesh, tables, eye)
        self._is_outside = tables.distant_lights > 0
        self._is_rare = False
        fluxes = [tables.by_flux[group].sum() for group in tables.light_groups]
        outshone = bool(fluxes) and max(fluxes) > OUTSHINES * min(fluxes)
        late = 1 if len(fluxes) > 1 else PASSES_OF_ONE
        at_once = at_once or outshone or tables.distant_lights > 0 or self._seeks
        self._first = 0 if at_once else late  # pass that knows
        self._knows_at_once = at_once  # before any photon of pass 0 tells
        self._use(self._plain)

    def knows(self, index: int) -> bool:
        """Whether a pass may be started without more photons than its own."""
        return index < self._first or self._learned is not None

    def alike(self, index: int, passes: int) -> int:
        """How many of as many passes from one on have photons that start alike."""
        return min(passes, self._first - index) if index < self._first else passes

    def is_missed(self, landed: float) -> bool:
        """Whether photons that start by flux alone land so seldom, each in the mean, that all
        passes shall know; then they do."""
        shines = bool((self._tables.by_flux > 0.0).any())
        if not shines or self._first == 0 or landed >= FEW_LAND:
            return False
        self._first, self._is_rare, self._learned = 0, landed < RARELY_LAND, None
        return True

    @property
    def is_aimed(self) -> bool:
        """Whether photons start elsewhere than in pass 0 now."""
        return self._first > 0 and self._used.aims is not None

    @property
    def focus(self) -> NDArray[np.float32] | None:
        """Where photons are aimed at, (2, 3); None: everywhere."""
        return self._view.box() if self._view and self._used.aims else None

    def set(self, index: int) -> None:
        """Let the photons of a pass start as they shall."""
        if not self.knows(index):
            mapper = self._mapper
            before = mapper.unfinished, mapper.deposits.dropped
            self._learned = self._learn()
            mapper.unfinished, mapper.deposits.dropped = before
        starts = self._learned if index >= self._first else self._plain
        if starts and starts is not self._used:
            self._use(starts)

    def _use(self, starts: Starts) -> None:
        self._tables.choose(starts.shares)
        self._tables.aim(starts.aims)
        self._used = starts

    def _learn(self) -> Starts:
        self._view = view = self._look()
        tables = self._tables
        if not len(view.places):
            return self._plain
        if self._knows_at_once:
            self._is_rare = self._land_rarely()
        with ThreadPoolExecutor(1) as thread:  # while the host waits for photons
            if tables.has_world:
                passed = tables.transparent | tables.clear  # by shadow rays to it
                portals = thread.submit(portals_of, view, self._mesh, passed)
            starts = self._learn_starts(view)
        if tables.has_world:
            tables.set_shadow_portals(portals.result())
        return starts

    def _learn_starts(self, view: View) -> Starts:
        tables, self._surrounded = self._tables, None
        tables.set_photon_portals(NO_PORTALS)
        self._is_small = self._is_outside and is_small(view)
        self._propose(view)
        if self._is_small:
            self._use(self._by_proposals())
            self._surrounded = surrounded(self._mapper, view, self._mesh, PORTAL_PASS)
            if self._surrounded:
                tables.set_photon_portals(self._surrounded.faces, around=True)
                self._propose(view)
        starts = self._starts(view)
        if self._is_rare and _uses_no_portal(tables, starts):
            self._surrounded = None
            self._propose(view)
            tables.set_photon_portals(faces_about(view), around=True)
            starts = self._starts(view)
        if self._seeks:
            self._use(starts)
            tables.set_photon_portals(portals_by(self._mapper, tables, view, PORTAL_PASS))
        return starts

    def _land_rarely(self) -> bool:
        """Whether most photons are of surfaces that emit, of whose own so few fall on anything."""
        tables = self._tables
        if not _uses_no_portal(tables, self._plain):
            return False
        flux = np.where(_emit_by_cosine(tables), tables.by_flux, 0.0)
        self._use(Starts(flux / flux.sum(), None))
        tables.set_photon_portals(NO_PORTALS)
        landed = trace_few(self._mapper, RARE_PASS, FIRST_PHOTONS)
        return len(np.unique(landed.numbers)) < RARELY_LAND * FIRST_PHOTONS

    def _starts(self, view: View) -> Starts:
        """By what first photons tell, and by more where it may be worth it."""
        tables = self._tables
        # Where the picture is small hardly a photon of light from afar comes near by flux alone.
        by_flux = Starts(even_shares(tables), None)
        first = self._by_proposals() if self._is_small else by_flux
        importance = self._trace(first, 0, view, self._first_photons)
        plain = starts = self._by_shares(importance, view) if importance else self._plain
        missing, are_found = self._missing(importance, view), False
        for at, photons in enumerate(PHOTONS, 1):
            is_wanted = (
                are_found
                or importance is None
                or self._is_unknown(importance)
                or self._is_untold(importance)
                or self._promises(importance, view)
            )
            if not (is_wanted or missing):
                return plain
            starts = self._next(importance, missing, view)
            mixed = (starts.shares + even_shares(tables)) / 2
            importance = self._trace(Starts(mixed, starts.aims), at, view, photons)
            if importance is None:
                return plain
            are_found = any(importance.counted(light) >= ENOUGH_PHOTONS for light in missing)
            if not (is_wanted or are_found):
                return plain  # nothing of them comes there
            missing = frozenset()
        assert importance
        gain = variance(importance, tables, plain) / variance(importance, tables, starts)
        return self._by(importance, view) if gain >= LEAST_GAIN else plain

    def _by(self, importance: Importance, view: View) -> Starts:
        """By what is known."""
        proposals = self._proposed if self._is_small else NO_AIMS
        return starts_by(importance, self._tables, view, proposals=proposals)

    @property
    def _first_photons(self) -> int:
        return min(FIRST_PHOTONS * len(self._tables.light_groups), MOST_FIRST)

    def _trace(self, starts: Starts, at: int, view: View, photons: int) -> Importance | None:
        self._use(starts)
        index, wide = LEARNING_PASS + at, 1.0 if at else WIDE
        given = self._mapper, self._tables, view, self._seed
        found = importance_of(*given, index, photons, wide, self._direct_by_photons)
        if found and self._surrounded:  # nothing comes to the rest
            found = replace(found, known=min(found.known / self._surrounded.share, 1.0))
        return found

    def _by_shares(self, importance: Importance, view: View) -> Starts:
        """By lights alone, if that is worth it."""
        tables = self._tables
        starts = starts_by(importance, tables, view, are_aimed=False)
        gain = variance(importance, tables, self._plain) / variance(importance, tables, starts)
        return starts if gain >= LEAST_GAIN_OF_SHARES else self._plain

    def _promises(self, importance: Importance, view: View) -> bool:
        """Whether what either half of the photons tells is worth it to the other."""
        halves = importance.part(np.s_[::2]), importance.part(np.s_[1::2])
        return any(self._is_worth_it(one, other, view) for one, other in (halves, halves[::-1]))

    def _is_worth_it(self, one: Importance, other: Importance, view: View) -> bool:
        """Whether photons aimed by some leave others less variance."""
        tables = self._tables
        by_one = self._by(one, view)
        if by_one.aims is None:
            return False
        shares_alone = starts_by(one, tables, view, are_aimed=False)
        best = min(variance(other, tables, starts) for starts in (self._plain, shares_alone))
        return best > 0.0 and best >= PROMISING * variance(other, tables, by_one)

    def _is_untold(self, importance: Importance) -> bool:
        """Whether too few photons of a light tell where others shall start, though they leave much
        of the variance."""
        tables, count = self._tables, len(self._tables.by_flux)
        told = np.bincount(importance.light, minlength=count)
        moments = np.bincount(importance.light, importance.mass, count)
        left = np.divide(moments, tables.by_flux, out=np.zeros(count), where=tables.by_flux > 0.0)
        lone = [int(group[0]) for group in tables.light_groups if len(group) == 1]
        few = [x for x in lone if told[x] < 2 * ENOUGH_PHOTONS]  # each half is to have enough
        return bool((left[few] > MUCH * left.sum()).any())

    def _is_unknown(self, importance: Importance | None) -> bool:
        """Whether light may reach much of the picture that no photon has reached yet."""
        return importance is None or importance.known < ENOUGH_KNOWN

    def _missing(self, importance: Importance | None, view: View) -> frozenset[int]:
        """Near lights, each of a group of its own, of whose first photons hardly any counted, and
        that light what the picture shows."""
        tables, count = self._tables, len(self._tables.by_flux)
        counted = np.zeros(count)
        if importance:
            counted += np.bincount(importance.light, minlength=count)
        groups = tables.light_groups
        least = RARELY_LAND * self._first_photons / max(len(groups), 1)
        near = (group for group in groups if group[0] >= tables.distant_lights)
        lone = (int(group[0]) for group in near if len(group) == 1)
        return frozenset(x for x in lone if counted[x] < least and self._lights(x, view))

    def _lights(self, light: int, view: View) -> bool:
        """Whether some of what the picture shows sees it."""
        some = np.linspace(0, len(view.places) - 1, MOST_PLACES).astype(int)
        places, normals = view.places[some], view.normals[some]
        lamp = self._tables.lights["position"][light].astype(np.float64)
        faces = ((lamp - places) * normals).sum(axis=1) > 0.0
        return bool(sees_lamp(self._mesh, (places + LIFT * normals)[faces], lamp).any())

    def _next(self, importance: Importance | None, missing: frozenset[int], view: View) -> Starts:
        """By what is known; and by what the picture shows of light from afar, where little is, and
        of near lights whose photons are missing there."""
        tables = self._tables
        starts = self._by(importance, view) if importance else None
        aims = dict(starts.aims.by_light) if starts and starts.aims else {}
        is_unknown = tables.distant_lights > 0 and self._is_unknown(importance)
        if is_unknown:
            aims |= self._proposed
        if not (missing or aims or tables.distant_lights):
            missing = frozenset(int(group[0]) for group in tables.light_groups if len(group) == 1)
        if missing:
            given = self._mapper, tables, view, self._seed, TOWARD_PASS
            aims |= aims_toward(*given, sorted(missing), self._use)
        shares = even_shares(tables) if is_unknown or missing or not starts else starts.shares
        return Starts(shares, Aims(len(shares), aims) if aims else None)

    def _propose(self, view: View) -> None:
        """Aim light from afar at all distances from what the picture shows."""
        around, extent = self._surrounded, float(np.linalg.norm(self._mesh.extent))
        middle = around.middle if around else view.middle
        self._proposed = proposed(self._tables.distant_lights, view, extent, middle)

    def _by_proposals(self) -> Starts:
        shares = even_shares(self._tables)
        return Starts(shares, Aims(len(shares), self._proposed))


def _uses_no_portal(tables: Tables, starts: Starts) -> bool:
    """Whether most photons leave surfaces by the cosine, from lights that none are aimed from."""
    emits = _emit_by_cosine(tables)
    emits[list(starts.aims.by_light if starts.aims else ())] = False
    return bool(tables.by_flux[emits].sum() > 0.5 * tables.by_flux.sum())


def _emit_by_cosine(tables: Tables) -> NDArray[np.bool_]:
    """Of each light, whether photons leave it as they leave surfaces."""
    kinds = {kind.number for kind in light_kinds().values() if kind.emits_by_cosine}
    found: NDArray[np.bool_] = np.isin(tables.lights["kind"], [*kinds])
    return found
