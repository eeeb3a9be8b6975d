# SPDX-License-Identifier: GPL-3.0-or-later
"""The photon pass: Generator -> (Tracer -> Shade -> Projector -> Reflector)* -> deposits."""

from __future__ import annotations

from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from ...streams import ByDefines, Defines, Device, Kernel, PingPong, Stream
from ...streams.device import Layer
from ..kernels.launch import launch, launch_and_count
from ..kernels.projector import Projector
from ..kernels.records import FLUX, HIT, RAY_DIRECTION, RAY_ORIGIN
from ..kernels.reflector import Reflector
from ..kernels.shade import Shade
from ..settings import Settings
from ..stage.needs import SceneNeeds
from ..stage.tables import Tables
from .deposits import HostDeposits
from .emission import Emission, rays_of
from .mapper import PhotonBatch, draw_of

STREAM_WIDTH = 1024  # photons a row


class Paths:
    """The streams of photons under way, which a bounce renews."""

    def __init__(self, device: Device, rows: int) -> None:
        self.rows, self.size = rows, (STREAM_WIDTH, rows)
        self.origin = PingPong(device, RAY_ORIGIN, self.size)
        self.direction = PingPong(device, RAY_DIRECTION, self.size)
        self.flux = PingPong(device, FLUX, self.size)

    def pairs(self) -> tuple[PingPong, PingPong, PingPong]:
        """All of them."""
        return self.origin, self.direction, self.flux

    def fronts(self) -> dict[str, Stream]:
        """What the next bounce reads."""
        return {
            "origin": self.origin.front,
            "direction": self.direction.front,
            "flux": self.flux.front,
        }

    def backs(self) -> dict[str, Stream]:
        """What it writes."""
        return {
            "origin": self.origin.back,
            "direction": self.direction.back,
            "flux": self.flux.back,
        }

    def swap(self) -> None:
        """End a bounce."""
        for pair in self.pairs():
            pair.swap()

    def release(self) -> None:
        """Put them back."""
        for pair in self.pairs():
            pair.release()


class _PathsAndEnds(Paths):
    """With those of a bounce's hits, places and deposits."""

    def __init__(self, device: Device, rows: int) -> None:
        super().__init__(device, rows)
        self.hit = Stream(device, HIT, self.size)
        self._points: dict[str, Stream] = {}

    def points(self, shade: Shade, projector: Projector) -> dict[str, Stream]:
        """What these write."""
        records: dict[str, Any] = {**shade.outputs, **projector.outputs}
        for name, record in records.items():
            if name not in self._points:
                self._points[name] = Stream(self.origin.back.device, record, self.size)
        return self._points

    def release(self) -> None:
        super().release()
        for stream in (self.hit, *self._points.values()):
            stream.release()


AnyPaths = TypeVar("AnyPaths", bound=Paths)


class PathsBySize(Generic[AnyPaths]):
    """The streams of a pass's photons, and smaller ones for those that are left of them."""

    def __init__(self, device: Device, kind: type[AnyPaths]) -> None:
        self._device, self._kind = device, kind
        self._paths: dict[int, AnyPaths] = {}  # by rows

    def of(self, photons: int) -> AnyPaths:
        """Those of a pass to begin."""
        rows = -(-photons // STREAM_WIDTH)
        if rows not in self._paths:
            self.release()  # of passes of another size
        return self._of_rows(rows)

    def halved(self, paths: AnyPaths, alive: int) -> AnyPaths:
        """Half the size or less, if as many photons fit there."""
        rows = paths.rows
        while rows > 1 and alive <= STREAM_WIDTH * (rows // 2):
            rows //= 2
        return self._of_rows(rows)

    def _of_rows(self, rows: int) -> AnyPaths:
        if rows not in self._paths:
            self._paths[rows] = self._kind(self._device, rows)
        return self._paths[rows]

    def release(self) -> None:
        """Put them back."""
        for paths in self._paths.values():
            paths.release()
        self._paths.clear()


class PhotonMapper:
    """Traces a pass's photons and collects where they land on diffuse surfaces: a bounce after the
    other, each kernel by itself, lists on the host."""

    def __init__(
        self,
        device: Device,
        layer: Layer,
        tables: Tables,
        settings: Settings,
        needs: SceneNeeds,
        tracer: Kernel,
    ) -> None:
        """`tracer`: what finds where photons go."""
        self._tables = tables
        self._settings, self._needs = settings, needs
        self._paths = PathsBySize(device, _PathsAndEnds)
        self.deposits = HostDeposits(device, needs.caustics)
        self.unfinished = 0  # photons that the bounce limit cut off, over all passes
        defines, made = needs.photon_defines, needs.made
        self._emission = Emission(device, layer, tables, needs)
        self._kernels = (tracer, Projector(device, layer, defines, made=needs.made))

        def shade(more: Defines) -> Shade:
            return Shade(device, layer, {**defines, **more}, made=made)

        def reflector(more: Defines) -> Reflector:
            return Reflector(device, layer, {**defines, **more}, made=made)

        self._shades, self._reflectors = ByDefines(shade), ByDefines(reflector)
        self._shades.of({})
        self._reflectors.of({})

    def start(self, batch: PhotonBatch) -> None:
        """Trace a batch until all its photons have ended."""
        settings, photons = self._settings, batch.photons
        tracer, projector = self._kernels
        portals = self._tables.portal_defines(self._needs.covers)
        shade = self._shades.of(self._needs.shade_defines(portals))
        reflector = self._reflectors.of(portals)
        paths = self._paths.of(photons)
        self._emission.run(paths.fronts(), draw_of(settings, batch.index), photons)
        self.deposits.clear()
        alive = photons
        for bounce in range(self._needs.photon_bounces + 1):
            draw = {**draw_of(settings, batch.index), "bounce": bounce, **self._tables.footprint}
            streams = {**paths.fronts(), "hit": paths.hit, **paths.points(shade, projector)}
            streams |= {f"next_{name}": stream for name, stream in paths.backs().items()}
            launch(tracer, streams, self._tables)
            launch(shade, streams, self._tables, draw)
            if bounce >= batch.first_to_deposit(settings):
                launch(projector, streams, self._tables, {"numbered": batch.numbered})
                caustic = {name: streams[name] for name in ("caustic",) if name in streams}
                self.deposits.append(streams["landed"], streams["deposit"], **caustic)
            alive = launch_and_count(reflector, streams, self._tables, draw).wait()
            paths.swap()
            if not alive:
                return
            paths = self._compacted(paths, alive)
        self.unfinished += alive

    def finish(self) -> HostDeposits:
        """The deposits of the batch that was started."""
        return self.deposits

    def rays(self, index: int, photons: int) -> NDArray[np.float64]:
        """Where a pass's photons start, and where they go, (photons or more, 6)."""
        paths = self._paths.of(photons)
        self._emission.run(paths.fronts(), draw_of(self._settings, index), photons)
        return rays_of(paths.fronts())

    def launches(self) -> dict[str, int]:
        """How often each kernel has run."""
        own = {kernel.stem: kernel.launches for kernel in self._kernels}
        own |= {Shade.stem: self._shades.launches, Reflector.stem: self._reflectors.launches}
        return self._emission.launches() | own

    def _compacted(self, paths: _PathsAndEnds, alive: int) -> _PathsAndEnds:
        """The photons that are alive, in order, in streams of half the size or less if they fit.

        On software OpenGL a dead photon costs as much as its SIMD neighbours' longest path:
        in full streams those that live would take longer.
        """
        smaller = self._paths.halved(paths, alive)
        if smaller is paths:
            return paths
        there = np.flatnonzero(paths.direction.front.download().reshape(-1, 4)[:, :3].any(axis=1))
        for old, new in zip(paths.pairs(), smaller.pairs(), strict=True):
            texels = np.zeros((smaller.rows * STREAM_WIDTH, 4), np.float32)
            texels[: len(there)] = old.front.download().reshape(-1, 4)[there]
            new.front.upload(texels.reshape(smaller.rows, STREAM_WIDTH, 4))
        return smaller

    def release(self) -> None:
        """Free streams and kernels."""
        self._paths.release()
        self._emission.release()
        for kernel in (*self._kernels, *self._shades.made(), *self._reflectors.made()):
            kernel.release()
        self.deposits.release()
