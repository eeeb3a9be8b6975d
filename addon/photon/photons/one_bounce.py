# SPDX-License-Identifier: GPL-3.0-or-later
"""A bounce of photons, a kernel after the other: Tracer, Shade, Projector, Reflector."""

from __future__ import annotations

from typing import Any, ClassVar

from ...streams import ByDefines, Count, Defines, Device, Kernel, Stream, Tally
from ...streams.device import Layer
from ..kernels.free_flight import FreeFlight, media_values
from ..kernels.launch import launch, launch_and_count, launch_and_tally
from ..kernels.projector import Projector
from ..kernels.records import HIT
from ..kernels.reflector import Reflector
from ..kernels.shade import Shade
from ..settings import Settings
from ..stage.needs import SceneNeeds
from ..stage.tables import Tables
from .deposits import DeviceDeposits, HostDeposits
from .mapper import PhotonBatch, draw_of
from .paths import Paths


class PathsAndEnds(Paths):
    """With the streams of a bounce's hits, places and deposits."""

    def __init__(self, device: Device, size: tuple[int, int], media: bool) -> None:
        super().__init__(device, size, media)
        self.hit = Stream(device, HIT, self.size)
        self._points: dict[str, Stream] = {}

    def points(self, shade: Shade, projector: Projector) -> dict[str, Stream]:
        """What these write."""
        records: dict[str, Any] = {**shade.outputs, **projector.outputs}
        for name, record in records.items():
            if name not in self._points:
                self._points[name] = Stream(self.device, record, self.size)
        return self._points

    def flown(self, flight: FreeFlight) -> dict[str, Stream]:
        """What this writes."""
        for name, record in flight.outputs.items():
            if name not in self._points:
                self._points[name] = Stream(self.device, record, self.size)
        return {name: self._points[name] for name in flight.outputs}

    def release(self) -> None:
        super().release()
        for stream in (self.hit, *self._points.values()):
            stream.release()


class OneBounce:
    """The kernels of a bounce, and how often they ran."""

    paths: ClassVar = PathsAndEnds  # that it takes

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
        self._tables, self._settings, self._needs = tables, settings, needs
        defines, made = needs.photon_defines, needs.made
        self._tracer = tracer
        self._flight: FreeFlight | None = None
        if needs.scattering:
            self._flight = FreeFlight(device, layer, needs.flight_defines("PHOTONS"))
        self._projector = Projector(device, layer, defines, made=made)

        def shade(more: Defines) -> Shade:
            return Shade(device, layer, {**defines, **more}, made=made)

        def reflector(more: Defines) -> Reflector:
            return Reflector(device, layer, {**defines, **more}, made=made)

        self._shades, self._reflectors = ByDefines(shade), ByDefines(reflector)
        self._shades.of({})
        self._reflectors.of({})

    def count(
        self, batch: PhotonBatch, paths: PathsAndEnds, bounce: int, deposits: HostDeposits
    ) -> Count:
        """Append what lands, and go on to the next bounce; how many do."""
        streams, draw = self._land(batch, paths, bounce, deposits)
        count = launch_and_count(self._reflector, streams, self._tables, draw)
        paths.swap()
        return count

    def make_room(self, photons: int) -> None:
        """As SeveralBounces; paths have all that it takes."""

    def worth_compacting(self, paths: PathsAndEnds, first: int) -> bool:
        """As SeveralBounces: always, for what is dead costs every kernel."""
        return True

    def run(
        self,
        batch: PhotonBatch,
        paths: PathsAndEnds,
        first: int,
        deposits: DeviceDeposits,
        tally: Tally,
    ) -> int:
        """As SeveralBounces."""
        streams, draw = self._land(batch, paths, first, deposits)
        launch_and_tally(self._reflector, streams, self._tables, draw, into=tally)
        paths.swap()
        return 1

    def _land(
        self,
        batch: PhotonBatch,
        paths: PathsAndEnds,
        bounce: int,
        deposits: HostDeposits | DeviceDeposits,
    ) -> tuple[dict[str, Stream], dict[str, Any]]:
        """The bounce's streams, and what its random numbers depend on."""
        draw = {**draw_of(self._settings, batch.index), "bounce": bounce, **self._tables.footprint}
        shade = self._shades.of(self._needs.shade_defines(self._portals))
        streams = {**paths.fronts(), "hit": paths.hit, **paths.points(shade, self._projector)}
        streams |= {f"next_{name}": stream for name, stream in paths.backs().items()}
        launch(self._tracer, streams, self._tables)
        if self._flight:
            flown = paths.flown(self._flight)
            values = media_values(self._settings, self._tables)
            launch(self._flight, streams | flown, self._tables, draw | values)
            own = {"hit": "met", "medium": "along", "flux": "carried"}
            streams |= {name: flown[port] for name, port in own.items()}
        launch(shade, streams, self._tables, draw)
        if bounce >= batch.first_to_deposit(self._settings):
            launch(self._projector, streams, self._tables, draw | {"numbered": batch.numbered})
            deposits.append(streams["landed"], streams["deposit"], streams.get("caustic"))
        return streams, draw

    @property
    def _portals(self) -> Defines:
        return self._tables.portal_defines(self._needs.covers)

    @property
    def _reflector(self) -> Reflector:
        return self._reflectors.of(self._portals)

    def launches(self) -> dict[str, int]:
        """How often each kernel has run."""
        own = {kernel.stem: kernel.launches for kernel in self._always}
        return own | {Shade.stem: self._shades.launches, Reflector.stem: self._reflectors.launches}

    def release(self) -> None:
        """Free what kernels have of their own."""
        made = *self._shades.made(), *self._reflectors.made()
        for kernel in (*self._always, *made):
            kernel.release()

    @property
    def _always(self) -> list[Kernel]:
        """Kernels of all passes."""
        return [self._tracer, self._projector, *([self._flight] if self._flight else [])]
