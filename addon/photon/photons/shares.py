# SPDX-License-Identifier: GPL-3.0-or-later
"""How many of the photons each light gets: by what of its light reaches the picture.

Few photons of each light tell where it lands, and few eye rays what the picture shows. There a
light of n photons adds a / n to the irradiance's relative variance, of which the least is left
where n goes with the root of a. All of it is a function of seed and scene.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...streams import Device, Kernel, Stream
from ..kernels.records import HIT, RAY_DIRECTION, RAY_ORIGIN
from ..stage.light_tree import in_order
from ..stage.tables import Tables

MOST_GROUPS = 16  # of lights, whose photons are told apart
PHOTONS = 4096  # of each group
FIRST_PASS = 1 << 31  # numbers no pass of a picture has
VIEW = 64  # eye rays a side
WIDE = 3.0  # eye rays a side of a cell, or a little more
# Light that neither these photons nor these eye rays have met must be found by others: at least so
# many start by flux alone.
LEAST_BY_FLUX = 0.25
# Where less is gained photons start by flux alone, whatever the view: so they serve the next one.
LEAST_GAIN = 2.0
# A light of so much less flux than another has so few photons by flux that a pass of them spoils
# the mean of all.
OUTSHINES = 16.0

Doubles = NDArray[np.float64]


@dataclass(frozen=True)
class Cells:
    """Cells of space, each about as large as another in the picture."""

    pixel: float  # how wide an eye ray's is at distance 1 from the eye
    eye: list[float] | None  # None: it is as wide everywhere

    def of(self, places: Doubles) -> NDArray[np.int64]:
        """Those that places (n, 3) are in, (n, 4)."""
        away = np.ones(len(places))
        if self.eye is not None:
            away = np.linalg.norm(places - np.array(self.eye), axis=1)
        level = np.floor(np.log2(np.maximum(away, 1e-9)))
        at = np.floor(places / (WIDE * self.pixel * 2.0**level)[:, None])
        return np.column_stack([level, at]).astype(np.int64)


def seen_places(
    device: Device, send: Callable[..., Any], tracer: Kernel, tables: Tables
) -> Doubles:
    """Where rays through all of the picture end, (n, 3); `send` sends those of a region."""
    records = {"origin": RAY_ORIGIN, "direction": RAY_DIRECTION, "hit": HIT}
    streams = {name: Stream(device, record, (VIEW, VIEW)) for name, record in records.items()}
    send((0, 0, VIEW, VIEW), streams["origin"], streams["direction"])
    tracer.run(streams, tables.of(tracer))
    origin, direction, hit = (
        stream.download().reshape(-1, 4).astype(np.float64) for stream in streams.values()
    )
    for stream in streams.values():
        stream.release()
    met = hit[:, 1] > 0.0
    places: Doubles = origin[met, :3] + direction[met, :3] * hit[met, :1]
    return places


def groups_of(tables: Tables) -> list[NDArray[np.intp]]:
    """The lights that photons may start at, by what is close together."""
    lights = tables.lights
    used = np.flatnonzero(tables.by_flux > 0.0)
    if len(used) <= MOST_GROUPS:
        return [used[i : i + 1] for i in range(len(used))]
    distant = used[used < tables.distant_lights]
    near = used[len(distant) :]
    near = near[in_order(lights["position"][near].astype(np.float64))]
    return [part for part in (distant, *np.array_split(near, MOST_GROUPS - 1)) if len(part)]


class Shares:
    """Those of a pass's photons that start at each light.

    Where lights are about as bright, what the passes after pass 0 know is learned before the first
    of them: a first picture does not wait for it. Where one outshines another, all passes know.
    """

    def __init__(
        self, mapper: Any, tables: Tables, look: Callable[[], tuple[Cells, Doubles]]
    ) -> None:
        """`look` finds places that the picture shows, and cells of a size for them."""
        self._mapper, self._tables, self._look = mapper, tables, look
        self._learned: Doubles | None = None
        self._chosen: Doubles | None = None
        fluxes = [tables.by_flux[group].sum() for group in groups_of(tables)]
        self._first = 0 if max(fluxes) > OUTSHINES * min(fluxes) else 1  # pass that knows

    def set(self, index: int) -> None:
        """Let the photons of a pass start as they shall."""
        knows = index >= self._first
        if knows:
            self.learn()
        shares = self._learned if knows and self._learned is not None else self._tables.by_flux
        if shares is not self._chosen:
            self._tables.choose(shares)
            self._chosen = shares

    @property
    def are_learned(self) -> bool:
        """Whether a pass after pass 0 may be started without more photons than its own."""
        return self._learned is not None

    def learn(self) -> None:
        """Learn them, unless that was done."""
        if self.are_learned:
            return
        mapper = self._mapper
        before = mapper.unfinished, mapper.deposits.dropped
        found = find_shares(mapper, self._tables, *self._look())
        mapper.unfinished, mapper.deposits.dropped = before
        self._learned = self._tables.by_flux if found is None else found
        self._tables.choose(self._tables.by_flux)
        self._chosen = self._tables.by_flux


def find_shares(mapper: Any, tables: Tables, cells: Cells, places: Doubles) -> Doubles | None:
    """The probabilities (L,) with which photons start at lights; None: by flux alone.

    `places`: what the picture shows.
    """
    groups, by_flux = groups_of(tables), tables.by_flux
    if len(groups) < 2 or not len(places):
        return None
    landed = [_landed(mapper, tables, cells, group, at) for at, group in enumerate(groups)]
    tables.choose(by_flux)
    met = np.concatenate([cells.of(places), *(cell for cell, _ in landed)])
    _, number = np.unique(met, axis=0, return_inverse=True)
    number = number.ravel()
    count = int(number.max()) + 1
    seen = np.bincount(number[: len(places)], minlength=count).astype(float)
    flux = np.zeros((len(groups), count))
    first = len(places)
    for own, (cell, brought) in zip(flux, landed, strict=True):
        own += np.bincount(number[first : first + len(cell)], brought, count)
        first += len(cell)
    total = flux.sum(axis=0)
    known = (total > 0.0) & (seen > 0.0)
    if not known.any():
        return None
    group_flux = np.array([by_flux[group].sum() for group in groups])
    variance = group_flux * (flux[:, known] * (seen[known] / total[known] ** 2)).sum(axis=1)
    by_picture = np.sqrt(variance) / np.sqrt(variance).sum()
    least = max(LEAST_BY_FLUX, 1.0 - seen[known].sum() / seen.sum())
    share = least * group_flux + (1.0 - least) * by_picture
    if (variance / group_flux).sum() < LEAST_GAIN * (variance / share).sum():
        return None
    shares = np.zeros(len(by_flux))
    for group, own, all_of_it in zip(groups, share, group_flux, strict=True):
        shares[group] = by_flux[group] * (own / all_of_it)
    return shares


def _landed(
    mapper: Any, tables: Tables, cells: Cells, group: NDArray[np.intp], at: int
) -> tuple[NDArray[np.int64], Doubles]:
    """In which cells a group's photons land, and how much flux each brings there."""
    alone = np.zeros(len(tables.by_flux))
    alone[group] = tables.by_flux[group] / tables.by_flux[group].sum()
    tables.choose(alone)
    mapper.start(FIRST_PASS + at, PHOTONS)
    place, deposit = mapper.finish().arrays()
    return cells.of(place[:, :3].astype(np.float64)), deposit[:, :3].mean(axis=1).astype(float)
