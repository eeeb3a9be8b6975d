# SPDX-License-Identifier: GPL-3.0-or-later
"""Which device does what: the only place that asks.

Whoever traces, sorts and sums gives the same picture: a backend is a choice of who does it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ...streams import Defines, Device, Kernel, Stream, StreamError
from ...streams.device import Layer
from ..errors import DeviceError
from ..film.denoise import Opened
from ..film.device_denoising import DeviceDenoisingResolver
from ..film.device_resolver import DeviceResolver
from ..film.film import Film, HostFilm
from ..film.resolver import DenoisingResolver, HostResolver, Resolver
from ..film.strips import StripFilm
from ..kernels.coverage import Coverage
from ..kernels.cuts import Cuts
from ..kernels.tracer import Tracer
from ..kernels.walk import Walk
from ..photons.bounces import SeveralBounces
from ..photons.deposits import Deposits
from ..photons.device_photon_mapper import DevicePhotonMapper
from ..photons.device_radii import Box, Grids, Limits, grids_on_device, radii_on_device
from ..photons.grid_sort import DeviceSort, HostSort, Sort
from ..photons.native_photon_mapper import NativePhotonMapper, knows, knows_lobes, leaves_lobes
from ..photons.one_bounce import OneBounce
from ..photons.photon_grid import (
    LANES,
    POINTS_THAT_FILL,
    Cells,
    Gathering,
    Lanes,
    PhotonGrid,
    lanes_of_gpu,
)
from ..photons.photon_mapper import PhotonMapper
from ..photons.radius_field import SAMPLE, Found, grids_on_host, radii_on_host
from ..scene import RAYS, Scene
from ..settings import Settings, filter_define
from ..stage.geometry import Mesh
from ..stage.needs import SceneNeeds
from ..stage.tables import Tables
from ..stage.upload import upload_table
from .direct_light import DirectLight, TracedDirectLight
from .native_kernels import (
    EVERY_RAY,
    NativeCoverage,
    NativeCuts,
    NativeGather,
    NativeMicrofacetGather,
    NativePhongGather,
    NativeTracer,
    NativeTriangles,
    NativeWalk,
)
from .native_photon_grid import MixedPhotonGrid, NativePhotonGrid
from .sizes import NativeSizes, ResidentSizes, Sizes

# Pixels of a strip. Shorter strips take longer a pass; a GPU wants more at a time, and has what a
# frame of 1920x1080 takes.
STRIP_PIXELS = 1 << 19
GPU_STRIP_PIXELS = 1 << 21
# From so many on a few of a GPU's lanes share a point's coverage probes, and from so many on more
# do, if the frame's points don't fill it: those of few triangles end at once, and what lanes do
# over again costs more.
TRIANGLES_FOR_LANES, TRIANGLES_FOR_MORE, FEW_LANES = 1 << 12, 1 << 16, 4


def lanes_of_probes(triangles: int, pixels: int) -> int:
    """Invocations of a GPU that share a visible point's coverage probes; `pixels` of the frame."""
    if triangles < TRIANGLES_FOR_LANES:
        return 1
    is_filled = pixels >= POINTS_THAT_FILL
    return FEW_LANES if is_filled or triangles < TRIANGLES_FOR_MORE else LANES


class PhotonSource(Protocol):
    """What a mapper needs to know of the scene."""

    @property
    def scene(self) -> Scene: ...
    @property
    def mesh(self) -> Mesh: ...
    @property
    def tables(self) -> Tables: ...


class Backend:
    """GLSL by fragment or compute programs, with lists on the host."""

    works_alone = False  # while the host does other work

    def __init__(self, device: Device, layer: Layer) -> None:
        self.device, self.layer, self.name = device, layer, str(layer)
        self.sizes = Sizes(device, layer)

    @property
    def strip_pixels(self) -> int:
        """That are rendered together at most, but for a row of more."""
        return STRIP_PIXELS if self.device.is_software else GPU_STRIP_PIXELS

    def prepare_mesh(self, mesh: Mesh) -> None:
        """Take the triangles of a scene, before anything else is asked for, and whenever they have
        moved."""

    def share(self, other: Backend) -> None:
        """Take what another one of this kind made of the same triangles."""

    @property
    def shares_memory(self) -> bool:
        """Whether streams are in the host's memory, which moves elements as well as the device."""
        return self.device.is_software

    @property
    def kind_defines(self) -> Defines:
        """What a kernel is compiled with that loops over lights: software OpenGL runs through all
        kinds where one loop has them, and GPUs take longer to compile a loop for each."""
        return {"BY_KIND": 1} if self.device.is_software else {}

    @property
    def reads_tree(self) -> bool:
        """Whether kernels read the tree's table."""
        return True

    def tracer(self, any_hit: bool = False, rays: Defines | None = None) -> Kernel:
        """What finds where rays end; `rays`: of which kinds they are (SceneNeeds.rays)."""
        defines = {**(rays or {}), **({"ANY_HIT": 1} if any_hit else {})}
        return Tracer(self.device, self.layer, defines)

    def walk(self) -> Kernel:
        """What follows light below surfaces."""
        return Walk(self.device, self.layer)

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
        self, source: PhotonSource, settings: Settings, needs: SceneNeeds
    ) -> PhotonMapper | NativePhotonMapper | DevicePhotonMapper:
        """What traces photons."""
        bounce = self._one_bounce(source, settings, needs)
        return PhotonMapper(self.device, self.layer, source.tables, settings, needs, bounce)

    def _one_bounce(self, source: PhotonSource, settings: Settings, needs: SceneNeeds) -> OneBounce:
        tracer = self.tracer(rays=needs.rays(*RAYS))
        return OneBounce(self.device, self.layer, source.tables, settings, needs, tracer)

    def radius_grids(self, deposits: Deposits, focus: Box | None = None) -> Grids:
        """Where most of the deposits are, of those in a box if there is one; called when it must
        be known."""
        return grids_on_host(*deposits.arrays(), focus)

    def radii(self, deposits: Deposits, grids: NDArray[np.float32], limits: Limits) -> Found:
        """The radii by deposits, and by the grids over them."""
        return radii_on_host(self.device, deposits.arrays(), grids, limits)

    def photon_grid(
        self, mesh: Mesh, settings: Settings, needs: SceneNeeds, in_chains: Sequence[bool]
    ) -> Gathering:
        """What sorts photons and gathers them. `in_chains`: for which points kernels are made,
        False: those of eye rays, True: of chains."""
        return self._gathering(mesh, settings, needs, in_chains, HostSort(self._list), Lanes())

    def _list(self, values: NDArray[Any]) -> Any:
        """One that kernels read."""
        if self.layer == "compute":
            return self.device.ctx.buffer(values)
        return upload_table(self.device, values)

    def _gathering(
        self,
        mesh: Mesh,
        settings: Settings,
        needs: SceneNeeds,
        in_chains: Sequence[bool],
        sort: Sort,
        lanes: Lanes,
        more: Defines | None = None,
    ) -> PhotonGrid:
        defines = {**filter_define(settings), **needs.gather_defines, **(more or {})}
        cells = Cells(mesh.extent)
        device, layer, area = self.device, self.layer, mesh.area
        return PhotonGrid(device, layer, defines, cells, area, sort, lanes, in_chains, needs.made)

    def film(
        self,
        size: tuple[int, int],
        names: Sequence[str],
        spare: list[Stream],
        halved: Sequence[str],
    ) -> Film | HostFilm:
        """What averages passes; `spare` are streams that all films of a size may write to."""
        return Film(self.device, self.layer, size, names, spare, halved)

    def resolver(self, film: StripFilm, names: Sequence[str]) -> Resolver:
        """What makes pictures of a film of these images."""
        return HostResolver(film)

    def denoising_resolver(
        self, film: StripFilm, plain: Resolver, opened: Opened, noisy_features: bool
    ) -> DenoisingResolver:
        """What makes denoised pictures of a film that `plain` resolves."""
        return DenoisingResolver(film, plain, opened, noisy_features)

    @property
    def film_spares(self) -> int:
        """How many streams films of a size may write to."""
        return self.sizes.film_spares


class ResidentBackend(Backend):
    """GLSL by compute programs, with lists that never leave the device."""

    works_alone = True

    def __init__(self, device: Device) -> None:
        super().__init__(device, "compute")
        self.sizes = ResidentSizes(device, "compute")
        self._triangles = 0

    def prepare_mesh(self, mesh: Mesh) -> None:
        self._triangles = len(mesh.triangles)

    def share(self, other: Backend) -> None:
        assert isinstance(other, ResidentBackend)
        self._triangles = other._triangles

    @property
    def shares_memory(self) -> bool:
        """It does other work while the device counts what is alive."""
        return False

    def coverage(self, settings: Settings) -> Kernel:
        lanes = lanes_of_probes(self._triangles, settings.width * settings.height)
        return Coverage(self.device, self.layer, filter_define(settings), lanes)

    def photon_mapper(
        self, source: PhotonSource, settings: Settings, needs: SceneNeeds
    ) -> PhotonMapper | NativePhotonMapper | DevicePhotonMapper:
        bounces: OneBounce | SeveralBounces
        if needs.shades_long:
            bounces = self._one_bounce(source, settings, needs)
        else:
            bounces = SeveralBounces(self.device, source.tables, settings, needs)
        return DevicePhotonMapper(self.device, source.tables, settings, needs, bounces)

    def radius_grids(self, deposits: Deposits, focus: Box | None = None) -> Grids:
        """At once."""
        if not deposits.count:
            return super().radius_grids(deposits)
        return grids_on_device(self.device, deposits, SAMPLE, focus)

    def radii(self, deposits: Deposits, grids: NDArray[np.float32], limits: Limits) -> Found:
        # Software OpenGL takes long for threads that wait for each other.
        shares_lines = not self.device.is_software
        return radii_on_device(self.device, deposits, grids, limits, shares_lines)

    def photon_grid(
        self, mesh: Mesh, settings: Settings, needs: SceneNeeds, in_chains: Sequence[bool]
    ) -> Gathering:
        lanes = lanes_of_gpu(settings.width * settings.height)
        sort = DeviceSort(self.device)
        return self._gathering(mesh, settings, needs, in_chains, sort, lanes)

    def resolver(self, film: StripFilm, names: Sequence[str]) -> Resolver:
        return DeviceResolver(self.device, film, names)

    def denoising_resolver(
        self, film: StripFilm, plain: Resolver, opened: Opened, noisy_features: bool
    ) -> DenoisingResolver:
        assert isinstance(plain, DeviceResolver)
        return DeviceDenoisingResolver(self.device, film, plain, opened, noisy_features)


class NativeBackend(Backend):
    """The native core traces, cuts, probes, sorts, gathers and sums; the rest is fragment programs.
    On software OpenGL that takes a fraction of the time of fragment programs alone."""

    def __init__(self, device: Device) -> None:
        super().__init__(device, "fragment")
        self.name, self.sizes = "native", NativeSizes(device, "fragment")
        self.triangles = NativeTriangles()  # of the scene

    def prepare_mesh(self, mesh: Mesh) -> None:
        self.triangles.take(mesh)

    def share(self, other: Backend) -> None:
        assert isinstance(other, NativeBackend)
        self.triangles = other.triangles

    @property
    def reads_tree(self) -> bool:
        return False

    def tracer(self, any_hit: bool = False, rays: Defines | None = None) -> NativeTracer:
        bits = int((rays or {}).get("VISIBILITY", EVERY_RAY))
        by_reach = "BY_REACH" in (rays or {})
        return NativeTracer(self.device, self.triangles, any_hit, bits, by_reach)

    def walk(self) -> Kernel:
        return NativeWalk(self.device, self.triangles)

    def cuts(self) -> Kernel:
        return NativeCuts(self.device, self.triangles)

    def coverage(self, settings: Settings) -> Kernel:
        return NativeCoverage(self.device, self.triangles, settings.filter)

    def direct_light(
        self, needs: SceneNeeds, size: tuple[int, int]
    ) -> DirectLight | TracedDirectLight:
        tracer = self.tracer(any_hit=not needs.shadow_rays_go_on, rays=needs.rays("shadow"))
        return TracedDirectLight(self.device, self.layer, needs, tracer, size)

    def photon_mapper(
        self, source: PhotonSource, settings: Settings, needs: SceneNeeds
    ) -> PhotonMapper | NativePhotonMapper | DevicePhotonMapper:
        if not knows(source.scene, needs):
            return super().photon_mapper(source, settings, needs)
        return NativePhotonMapper(
            self.device, source.scene, source.tables, settings, needs, self.triangles
        )

    def photon_grid(
        self, mesh: Mesh, settings: Settings, needs: SceneNeeds, in_chains: Sequence[bool]
    ) -> Gathering:
        kind = NativeGather
        if needs.gathered_lobes:
            is_phong = knows_lobes(needs.lobes, needs.lobe_kinds)
            kind = NativePhongGather if is_phong else NativeMicrofacetGather
        kernel = kind(self.device, self.layer, settings.filter, needs)
        known = NativePhotonGrid(kernel, Cells(mesh.extent))
        kinds = needs.lobe_kinds, needs.gathering_kinds
        if not needs.gathered_lobes or not leaves_lobes(needs.lobes, *kinds):
            return known
        sort = HostSort(self._list)
        others = self._gathering(
            mesh, settings, needs, in_chains, sort, Lanes(), {"OTHER_LOBES": 1}
        )
        return MixedPhotonGrid(known, others)

    def film(
        self,
        size: tuple[int, int],
        names: Sequence[str],
        spare: list[Stream],
        halved: Sequence[str],
    ) -> Film | HostFilm:
        return HostFilm(size, names, halved)


def backend_of(settings: Settings, device: Device) -> Backend:
    """The backend that the settings ask for, or the one that is fastest on a device; DeviceError if
    the device does not have it."""
    if settings.backend == "native" or (settings.backend == "auto" and device.is_software):
        return NativeBackend(device)
    try:
        layer = device.choose_layer(settings.backend)
        return ResidentBackend(device) if device.keeps_lists(layer) else Backend(device, layer)
    except StreamError as error:
        raise DeviceError(str(error)) from error


def open_device(settings: Settings) -> Device:
    """The OpenGL device that the settings ask for; DeviceError says what is missing."""
    try:
        device = Device(settings.device_index)
    except StreamError as error:
        raise DeviceError(str(error)) from error
    backend_of(settings, device)
    return device
