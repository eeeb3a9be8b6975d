# SPDX-License-Identifier: GPL-3.0-or-later
"""The photon pass where lists stay on the device: several bounces a launch, and nothing is asked
before all is launched."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...streams import Compaction, Device, Reading, StreamError, Tally
from ..settings import Settings
from ..stage.needs import SceneNeeds
from ..stage.tables import Tables
from .bounces import SeveralBounces
from .deposits import DeviceDeposits
from .emission import Emission, rays_of
from .mapper import PhotonBatch, draw_of
from .one_bounce import OneBounce
from .paths import STREAM_WIDTH, PathsBySize

# After the first pass the host does not ask, but goes by what the passes before found, an eighth
# more, and this: by chance they differ by the square root of their number.
SPARE_PHOTONS = 1024
MEDIA_DEFINE = "#define MEDIA\n"  # photons carry what they are in
GUESSED = 2  # times that a photon lands, before any has


@dataclass
class _Flight:
    """A batch's photons under way."""

    batch: PhotonBatch
    paths: Any
    alive: int  # or more than are
    bounce: int = 0  # the next one
    looks: list[int] = field(default_factory=list)  # the next one after each launch
    at_most: list[int] = field(default_factory=list)  # may be alive after those launched ahead
    reading: Reading | None = None  # how many are


@dataclass
class _Foreseen:
    """What batches of so many photons found, whichever found the most."""

    photons: int
    landed: int
    alive: dict[int, int]  # before a bounce, of those at which the host looked

    def alive_before(self, bounce: int) -> int:
        """No more than before an earlier one."""
        known = (alive for before, alive in self.alive.items() if before <= bounce)
        return min(known, default=self.photons)


class DevicePhotonMapper:
    """What PhotonMapper does, by compute programs: the same photons to rounding."""

    def __init__(
        self,
        device: Device,
        tables: Tables,
        settings: Settings,
        needs: SceneNeeds,
        bounces: SeveralBounces | OneBounce,
    ) -> None:
        self._settings = settings
        self._most_bounces = needs.photon_bounces + 1  # with that in which a photon is cut off
        self._emission = Emission(device, "compute", tables, needs)
        self._paths: PathsBySize[Any] = PathsBySize(device, bounces.paths, needs.carries_medium)
        self._bounces = bounces
        self._compaction = Compaction(device, "paths", MEDIA_DEFINE * needs.carries_medium)
        self._tally = Tally(device, self._most_bounces)
        self._foreseen: dict[int, _Foreseen] = {}  # by the photons of a batch
        self._flight: _Flight | None = None
        self._dropped = 0  # deposits, before it
        self.deposits = DeviceDeposits(device, needs.caustics)
        self.unfinished = 0  # photons that the bounce limit cut off, over all passes

    def start(self, batch: PhotonBatch) -> None:
        """Launch a batch as far as the passes before tell what it needs, and wait for nothing."""
        photons = batch.all_photons
        self._dropped = self.deposits.dropped
        flight = self._flight = self._emit(batch)
        # By rule of three from passes of other photons, such as the one that tells the radii.
        foreseen = min(
            self._foreseen.values(),
            key=lambda foreseen: abs(foreseen.photons - photons),
            default=_Foreseen(photons, GUESSED * photons, {1: photons}),
        )
        scale = photons / foreseen.photons
        self.deposits.make_room(_and_some(scale * foreseen.landed))
        last = max(foreseen.alive)
        while flight.bounce < last:
            self._fly(flight)
            most = _and_some(scale * foreseen.alive_before(flight.bounce))
            flight.alive = min(flight.alive, most)
            flight.at_most.append(flight.alive)
        flight.reading = self._tally.ask()
        self.deposits.ask()

    def finish(self) -> DeviceDeposits:
        """The deposits of the batch that was started, once all its photons have ended."""
        flight = self._flight
        assert flight and flight.reading
        found = list(flight.reading.numbers())
        both = enumerate(zip(found, flight.at_most, strict=True))
        too_many = next((look for look, (alive, most) in both if alive > most), None)
        if too_many is not None:
            self._learn(flight, found[: too_many + 1])  # after it some are missing
            flight, found = self._again(flight), []
        else:
            flight.alive = found[-1]
        found += self._end(flight)
        if (landed := self.deposits.count) > self.deposits.room:
            flight = self._again(flight)
            self.deposits.make_room(landed)
            if landed > self.deposits.room:
                raise StreamError(f"{landed} deposits are more than the device's lists hold")
            found = self._end(flight)
        if flight.bounce == self._most_bounces:
            self.unfinished += flight.alive
        foreseen = self._learn(flight, found)
        foreseen.landed = max(foreseen.landed, landed)
        return self.deposits

    def rays(self, index: int, photons: int) -> NDArray[np.float32]:
        """As PhotonMapper.rays."""
        paths = self._paths.of(photons)
        self._emission.run(paths.fronts(), draw_of(self._settings, index), photons)
        return rays_of(paths.fronts())

    def launches(self) -> dict[str, int]:
        """How often each kernel has run."""
        return self._emission.launches() | self._bounces.launches()

    def _emit(self, batch: PhotonBatch) -> _Flight:
        """Begin a batch."""
        photons, draw = batch.all_photons, draw_of(self._settings, batch.index)
        paths = self._paths.of(photons)
        self._emission.run(paths.fronts(), draw, batch.photons, batch.passes)
        self.deposits.clear()
        self._tally.clear()
        self._bounces.make_room(photons)
        return _Flight(batch, paths, photons)

    def _again(self, flight: _Flight) -> _Flight:
        """Begin a batch once more, of which more photons lived than was foreseen."""
        self.deposits.dropped = self._dropped
        return self._emit(flight.batch)

    def _end(self, flight: _Flight) -> list[int]:
        """Trace a pass's photons until they have ended; how many were alive after each launch."""
        found = []
        while flight.alive and flight.bounce < self._most_bounces:
            self._fly(flight)
            flight.alive = self._tally.ask().numbers()[-1]
            found.append(flight.alive)
        return found

    def _learn(self, flight: _Flight, found: list[int]) -> _Foreseen:
        """Foresee as many photons alive as were found after a pass's first launches."""
        photons = flight.batch.all_photons
        foreseen = self._foreseen.setdefault(photons, _Foreseen(photons, 0, {}))
        for bounce, alive in zip(flight.looks, found, strict=False):
            foreseen.alive[bounce] = max(foreseen.alive.get(bounce, 0), alive)
        return foreseen

    def _fly(self, flight: _Flight) -> None:
        """Launch some bounces of the photons that are alive."""
        self._compact(flight)
        batch, paths, first = flight.batch, flight.paths, flight.bounce
        flight.bounce += self._bounces.run(batch, paths, first, self.deposits, self._tally)
        flight.looks.append(flight.bounce)

    def _compact(self, flight: _Flight) -> None:
        """Move the photons that are alive to smaller streams, in order, if that is worth it."""
        paths = flight.paths
        if not self._bounces.worth_compacting(paths, flight.bounce):
            return
        smaller = self._paths.halved(paths, flight.alive)
        if smaller is paths:
            return
        elements = paths.rows * STREAM_WIDTH
        textures = {name: stream.texture for name, stream in paths.fronts().items()}
        self._compaction.count(elements, {"direction": textures["direction"]})
        self._compaction.move(
            elements, textures, [pair.front.texture for pair in smaller.pairs.values()]
        )
        flight.paths = smaller

    def release(self) -> None:
        """Free streams and kernels."""
        self._paths.release()
        for item in (self._emission, self._bounces, self._compaction, self._tally, self.deposits):
            item.release()


def _and_some(number: float) -> int:
    """More than a number of photons that differs by chance."""
    most = math.ceil(number)
    return most + most // 8 + SPARE_PHOTONS
