# SPDX-License-Identifier: GPL-3.0-or-later
"""The photon pass: Generator -> (Tracer -> Projector -> Reflector)* -> deposits."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import zip_longest

import numpy as np

from ..streams import Compaction, Device, PingPong, Reading, Stream, Tally
from ..streams.device import Layer
from .bounces import Bounces
from .deposits import Deposits, DeviceDeposits, HostDeposits
from .generator import Generator
from .geometry import Tables
from .needs import SceneNeeds
from .projector import Projector
from .records import DEPOSIT, FLUX, HIT, PLACE, RAY_DIRECTION, RAY_ORIGIN
from .reflector import Reflector
from .settings import Settings
from .tracer import Tracer

STREAM_WIDTH = 1024  # photons a row
# Photons of pass 0 that tell the radii, whichever passes are rendered. Where it has no more, they
# are its own and are not traced again: to the first picture 0.77 s, and 0.90 by 131072 photons
# (cornell_classic, 512x512, 2 cores).
PILOT_PHOTONS = 1 << 19
# A launch costs a GPU more than dead photons do unless there are many, and it waits while the host
# asks how many are alive. A pass's photons on an H200, asked at each bounce and left in place ->
# so: 8.5 -> 5.5 ms (2 million of them, cornell_classic), 3.0 -> 2.5 ms (262144).
BOUNCES_A_LOOK = 4
ROWS_WORTH_A_MOVE = 256
# So many photons a pass take all bounces up to a look in one launch, at most: it has streams for
# the deposits of each. A pass goes one way from end to end, for GPUs round each in its own way.
PHOTONS_AT_ONCE = 1 << 19
# After the first pass the host does not ask, but goes by what the passes before found, an eighth
# more, and this: by chance they differ by the square root of their number.
SPARE_PHOTONS = 1024
GUESSED = 2  # times that a photon lands, before any has


class _Paths:
    """The streams of photons under way; a size of its own once many have ended."""

    def __init__(self, device: Device, rows: int) -> None:
        size = (STREAM_WIDTH, rows)
        self.rows = rows
        self.origin = PingPong(device, RAY_ORIGIN, size)
        self.direction = PingPong(device, RAY_DIRECTION, size)
        self.flux = PingPong(device, FLUX, size)
        self.hit = Stream(device, HIT, size)
        self.place = Stream(device, PLACE, size)
        self.deposit = Stream(device, DEPOSIT, size)
        self._device = device
        self._landed: tuple[Stream, ...] = ()

    def landed(self) -> tuple[Stream, ...]:
        """Places and deposits of all bounces up to a look."""
        if not self._landed:
            size = (STREAM_WIDTH, self.rows * BOUNCES_A_LOOK)
            self._landed = Stream(self._device, PLACE, size), Stream(self._device, DEPOSIT, size)
        return self._landed

    def pairs(self) -> tuple[PingPong, PingPong, PingPong]:
        """What a bounce renews."""
        return self.origin, self.direction, self.flux

    def fronts(self) -> dict[str, Stream]:
        """What the next bounce reads."""
        return {
            "origin": self.origin.front,
            "direction": self.direction.front,
            "flux": self.flux.front,
        }

    def swap(self) -> None:
        """End a bounce."""
        for pair in self.pairs():
            pair.swap()

    def take_on_host(self, others: _Paths) -> None:
        """Fill the fronts with the photons that are alive in the others' fronts, in order."""
        alive = np.flatnonzero(others.direction.front.download().reshape(-1, 4)[:, :3].any(axis=1))
        for mine, theirs in zip(self.pairs(), others.pairs(), strict=True):
            texels = np.zeros((self.rows * STREAM_WIDTH, 4), np.float32)
            texels[: len(alive)] = theirs.front.download().reshape(-1, 4)[alive]
            mine.front.upload(texels.reshape(self.rows, STREAM_WIDTH, 4))

    def take_on_device(self, others: _Paths, compaction: Compaction) -> None:
        """As take_on_host."""
        elements = others.rows * STREAM_WIDTH
        textures = {name: stream.texture for name, stream in others.fronts().items()}
        compaction.count(elements, {"direction": textures["direction"]})
        targets = [pair.front for pair in self.pairs()]
        for target in targets:
            target.clear()
        compaction.move(elements, textures, [target.texture for target in targets])

    def release(self) -> None:
        for pair in self.pairs():
            pair.release()
        for stream in (self.hit, self.place, self.deposit, *self._landed):
            stream.release()


@dataclass
class _Flight:
    """A pass's photons under way."""

    index: int
    photons: int
    paths: _Paths
    alive: int  # or more than are
    bounce: int = 0  # the next one
    at_most: list[int] = field(default_factory=list)  # may be alive at each look
    reading: Reading | None = None  # how many are


def _and_some(number: int) -> int:
    """More than a number of photons that differs by chance."""
    return number + number // 8 + SPARE_PHOTONS


class PhotonMapper:
    """Traces a pass's photons and collects where they land on diffuse surfaces."""

    def __init__(
        self,
        device: Device,
        layer: Layer,
        tables: Tables,
        settings: Settings,
        needs: SceneNeeds,
        light_count: int,
    ) -> None:
        self._device, self._tables = device, tables
        self._settings, self._needs, self._light_count = settings, needs, light_count
        on_device = device.keeps_lists(layer)
        self._compaction = Compaction(device, "paths") if on_device else None
        self._bounces = Bounces(device, BOUNCES_A_LOOK) if on_device else None
        looks = needs.photon_bounces // BOUNCES_A_LOOK + 1
        self._tally = Tally(device, looks) if on_device else None
        # By the photons of a pass: how many landed, and how many were alive at each look, in
        # whichever pass most did.
        self._foreseen: dict[int, list[int]] = {}
        self._flight: _Flight | None = None
        self._dropped = 0  # deposits, before it
        self._paths: dict[int, _Paths] = {}  # by rows
        self.deposits: Deposits = DeviceDeposits(device) if on_device else HostDeposits(device)
        self.unfinished = 0  # photons that the bounce limit cut off, over all passes
        self._kernels = (
            Generator(device, layer),
            Tracer(device, layer),
            Projector(device, layer),
            Reflector(device, layer),
        )

    def trace(self, index: int, photons: int | None = None) -> Deposits:
        """Trace pass `index` (of `photons`, or as many as the settings say); the deposits are in
        order of bounce and photon."""
        self.start(index, photons)
        return self.finish()

    def start(self, index: int, photons: int | None = None) -> None:
        """Launch a pass as far as the passes before tell what it needs, and wait for nothing."""
        photons = self._settings.photons_a_pass if photons is None else photons
        self._dropped = self.deposits.dropped
        flight = self._flight = self._emit(index, photons)
        if not self._foreseen:
            self.deposits.make_room(GUESSED * photons)
            return
        assert self._tally
        # By rule of three from passes of other photons, such as the one that tells the radii.
        nearest = min(self._foreseen, key=lambda number: abs(number - photons))
        scale = photons / nearest
        landed, *alive = (_and_some(math.ceil(scale * n)) for n in self._foreseen[nearest])
        self.deposits.make_room(landed)
        for at_most in alive:
            self._fly(flight)
            flight.alive = min(flight.alive, at_most)
            flight.at_most.append(flight.alive)
            flight.paths = self._compacted(flight.paths, flight.alive)
        flight.reading = self._tally.ask()
        self.deposits.ask()

    def finish(self) -> Deposits:
        """The deposits of the pass that was started, once all its photons have ended."""
        flight = self._flight
        assert flight
        found = list(flight.reading.numbers()) if flight.reading else []
        too_many = (alive > most for alive, most in zip(found, flight.at_most, strict=True))
        if any(too_many):
            flight, found = self._again(flight), []
        elif found:
            flight.alive = found[-1]
        found += self._end(flight)
        if (landed := self.deposits.count) > self.deposits.room:
            flight = self._again(flight)
            self.deposits.make_room(landed)
            found = self._end(flight)
        if flight.bounce > self._needs.photon_bounces:
            self.unfinished += flight.alive
        if self._tally:
            before = self._foreseen.get(flight.photons, [])
            both = zip_longest(before, [self.deposits.count, *found], fillvalue=0)
            self._foreseen[flight.photons] = [max(pair) for pair in both]
        return self.deposits

    def launches(self) -> dict[str, int]:
        """How often each kernel has run."""
        launches = {kernel.stem: kernel.launches for kernel in self._kernels}
        return launches | ({Bounces.stem: self._bounces.launches} if self._bounces else {})

    def _emit(self, index: int, photons: int) -> _Flight:
        """Begin a pass."""
        generator, *_ = self._kernels
        rows = -(-photons // STREAM_WIDTH)
        if rows not in self._paths:
            self._release_paths()  # of passes of another size
        paths = self._paths_of(rows)
        generator.run(
            paths.fronts(),
            self._tables.of(generator),
            self._draw(index) | {"photons": photons, "light_count": self._light_count},
        )
        self.deposits.clear()
        if self._tally:
            self._tally.clear()
        return _Flight(index, photons, paths, photons)

    def _again(self, flight: _Flight) -> _Flight:
        """Begin a pass that more photons took than was foreseen once more."""
        self.deposits.dropped = self._dropped
        return self._emit(flight.index, flight.photons)

    def _end(self, flight: _Flight) -> list[int]:
        """Trace a pass's photons until they have ended; how many were alive at each look."""
        found = []
        while flight.alive and flight.bounce <= self._needs.photon_bounces:
            self._fly(flight)
            flight.alive = self._count(flight)
            found.append(flight.alive)
            if flight.alive:
                flight.paths = self._compacted(flight.paths, flight.alive)
        return found

    def _count(self, flight: _Flight) -> int:
        """How many photons are alive (waits for the device)."""
        return self._tally.ask().numbers()[-1] if self._tally else flight.alive

    def _fly(self, flight: _Flight) -> None:
        """Trace up to the next look; on the host, count who is alive."""
        if self._bounces and flight.photons <= PHOTONS_AT_ONCE:
            self._fly_at_once(flight)
            return
        _, tracer, projector, reflector = self._kernels
        every = BOUNCES_A_LOOK if self._compaction else 1
        paths, is_look = flight.paths, False
        while not is_look:
            bounce, direction = flight.bounce, paths.direction.front
            is_look = bounce == self._needs.photon_bounces or bounce % every == every - 1
            tracer.run(
                {"origin": paths.origin.front, "direction": direction, "hit": paths.hit},
                self._tables.of(tracer),
            )
            incoming = {"direction": direction, "hit": paths.hit, "flux": paths.flux.front}
            if bounce >= self._first_to_deposit:
                projector.run(
                    incoming | {"place": paths.place, "deposit": paths.deposit},
                    self._tables.of(projector),
                )
                self.deposits.append(paths.place, paths.deposit)
            counted = reflector.run(
                incoming
                | {
                    "next_origin": paths.origin.back,
                    "next_direction": paths.direction.back,
                    "next_flux": paths.flux.back,
                },
                self._tables.of(reflector),
                self._draw(flight.index) | {"bounce": bounce},
                count=is_look and not self._tally,
                tally=self._tally if is_look else None,
            )
            paths.swap()
            flight.bounce += 1
        if not self._tally:
            flight.alive = counted

    def _fly_at_once(self, flight: _Flight) -> None:
        """The same in one launch."""
        assert self._bounces and self._tally
        paths, first = flight.paths, flight.bounce
        bounces = min(BOUNCES_A_LOOK, self._needs.photon_bounces + 1 - first)
        self._bounces.run(
            paths.fronts(),
            [*(pair.back for pair in paths.pairs()), *paths.landed()],
            self._tables.of(self._bounces),
            self._tally.buffer,
            self._draw(flight.index)
            | {"alive_slot": self._tally.next_slot(), "first_bounce": first, "bounces": bounces}
            | {"first_to_deposit": self._first_to_deposit},
        )
        self.deposits.append(*paths.landed())
        paths.swap()
        flight.bounce += bounces

    @property
    def _first_to_deposit(self) -> int:
        """The bounce from which on photons are deposited: first hits are direct light."""
        return 0 if self._settings.direct_by_photons else 1

    def _draw(self, index: int) -> dict[str, int]:
        """What random numbers of a pass depend on."""
        return {"seed": self._settings.seed, "pass_index": index}

    def _compacted(self, paths: _Paths, alive: int) -> _Paths:
        """The photons in streams of half the size or less, if they fit and that is worth it.

        On software OpenGL a dead photon costs as much as its SIMD neighbours' longest path:
        without this, the photons of a pass took 1.4 times as long (cornell_classic, cornell_box).
        """
        rows = paths.rows
        while rows > 1 and alive <= STREAM_WIDTH * (rows // 2):
            rows //= 2
        if paths.rows - rows < (ROWS_WORTH_A_MOVE if self._compaction else 1):
            return paths
        smaller = self._paths_of(rows)
        if self._compaction:
            smaller.take_on_device(paths, self._compaction)
        else:
            smaller.take_on_host(paths)
        return smaller

    def _paths_of(self, rows: int) -> _Paths:
        if rows not in self._paths:
            self._paths[rows] = _Paths(self._device, rows)
        return self._paths[rows]

    def _release_paths(self) -> None:
        for paths in self._paths.values():
            paths.release()
        self._paths.clear()

    def release(self) -> None:
        """Free streams and kernels."""
        self._release_paths()
        for kernel in self._kernels:
            kernel.release()
        for item in (self._compaction, self._tally):
            if item:
                item.release()
        self.deposits.release()
