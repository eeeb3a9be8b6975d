# SPDX-License-Identifier: GPL-3.0-or-later
"""The photon pass: Generator -> (Tracer -> Projector -> Reflector)* -> deposits.

`PhotonMapper` runs it kernel by kernel, `NativePhotonMapper` natively in one call.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import zip_longest

import numpy as np
import photon_stream_native as native

from ..streams import Compaction, Device, PingPong, Reading, Stream, Tally
from ..streams.device import Layer
from .deposits import Deposits, DeviceDeposits, HostDeposits
from .generator import Generator
from .geometry import Frame, Mesh, Tables, light_table, material_table
from .needs import SceneNeeds
from .projector import Projector
from .records import DEPOSIT, FLUX, HIT, PLACE, RAY_DIRECTION, RAY_ORIGIN
from .reflector import Reflector
from .scene import Scene
from .settings import Settings
from .tracer import Tracer

STREAM_WIDTH = 1024  # photons a row
# A launch costs a GPU more than dead photons do unless there are many, and it waits while the host
# asks how many are alive. A pass's photons on an H200, asked at each bounce and left in place ->
# so: 8.5 -> 5.5 ms (2 million of them, cornell_classic), 3.0 -> 2.5 ms (262144).
BOUNCES_A_LOOK = 4
ROWS_WORTH_A_MOVE = 256
# After the first pass the host does not ask, but goes by what the passes before found, an eighth
# more, and this: by chance they differ by the square root of their number.
SPARE_PHOTONS = 1024


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

    def pairs(self) -> tuple[PingPong, PingPong, PingPong]:
        """What a bounce renews."""
        return self.origin, self.direction, self.flux

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
        fronts = [pair.front.texture for pair in others.pairs()]
        textures = dict(zip(("origin", "direction", "flux"), fronts, strict=True))
        compaction.count(elements, {"direction": textures["direction"]})
        targets = [pair.front for pair in self.pairs()]
        for target in targets:
            target.clear()
        compaction.move(elements, textures, [target.texture for target in targets])

    def release(self) -> None:
        for item in (*self.pairs(), self.hit, self.place, self.deposit):
            item.release()


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
        looks = needs.photon_bounces // BOUNCES_A_LOOK + 1
        self._tally = Tally(device, looks) if on_device else None
        # By the photons of a pass: how many landed, and how many were alive at each look, in
        # whichever pass most did.
        self._foreseen: dict[int, list[int]] = {}
        self._flight: _Flight | None = None
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
        flight = self._flight = self._emit(index, photons)
        if not self._foreseen:
            self.deposits.make_room(photons)  # at a guess: growing takes longer
            return
        assert self._tally
        self._tally.clear()
        # By rule of three from passes of other photons, such as the one that tells the radii.
        nearest = min(self._foreseen, key=lambda number: abs(number - photons))
        scale = photons / nearest
        landed, *alive = (_and_some(math.ceil(scale * n)) for n in self._foreseen[nearest])
        self.deposits.make_room(landed)
        for at_most in alive:
            self._fly(flight, self._tally)
            flight.alive = min(flight.alive, at_most)
            flight.at_most.append(flight.alive)
            flight.paths = self._compacted(flight.paths, flight.alive)
        flight.reading = self._tally.ask()
        self.deposits.ask()

    def finish(self) -> Deposits:
        """The deposits of the pass that was started, once all its photons have ended."""
        flight, last = self._flight, self._needs.photon_bounces
        assert flight
        found = list(flight.reading.numbers()) if flight.reading else []
        too_many = (alive > most for alive, most in zip(found, flight.at_most, strict=True))
        if found and (any(too_many) or self.deposits.count > self.deposits.room):
            flight, found = self._emit(flight.index, flight.photons), []  # again, and look
        elif found:
            flight.alive = found[-1]
        while flight.alive and flight.bounce <= last:
            flight.alive = self._fly(flight)
            found.append(flight.alive)
            if flight.alive:
                flight.paths = self._compacted(flight.paths, flight.alive)
        if flight.bounce > last:
            self.unfinished += flight.alive
        if self._tally:
            before = self._foreseen.get(flight.photons, [])
            both = zip_longest(before, [self.deposits.count, *found], fillvalue=0)
            self._foreseen[flight.photons] = [max(pair) for pair in both]
        return self.deposits

    def launches(self) -> dict[str, int]:
        """How often each kernel has run."""
        return {kernel.stem: kernel.launches for kernel in self._kernels}

    def _emit(self, index: int, photons: int) -> _Flight:
        """Begin a pass."""
        generator, *_ = self._kernels
        paths = self._paths_of(-(-photons // STREAM_WIDTH))
        generator.run(
            {
                "origin": paths.origin.front,
                "direction": paths.direction.front,
                "flux": paths.flux.front,
            },
            self._tables.of(generator),
            self._draw(index) | {"photons": photons, "light_count": self._light_count},
        )
        self.deposits.clear()
        return _Flight(index, photons, paths, photons)

    def _fly(self, flight: _Flight, tally: Tally | None = None) -> int:
        """Trace up to the next look, and say how many are alive; or let a tally count them."""
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
            if bounce > 0 or self._settings.direct_by_photons:
                projector.run(
                    incoming | {"place": paths.place, "deposit": paths.deposit},
                    self._tables.of(projector),
                )
                at_most = None if tally else flight.alive
                self.deposits.append(paths.place, paths.deposit, at_most)
            alive = reflector.run(
                incoming
                | {
                    "next_origin": paths.origin.back,
                    "next_direction": paths.direction.back,
                    "next_flux": paths.flux.back,
                },
                self._tables.of(reflector),
                self._draw(flight.index) | {"bounce": bounce},
                count=is_look and not tally,
                tally=tally if is_look else None,
            )
            for pair in paths.pairs():
                pair.swap()
            flight.bounce += 1
        return alive

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

    def release(self) -> None:
        """Free streams and kernels."""
        for paths in self._paths.values():
            paths.release()
        for kernel in self._kernels:
            kernel.release()
        for item in (self._compaction, self._tally):
            if item:
                item.release()
        self.deposits.release()


class NativePhotonMapper:
    """What PhotonMapper does, by the native core: the same photons to rounding."""

    def __init__(
        self,
        device: Device,
        scene: Scene,
        frame: Frame,
        mesh: Mesh,
        settings: Settings,
        needs: SceneNeeds,
        triangles: native.Tracer,
    ) -> None:
        """`triangles`: those of `mesh`."""
        self._settings, self._needs, self._triangles = settings, needs, triangles
        self._tables = (
            mesh.normals,
            material_table(scene.materials),
            light_table(scene.lights, frame),
        )
        self._launches = 0
        self.deposits = HostDeposits(device)
        self.unfinished = 0  # photons that the bounce limit cut off, over all passes

    def trace(self, index: int, photons: int | None = None) -> Deposits:
        """As PhotonMapper.trace."""
        self.start(index, photons)
        return self.finish()

    def finish(self) -> Deposits:
        """As PhotonMapper.finish."""
        return self.deposits

    def start(self, index: int, photons: int | None = None) -> None:
        """Trace a pass."""
        self._launches += 1
        self.deposits.clear()
        place, deposit, unfinished = self._triangles.photons(
            *self._tables,
            seed=self._settings.seed,
            pass_index=index,
            photons=self._settings.photons_a_pass if photons is None else photons,
            bounces=self._needs.photon_bounces,
            first_hits=self._settings.direct_by_photons,
        )
        self.deposits.extend(place, deposit)
        self.unfinished += unfinished

    def launches(self) -> dict[str, int]:
        """How many passes were traced."""
        return {"photons": self._launches}

    def release(self) -> None:
        """Free what is on the device."""
        self.deposits.release()
