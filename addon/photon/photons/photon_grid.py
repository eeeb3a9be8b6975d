# SPDX-License-Identifier: GPL-3.0-or-later
"""The photon map as a grid: photons sorted by cell, ready for Gather."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import moderngl
import numpy as np
import photon_stream_native as native
from numpy.typing import NDArray

from ...streams import Device, PingPong, Program, Reading, Scan, Stream
from ...streams.compute import clear
from ...streams.device import Layer
from ..kernels.gather import Gather
from ..kernels.records import IRRADIANCE
from ..settings import Settings, filter_define
from ..stage.tables import upload_table
from ..ways.native_kernels import NativeGather
from .deposits import Deposits, HostDeposits
from .radius_field import Radii

MAX_CELLS = 1 << 22  # 16 MB of cell starts; a smaller radius then shares cells
# A cell is as wide as the typical radius, or narrower where it would hold more photons than this:
# looking into more cells then costs less than photons beyond the disc. A pass of the paper's
# heaviest cell on an H200: 27.3 ms with cells of a radius, 22.4 of 0.7 radii, 20.1 of 0.5, 18.7 of
# 0.35; with radii by density, 400 photons a disc at most, cells of 0.7 are as good as of 1.
PHOTONS_A_CELL, NARROWEST = 120.0, 0.35
# For the native core, in radii. On 2 cores it gathers cornell_classic, cornell_box and
# mirror_caustic a tenth slower with cells of 1, as fast with 0.5.
NATIVE_WIDTH = 0.7
MAX_RANKED = 8192  # photons in a cell that the device still ranks
MOST_UINT = (1 << 32) - 1
# Invocations of a GPU that share a visible point. Where neighbours see the same photons, one a
# point reads least, but fills an H200 only with a million of them; after a bounce off a glossy
# surface, few points are left, none beside its like. Gather on it with 1 / 8 / 32 lanes: 5.4 / 6.8
# / 11 ms at 1920x1080, 1.1 / 0.71 / 1.1 ms at 512x512 (cornell_classic); a glossy chain 1.5 / 0.78
# / 0.73 ms (cornell_box), of the paper's heaviest cell 28 / 13 / 8 and 12 / 2.6 / 1 ms a bounce.
LANES, LANES_OF_CHAINS = 8, 32
POINTS_THAT_FILL = 1 << 20
# Photons that a launch may add to a point where they crowd. Mesa's llvmpipe ends all loops of a
# program after 65535 steps in sum, without a word; SIMD neighbours' steps add up.
MAX_ADDED = 1 << 14


class _Sorted(NamedTuple):
    """Photons in order of their cells."""

    lists: dict[str, Any]  # the gather's
    photons: int
    launch: int  # photons that a launch may look at
    own: tuple[Any, ...] = ()  # of the lists, what ends with the pass


_NOTHING = _Sorted({}, 0, 0)


class PhotonGrid:
    """Sorts a pass's photons into cells and sums those around each visible point."""

    def __init__(
        self,
        device: Device,
        layer: Layer,
        settings: Settings,
        extent: Any,
        area: float,
        on_host: bool,
        in_chains: Iterable[bool] = (False,),
    ) -> None:
        """`extent` (3,): half the scene's size along each axis; `area`: of its surfaces [scene
        units]; `on_host`: the native core sorts and gathers; `in_chains`: whether for visible
        points of secondary rays, of eye rays, or both."""
        self._device, self._layer, self._defines = device, layer, filter_define(settings)
        # Of the frame, also where a region of it is rendered: sums are to have the same order.
        self._pixels = settings.width * settings.height
        self._lengths, self._area = [2 * float(x) for x in extent], area
        self._origin = tuple(float(-np.float32(x)) for x in extent)
        self._native = NativeGather(device, settings.filter) if on_host else None
        self._kernels: dict[int, Gather] = {}  # by their lanes
        for in_chain in () if on_host else in_chains:
            self._kernel(self._lanes(in_chain))  # for the first pass to find it
        self._device_sort = _DeviceSort(device) if device.keeps_lists(layer) else None
        self._sorted = _NOTHING
        self._uniforms: dict[str, Any] = {}
        self._radii: Radii | None = None
        self._sums: dict[tuple[int, int], PingPong] = {}  # by size; where one launch is too long

    def prepare(self, deposits: Deposits, radii: Radii) -> None:
        """Build the grid for a pass's deposits and radii."""
        self._forget()
        self._radii = radii
        width = radii.typical
        if self._native:
            width *= NATIVE_WIDTH
        else:
            crowd = deposits.count * width**2 / self._area if self._area else 0.0
            width *= min(1.0, max(NARROWEST, (PHOTONS_A_CELL / max(crowd, 1.0)) ** 0.5))
        cell = float(np.float32(_cell_size(self._lengths, width)))
        cells = tuple(int(length / cell) + 1 for length in self._lengths)
        grid = {
            "grid_origin": self._origin,
            "cell_size": cell,
            "grid_cells": cells,
        }
        if self._native:
            self._uniforms = radii.uniforms
            self._native.sort(deposits, grid)
            return
        self._uniforms = radii.uniforms | grid
        span = math.ceil(2 * radii.largest / cell) + 2
        if isinstance(deposits, HostDeposits):
            self._sorted = _sort_on_host(self._device, self._layer, deposits, grid, span)
        else:
            assert self._device_sort
            self._sorted = self._device_sort.run(deposits, grid, span)

    def estimate(
        self,
        place: Stream,
        facing: Stream,
        cuts: Stream,
        irradiance: Stream,
        zeros: Stream,
        in_chain: bool = False,
    ) -> None:
        """Write the irradiance at each visible point; sums begin with `zeros`; `in_chain`: of
        secondary rays."""
        ports = {"place": place, "facing": facing, "cuts": cuts}
        assert self._radii
        if self._native:
            ports |= {"irradiance": irradiance}
            self._native.run(ports, self._radii.tables(self._native), self._uniforms)
            return
        lists, count, launch, _ = self._sorted
        if count == 0:
            irradiance.clear()
            return
        kernel, so_far = self._kernel(self._lanes(in_chain)), zeros
        for first in range(0, count, launch):
            end = first + launch
            sums = None if end >= count else self._sums_of(irradiance.size)
            kernel.run(
                ports | {"sum": so_far, "irradiance": sums.back if sums else irradiance},
                lists | self._radii.tables(kernel),
                self._uniforms | {"photon_range": (first, end)},
            )
            if sums:
                sums.swap()
                so_far = sums.front

    @property
    def launches(self) -> int:
        """How often gathering has run."""
        kernels = [self._native] if self._native else self._kernels.values()
        return sum(kernel.launches for kernel in kernels)

    def _sums_of(self, size: tuple[int, int]) -> PingPong:
        if size not in self._sums:
            self._sums[size] = PingPong(self._device, IRRADIANCE, size)
        return self._sums[size]

    def _lanes(self, in_chain: bool) -> int:
        if not self._device.keeps_lists(self._layer):
            return 1  # software: a lane is no processor of its own
        if in_chain:
            return LANES_OF_CHAINS
        return 1 if self._pixels >= POINTS_THAT_FILL else LANES

    def _kernel(self, lanes: int) -> Gather:
        if lanes not in self._kernels:
            self._kernels[lanes] = Gather(self._device, self._layer, self._defines, lanes)
        return self._kernels[lanes]

    def _forget(self) -> None:
        for item in self._sorted.own:
            self._device.free(item)
        self._sorted = _NOTHING

    def release(self) -> None:
        """Put streams and lists back, free the kernels."""
        self._forget()
        for sums in self._sums.values():
            sums.release()
        for kernel in self._kernels.values():
            kernel.release()
        if self._device_sort:
            self._device_sort.release()


def _sort_on_host(
    device: Device, layer: Layer, deposits: Deposits, grid: Mapping[str, Any], span: int
) -> _Sorted:
    """Sort by the native core's stable counting sort; a disc spans `span` cells at most."""
    place, deposit = deposits.arrays()
    if len(place) == 0:
        return _NOTHING
    origin = np.array(grid["grid_origin"], np.float32)
    start, order = native.sort_photons(place, origin, grid["cell_size"], grid["grid_cells"])
    data = {"photon_place": place[order], "photon_deposit": deposit[order], "cell_start": start}
    lists = {
        name: device.ctx.buffer(values) if layer == "compute" else upload_table(device, values)
        for name, values in data.items()
    }
    return _Sorted(lists, len(place), _photons_a_launch(start, span), tuple(lists.values()))


def _photons_a_launch(start: NDArray[np.uint32], span: int) -> int:
    """All, unless a point might meet too many: in `span` by `span` rows of `span` cells at most."""
    count = int(start[-1])
    most = span**2 * int((start[span:] - start[:-span]).max()) if len(start) > span else count
    return MAX_ADDED if min(most, count) > 2 * MAX_ADDED else count


class _DeviceSort:
    """The gather's lists, by compute programs: the same order as the native core's."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self._count, self._scatter, self._rank = (
            Program(device, f"grid_{step}") for step in ("count", "scatter", "rank")
        )
        self._scan = Scan(device)
        self._fullest = device.buffer(4)
        self._reading: Reading | None = None  # of it, in the last pass
        self._buffers: dict[str, moderngl.Buffer] = {}

    def run(self, deposits: Deposits, grid: Mapping[str, Any], span: int) -> _Sorted:
        count, place, deposit = deposits.tables()
        if count == 0:
            return _NOTHING
        ctx, cells = self._device.ctx, math.prod(grid["grid_cells"])
        counts = self._buffer("counts", cells + 1)
        starts = self._buffer("starts", cells + 1)
        listed = self._buffer("listed", count)
        clear(self._device, counts, cells + 1)
        clear(self._device, self._fullest, 1)
        self._count.run(count, [counts, self._fullest], {"place": place}, uniforms=grid)
        # Ranking costs the square of a cell's photons: a crowded focus goes to the host. Whether
        # there is one the last pass tells, for which no host waits; the first waits for its own,
        # and ranks none until then.
        last, self._reading = self._reading, self._device.ask(self._fullest, 1)
        if last and _is_crowded(last):
            return _sort_on_host(self._device, "compute", deposits, grid, span)
        ctx.copy_buffer(starts, counts, 4 * (cells + 1))
        self._scan.run(starts, cells + 1)
        self._scatter.run(count, [counts, starts, listed], {"place": place}, uniforms=grid)
        places, fluxes = (self._buffer(name, 4 * count) for name in ("places", "deposits"))
        textures = {"place": place, "deposit": deposit}
        self._rank.run(
            count,
            [starts, listed, places, fluxes, self._fullest],
            textures,
            uniforms={**grid, "most_ranked": MOST_UINT if last else MAX_RANKED},
        )
        if not last and _is_crowded(self._reading):
            return _sort_on_host(self._device, "compute", deposits, grid, span)
        lists = {"photon_place": places, "photon_deposit": fluxes, "cell_start": starts}
        return _Sorted(lists, count, count)  # a GPU ends no loop early

    def _buffer(self, name: str, count: int) -> moderngl.Buffer:
        """A buffer of `count` numbers at least, kept from pass to pass."""
        if name not in self._buffers or self._buffers[name].size < 4 * count:
            if name in self._buffers:
                self._device.put_back(self._buffers[name])
            self._buffers[name] = self._device.buffer(4 * count)
        return self._buffers[name]

    def release(self) -> None:
        self._scan.release()
        for buffer in (self._fullest, *self._buffers.values()):
            self._device.put_back(buffer)


def _is_crowded(fullest: Reading) -> bool:
    (photons,) = fullest.numbers()
    return photons > MAX_RANKED


def _cell_size(lengths: Sequence[float], width: float) -> float:
    """A cell's edge: the width, or more where that makes too many."""
    cell = max(width, max(lengths) * 1e-6, 1e-30)
    while math.prod(int(length / cell) + 1 for length in lengths) > MAX_CELLS:
        cell *= 1.26  # two in volume for three steps
    return cell
