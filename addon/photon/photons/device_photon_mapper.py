# SPDX-License-Identifier: GPL-3.0-or-later
"""The photon pass where lists stay on the device: several bounces a launch, and nothing is asked
before all is launched."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ...streams import ByDefines, Compaction, Defines, Device, Reading, Stream, Tally
from ..kernels.records import DEPOSIT, PLACE
from ..settings import Settings
from ..stage.needs import SceneNeeds
from ..stage.tables import Tables
from .bounces import Bounces
from .deposits import DeviceDeposits
from .emission import Emission, rays_of
from .mapper import PhotonBatch, draw_of
from .photon_mapper import STREAM_WIDTH, Paths, PathsBySize

# Rows for what lands in one launch: photons take as many bounces in it as that has room for, for a
# launch costs a GPU more than dead photons do unless there are many.
LANDED_ROWS = 2048
# After the first pass the host does not ask, but goes by what the passes before found, an eighth
# more, and this: by chance they differ by the square root of their number.
SPARE_PHOTONS = 1024
GUESSED = 2  # times that a photon lands, before any has


def landed_rows(photons: int, bounces: int) -> int:
    """Rows for what lands of so many photons of so many bounces, in one launch."""
    rows = -(-photons // STREAM_WIDTH)
    return max(rows, min(LANDED_ROWS, rows * bounces))


@dataclass
class _Flight:
    """A batch's photons under way."""

    batch: PhotonBatch
    paths: Paths
    # In a launch, a bounce's above the last's: places, deposits, and the caustics' places if told.
    landed: tuple[Stream, ...]
    alive: int  # or more than are
    bounce: int = 0  # the next one
    looks: list[int] = field(default_factory=list)  # the next one after each launch
    at_most: list[int] = field(default_factory=list)  # may be alive after those launched ahead
    reading: Reading | None = None  # how many are


@dataclass
class _Foreseen:
    """What passes of so many photons found, whichever found the most."""

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
    ) -> None:
        self._device, self._tables, self._settings = device, tables, settings
        self._most_bounces = needs.photon_bounces + 1  # with that in which a photon is cut off
        self._emission = Emission(device, "compute", tables, needs)
        defines, made = needs.photon_defines, needs.made

        def bounces(more: Defines) -> Bounces:
            return Bounces(device, {**defines, **more}, made)

        self._bounces = ByDefines(bounces)
        self._bounces.of({})
        self._compaction = Compaction(device, "paths")
        self._tally = Tally(device, self._most_bounces)
        self._foreseen: dict[int, _Foreseen] = {}  # by the photons of a pass
        self._flight: _Flight | None = None
        self._dropped = 0  # deposits, before it
        self._paths = PathsBySize(device, Paths)
        self._landed: tuple[Stream, ...] = ()
        self._tells_caustics, self._covers = needs.caustics, needs.covers
        self.deposits = DeviceDeposits(device, needs.caustics)
        self.unfinished = 0  # photons that the bounce limit cut off, over all passes

    def start(self, batch: PhotonBatch) -> None:
        """Launch a batch as far as the passes before tell what it needs, and wait for nothing."""
        photons = batch.photons
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
            found = self._end(flight)
        if flight.bounce == self._most_bounces:
            self.unfinished += flight.alive
        foreseen = self._learn(flight, found)
        foreseen.landed = max(foreseen.landed, landed)
        return self.deposits

    def rays(self, index: int, photons: int) -> NDArray[np.float64]:
        """As PhotonMapper.rays."""
        paths = self._paths.of(photons)
        self._emission.run(paths.fronts(), draw_of(self._settings, index), photons)
        return rays_of(paths.fronts())

    def launches(self) -> dict[str, int]:
        """How often each kernel has run."""
        return self._emission.launches() | {Bounces.stem: self._bounces.launches}

    def _emit(self, batch: PhotonBatch) -> _Flight:
        """Begin a batch."""
        photons = batch.photons
        paths = self._paths.of(photons)
        self._emission.run(paths.fronts(), draw_of(self._settings, batch.index), photons)
        self.deposits.clear()
        self._tally.clear()
        landed = self._landed_of(landed_rows(photons, self._most_bounces))
        return _Flight(batch, paths, landed, photons)

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
        photons = flight.batch.photons
        foreseen = self._foreseen.setdefault(photons, _Foreseen(photons, 0, {}))
        for bounce, alive in zip(flight.looks, found, strict=False):
            foreseen.alive[bounce] = max(foreseen.alive.get(bounce, 0), alive)
        return foreseen

    def _fly(self, flight: _Flight) -> None:
        """Launch as many bounces as there is room for, of the photons that are alive."""
        self._compact(flight)
        batch, paths, first = flight.batch, flight.paths, flight.bounce
        program = self._bounces.of(self._tables.portal_defines(self._covers))
        bounces = min(flight.landed[0].size[1] // paths.rows, self._most_bounces - first)
        program.run(
            paths.fronts(),
            [*(pair.back for pair in paths.pairs()), *flight.landed],
            self._tables.of(program),
            self._tally.buffer,
            draw_of(self._settings, batch.index)
            | {"alive_slot": self._tally.next_slot(), "first_bounce": first, "bounces": bounces}
            | {"first_to_deposit": batch.first_to_deposit(self._settings)}
            | {"numbered": batch.numbered}
            | dict(self._tables.footprint),
        )
        place, deposit, *caustics = flight.landed
        caustic = dict(zip(("caustic",), caustics, strict=False))
        self.deposits.append(place, deposit, **caustic, rows=bounces * paths.rows)
        paths.swap()
        flight.bounce += bounces
        flight.looks.append(flight.bounce)

    def _compact(self, flight: _Flight) -> None:
        """Move the photons that are alive to smaller streams, in order, unless what is left takes
        one launch as it is."""
        paths, left = flight.paths, self._most_bounces - flight.bounce
        if paths.rows * left <= flight.landed[0].size[1]:
            return
        smaller = self._paths.halved(paths, flight.alive)
        if smaller is paths:
            return
        elements = paths.rows * STREAM_WIDTH
        textures = {name: stream.texture for name, stream in paths.fronts().items()}
        self._compaction.count(elements, {"direction": textures["direction"]})
        self._compaction.move(elements, textures, [p.front.texture for p in smaller.pairs()])
        flight.paths = smaller

    def _landed_of(self, rows: int) -> tuple[Stream, ...]:
        size = STREAM_WIDTH, rows
        if not self._landed or self._landed[0].size != size:
            self._release_landed()  # of passes of another size
            records = PLACE, DEPOSIT, *([PLACE] * self._tells_caustics)
            self._landed = tuple(Stream(self._device, record, size) for record in records)
        return self._landed

    def _release_landed(self) -> None:
        for stream in self._landed:
            stream.release()
        self._landed = ()

    def release(self) -> None:
        """Free streams and kernels."""
        self._paths.release()
        self._release_landed()
        for item in (self._emission, self._compaction, self._tally, self.deposits):
            item.release()


def _and_some(number: float) -> int:
    """More than a number of photons that differs by chance."""
    most = math.ceil(number)
    return most + most // 8 + SPARE_PHOTONS
