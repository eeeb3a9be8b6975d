# SPDX-License-Identifier: GPL-3.0-or-later
"""Which device does what: the only place that asks.

Whoever traces, sorts and sums gives the same picture: a way is a choice of who does it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import photon_stream_native as native

from ...streams import Device, Kernel, Stream, StreamError
from ...streams.device import Layer
from ..errors import DeviceError
from ..film.film import Film, HostFilm
from ..kernels.coverage import Coverage
from ..kernels.cuts import Cuts
from ..kernels.tracer import Tracer
from ..photons.device_photon_mapper import DevicePhotonMapper
from ..photons.native_photon_mapper import NativePhotonMapper, knows
from ..photons.photon_grid import PhotonGrid
from ..photons.photon_mapper import PhotonMapper
from ..scene import Scene
from ..settings import Settings, filter_define
from ..stage.geometry import Mesh
from ..stage.needs import SceneNeeds
from ..stage.tables import Tables
from .direct_light import DirectLight, TracedDirectLight
from .native_kernels import NativeCoverage, NativeCuts, NativeTracer, triangles_of


class PhotonSource(Protocol):
    """What a mapper needs to know of the scene."""

    @property
    def scene(self) -> Scene: ...
    @property
    def mesh(self) -> Mesh: ...
    @property
    def tables(self) -> Tables: ...


class Way:
    """GLSL by fragment or compute programs; lists on the host, or where the device keeps them."""

    def __init__(self, device: Device, layer: Layer) -> None:
        self.device, self.layer, self.name = device, layer, str(layer)
        self.keeps_lists = device.keeps_lists(layer)  # and computes while the host does other work

    def prepare_mesh(self, mesh: Mesh) -> None:
        """Take the triangles of a scene, before anything else is asked for."""

    def share(self, other: Way) -> None:
        """Take what another one of this kind made of the same triangles."""

    @property
    def reads_tree(self) -> bool:
        """Whether kernels read the tree's table."""
        return True

    def tracer(self, any_hit: bool = False) -> Kernel:
        """What finds where rays end."""
        return Tracer(self.device, self.layer, {"ANY_HIT": 1} if any_hit else None)

    def cuts(self) -> Kernel:
        """What cuts discs off."""
        return Cuts(self.device, self.layer)

    def coverage(self, settings: Settings) -> Kernel:
        """What probes surfaces."""
        return Coverage(self.device, self.layer, filter_define(settings))

    def direct_light(
        self, needs: SceneNeeds, size: tuple[int, int]
    ) -> DirectLight | TracedDirectLight:
        """What sends shadow rays from points of streams of a size."""
        return DirectLight(self.device, self.layer, needs)

    def photon_mapper(
        self, stage: PhotonSource, settings: Settings, needs: SceneNeeds
    ) -> PhotonMapper | NativePhotonMapper | DevicePhotonMapper:
        """What traces photons."""
        if self.keeps_lists:
            return DevicePhotonMapper(self.device, stage.tables, settings, needs)
        tracer = self.tracer()
        return PhotonMapper(self.device, self.layer, stage.tables, settings, needs, tracer)

    def photon_grid(self, mesh: Mesh, settings: Settings, in_chains: Sequence[bool]) -> PhotonGrid:
        """What sorts photons and gathers them: for visible points of eye rays, of chains."""
        extent, area = mesh.extent, mesh.area
        return PhotonGrid(self.device, self.layer, settings, extent, area, False, in_chains)

    def film(
        self, size: tuple[int, int], names: Sequence[str], spare: list[Stream]
    ) -> Film | HostFilm:
        """What averages passes; `spare` are streams that all films of a size may write to."""
        return Film(self.device, self.layer, size, names, spare)

    @property
    def film_streams(self) -> bool:
        """Whether films are streams, and write to spare ones."""
        return True


class NativeWay(Way):
    """The native core traces, cuts, probes, sorts, gathers and sums; the rest is fragment programs.

    Measured: on software OpenGL that takes a fifth of the time of fragment programs alone
    (cornell_box, 512x512, 262144 photons).
    """

    def __init__(self, device: Device) -> None:
        super().__init__(device, "fragment")
        self.name = "native"
        self._triangles: native.Tracer | None = None

    def prepare_mesh(self, mesh: Mesh) -> None:
        self._triangles = triangles_of(mesh)

    def share(self, other: Way) -> None:
        assert isinstance(other, NativeWay)
        self._triangles = other.triangles

    @property
    def triangles(self) -> native.Tracer:
        """Those of the scene."""
        assert self._triangles
        return self._triangles

    @property
    def reads_tree(self) -> bool:
        return False

    def tracer(self, any_hit: bool = False) -> Kernel:
        return NativeTracer(self.device, self.triangles, any_hit)

    def cuts(self) -> Kernel:
        return NativeCuts(self.device, self.triangles)

    def coverage(self, settings: Settings) -> Kernel:
        return NativeCoverage(self.device, self.triangles, settings.filter)

    def direct_light(
        self, needs: SceneNeeds, size: tuple[int, int]
    ) -> DirectLight | TracedDirectLight:
        return TracedDirectLight(self.device, self.layer, needs, self.tracer(any_hit=True), size)

    def photon_mapper(
        self, stage: PhotonSource, settings: Settings, needs: SceneNeeds
    ) -> PhotonMapper | NativePhotonMapper | DevicePhotonMapper:
        if not knows(stage.scene, needs):
            return super().photon_mapper(stage, settings, needs)
        scene, mesh = stage.scene, stage.mesh
        return NativePhotonMapper(
            self.device, scene, stage.tables, mesh, settings, needs, self.triangles
        )

    def photon_grid(self, mesh: Mesh, settings: Settings, in_chains: Sequence[bool]) -> PhotonGrid:
        extent, area = mesh.extent, mesh.area
        return PhotonGrid(self.device, self.layer, settings, extent, area, True, in_chains)

    def film(
        self, size: tuple[int, int], names: Sequence[str], spare: list[Stream]
    ) -> Film | HostFilm:
        return HostFilm(size, names)

    @property
    def film_streams(self) -> bool:
        return False


def way_of(settings: Settings, device: Device) -> Way:
    """The way that the settings ask for, or the one that is fastest on a device; DeviceError if the
    device does not have it."""
    if settings.layer == "native" or (settings.layer == "auto" and device.is_software):
        return NativeWay(device)
    try:
        return Way(device, device.choose_layer(settings.layer))
    except StreamError as error:
        raise DeviceError(str(error)) from error


def open_device(settings: Settings) -> Device:
    """The OpenGL device that the settings ask for; DeviceError says what is missing."""
    try:
        device = Device(settings.device_index)
    except StreamError as error:
        raise DeviceError(str(error)) from error
    way_of(settings, device)
    return device
