# SPDX-License-Identifier: GPL-3.0-or-later
"""The photon map as a grid: photons sorted by cell, ready for Gather."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import moderngl
import numpy as np
import photon_stream_native as native
from numpy.typing import NDArray

from ..streams import Device, Kernel, PingPong, Program, Scan, Stream
from ..streams.device import Layer
from .deposits import Deposits, HostDeposits
from .gather import Gather
from .geometry import TABLE_WIDTH, upload_table
from .native_kernels import NativeGather
from .radius_field import Radii
from .records import IRRADIANCE
from .settings import Settings, filter_define

MAX_CELLS = 1 << 22  # 16 MB of cell starts; a smaller radius then shares cells
MAX_RANKED = 8192  # photons in a cell that the device still ranks
# Photons that a launch may add to a point where they crowd. Mesa's llvmpipe ends all loops of a
# program after 65535 steps in sum, without a word; SIMD neighbours' steps add up.
MAX_ADDED = 1 << 14


class _Sorted(NamedTuple):
    """Photons in order of their cells."""

    tables: dict[str, moderngl.Texture]  # the gather's
    photons: int
    launch: int  # photons that a launch may look at


_NOTHING = _Sorted({}, 0, 0)


class PhotonGrid:
    """Sorts a pass's photons into cells and sums those around each visible point."""

    def __init__(
        self, device: Device, layer: Layer, settings: Settings, extent: Any, on_host: bool
    ) -> None:
        """`extent` (3,): half the scene's size along each axis [scene units]; `on_host`: the
        native core sorts and gathers."""
        self._device = device
        self._extent = np.asarray(extent, np.float64)
        self.kernel: Kernel = (
            NativeGather(device, settings.filter)
            if on_host
            else Gather(device, layer, filter_define(settings))
        )
        self._device_sort: _DeviceSort | None = None
        self._sorted = _NOTHING
        self._uniforms: dict[str, Any] = {}
        self._radii: dict[str, Any] = {}
        self._sums: dict[tuple[int, int], PingPong] = {}  # by size

    def prepare(self, deposits: Deposits, radii: Radii) -> None:
        """Build the grid for a pass's deposits and radii."""
        self._forget()
        self._radii = radii.tables(self.kernel)
        cell = float(np.float32(_cell_size(2 * self._extent, radii.typical)))
        cells = tuple(int(n) for n in np.floor(2 * self._extent / cell) + 1)
        grid = {
            "grid_origin": tuple(float(np.float32(-x)) for x in self._extent),
            "cell_size": cell,
            "grid_cells": cells,
        }
        if isinstance(self.kernel, NativeGather):
            self._uniforms = radii.uniforms
            self.kernel.sort(deposits, grid)
            return
        self._uniforms = radii.uniforms | grid
        span = math.ceil(2 * radii.largest / cell) + 2
        if isinstance(deposits, HostDeposits):
            self._sorted = _sort_on_host(self._device, deposits, grid, span)
        else:
            self._device_sort = self._device_sort or _DeviceSort(self._device)
            self._sorted = self._device_sort.run(deposits, grid, span)

    def estimate(self, place: Stream, facing: Stream, cuts: Stream, irradiance: Stream) -> None:
        """Write the irradiance at each visible point."""
        ports = {"place": place, "facing": facing, "cuts": cuts}
        if isinstance(self.kernel, NativeGather):
            self.kernel.run(ports | {"irradiance": irradiance}, self._radii, self._uniforms)
            return
        tables, count, launch = self._sorted
        if count == 0:
            irradiance.clear()
            return
        if irradiance.size not in self._sums:
            self._sums[irradiance.size] = PingPong(self._device, IRRADIANCE, irradiance.size)
        sums = self._sums[irradiance.size]
        sums.front.clear()
        for first in range(0, count, launch):
            end = first + launch
            target = irradiance if end >= count else sums.back
            self.kernel.run(
                ports | {"sum": sums.front, "irradiance": target},
                tables | self._radii,
                self._uniforms | {"photon_range": (first, end)},
            )
            sums.swap()

    def _forget(self) -> None:
        for texture in self._sorted.tables.values():
            texture.release()
        self._sorted = _NOTHING

    def release(self) -> None:
        """Free textures and the kernel."""
        self._forget()
        for pair in self._sums.values():
            pair.release()
        self.kernel.release()
        if self._device_sort:
            self._device_sort.release()


def _sort_on_host(
    device: Device, deposits: Deposits, grid: Mapping[str, Any], span: int
) -> _Sorted:
    """Sort by the native core's stable counting sort; a disc spans `span` cells at most."""
    place, deposit = deposits.arrays()
    if len(place) == 0:
        return _NOTHING
    origin = np.array(grid["grid_origin"], np.float32)
    start, order = native.sort_photons(place, origin, grid["cell_size"], grid["grid_cells"])
    tables = {
        "photon_place": upload_table(device, place[order]),
        "photon_deposit": upload_table(device, deposit[order]),
        "cell_start": upload_table(device, start),
    }
    return _Sorted(tables, len(place), _photons_a_launch(start, span))


def _photons_a_launch(start: NDArray[np.uint32], span: int) -> int:
    """All, unless a point might meet too many: in `span` by `span` rows of `span` cells at most."""
    count = int(start[-1])
    most = span**2 * int((start[span:] - start[:-span]).max()) if len(start) > span else count
    return MAX_ADDED if min(most, count) > 2 * MAX_ADDED else count


class _DeviceSort:
    """The gather's tables, by compute programs: the same order as the native core's."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self._count, self._scatter, self._rank, self._starts = (
            Program(device, f"grid_{step}") for step in ("count", "scatter", "rank", "starts")
        )
        self._scan, self._zero = Scan(device), Program(device, "fill_zero")
        self._fullest = device.ctx.buffer(reserve=4)
        self._buffers: dict[str, moderngl.Buffer] = {}

    def run(self, deposits: Deposits, grid: Mapping[str, Any], span: int) -> _Sorted:
        count, place, deposit = deposits.tables()
        if count == 0:
            return _NOTHING
        ctx, cells = self._device.ctx, int(np.prod(grid["grid_cells"]))
        counts = self._buffer("counts", cells + 1)
        starts = self._buffer("starts", cells + 1)
        listed = self._buffer("listed", count)
        self._zero.run(cells + 1, [counts])
        self._zero.run(1, [self._fullest])
        self._count.run(count, [counts, self._fullest], {"place": place}, uniforms=grid)
        fullest = self._device.read_uint(self._fullest)
        if fullest > MAX_RANKED:
            # Ranking costs the square of a cell's photons: a crowded focus goes to the host.
            return _sort_on_host(self._device, deposits, grid, span)
        ctx.copy_buffer(starts, counts, 4 * (cells + 1))
        self._scan.run(starts, cells + 1)
        self._scatter.run(count, [counts, starts, listed], {"place": place}, uniforms=grid)
        rows = -(-count // TABLE_WIDTH)
        tables = {
            name: self._device.texture((TABLE_WIDTH, rows), 4)
            for name in ("photon_place", "photon_deposit")
        }
        self._rank.run(
            count,
            [starts, listed],
            {"place": place, "deposit": deposit},
            [*tables.values()],
            grid,
        )
        start_rows = -(-(cells + 1) // TABLE_WIDTH)
        tables["cell_start"] = self._device.texture((TABLE_WIDTH, start_rows), 1, "u4")
        self._starts.run(cells + 1, [starts], images=[tables["cell_start"]])
        return _Sorted(tables, count, count)  # a GPU ends no loop early

    def _buffer(self, name: str, count: int) -> moderngl.Buffer:
        if name not in self._buffers or self._buffers[name].size < 4 * count:
            if name in self._buffers:
                self._buffers[name].release()
            self._buffers[name] = self._device.ctx.buffer(reserve=4 * count)
        return self._buffers[name]

    def release(self) -> None:
        for item in (self._scan, self._fullest, *self._buffers.values()):
            item.release()


def _cell_size(extent: Any, radius: float) -> float:
    """A cell's edge: the radius, or larger where that makes too many."""
    cell = max(radius, float(extent.max()) * 1e-6, 1e-30)
    while np.prod(np.floor(extent / cell) + 1) > MAX_CELLS:
        cell *= 1.26  # two in volume for three steps
    return cell
