# SPDX-License-Identifier: GPL-3.0-or-later
"""Photons in order of their grid cells: sorted by the native core, or by compute programs."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple, Protocol

import moderngl
import numpy as np
import photon_stream_native as native
from numpy.typing import NDArray

from ...streams import MOST_PARTS, Device, Program, Reading, Scan, for_all_parts
from ...streams.compute import clear
from .deposits import Deposits

MAX_RANKED = 8192  # photons in a cell that the device still ranks
DIGITS_OF_PART = 25  # as in glsl/lib/of_part.glsl
MOST_UINT = (1 << 32) - 1
# Photons that a launch may add to a point where they crowd. Mesa's llvmpipe ends all loops of a
# program after 65535 steps in sum, without a word; SIMD neighbours' steps add up.
MAX_ADDED = 1 << 14

Grid = Mapping[str, Any]  # its origin, cell size, cells and the number of its first one
PROGRAMS = dict.fromkeys(
    ("grid_count", "grid_scatter", "grid_rank"), f"#define MOST_PARTS {MOST_PARTS}"
)
OF_PARTS = ("cell_size", "grid_cells", "first_cell")  # of these, what each has of its own


class Run(NamedTuple):
    """Sorted photons one after the other, and how many of them a launch may look at."""

    first: int
    end: int
    launch: int

    def part(self, number: int) -> tuple[int, int]:
        """What the launch of a number looks at."""
        first = min(self.first + number * self.launch, self.end)
        return first, min(first + self.launch, self.end)


class Sorted(NamedTuple):
    """Photons in order of their cells."""

    lists: dict[str, Any]  # the gather's
    runs: tuple[Run, ...]  # one of each pass, or of all
    own: tuple[Any, ...] = ()  # of the lists, what ends with the pass


NOTHING = Sorted({}, ())


class Sort(Protocol):
    """What sorts a pass's photons."""

    def run(self, deposits: Deposits, grids: Sequence[Grid], spans: Sequence[int]) -> Sorted:
        """The deposits by cells, those of each pass in a grid of its own, one after the other, of
        which a disc spans so many cells at most."""

    def release(self) -> None:
        """Free what is on the device."""


class HostSort:
    """By the native core's stable counting sort."""

    def __init__(self, upload: Callable[[NDArray[Any]], Any]) -> None:
        """`upload`: makes a list that kernels read of an array."""
        self._upload = upload

    def run(self, deposits: Deposits, grids: Sequence[Grid], spans: Sequence[int]) -> Sorted:
        """As Sort's."""
        place, deposit = deposits.arrays()
        if len(place) == 0:
            return NOTHING
        start, order = _sorted(place, grids)
        runs = []
        for grid, span in zip(grids, spans, strict=True):
            first = grid["first_cell"]
            cells = start[first : first + math.prod(grid["grid_cells"]) + 1]
            runs.append(Run(int(cells[0]), int(cells[-1]), _photons_a_launch(cells, span)))
        data = {"photon_place": place[order], "photon_deposit": deposit[order], "cell_start": start}
        lists = {name: self._upload(values) for name, values in data.items()}
        return Sorted(lists, tuple(runs), tuple(lists.values()))

    def release(self) -> None:
        """Nothing is held."""


def _sorted(
    place: NDArray[np.float32], grids: Sequence[Grid]
) -> tuple[NDArray[np.uint32], NDArray[Any]]:
    """Where each cell's photons start, and all photons in order."""
    if len(grids) == 1:
        return _sorted_into(grids[0], place)
    part = _part_in(place[:, 3])
    starts, orders, before = [np.zeros(1, np.uint32)], [], 0
    for number, grid in enumerate(grids):
        own = np.flatnonzero(part == number)
        start, order = _sorted_into(grid, place[own])
        starts.append(start[1:] + np.uint32(before))
        orders.append(own[order])
        before += len(own)
    return np.concatenate(starts), np.concatenate(orders)


def _sorted_into(
    grid: Grid, place: NDArray[np.float32]
) -> tuple[NDArray[np.uint32], NDArray[np.uint32]]:
    """The same of one grid's photons alone."""
    origin = np.array(grid["grid_origin"], np.float32)
    return native.sort_photons(place, origin, grid["cell_size"], grid["grid_cells"])


def _part_in(surfaces: NDArray[np.float32]) -> NDArray[np.int32]:
    """As part_in of glsl/lib/of_part.glsl, of places' surfaces that are not zero."""
    turn = ((surfaces.view(np.uint32) >> 23 & 255).astype(np.int32) - 127) // DIGITS_OF_PART
    return np.where(turn > 0, 2 * turn - 1, -2 * turn)


def _photons_a_launch(start: NDArray[np.uint32], span: int) -> int:
    """All, unless a point might meet too many: in `span` by `span` rows of `span` cells at most."""
    count = int(start[-1] - start[0])
    most = span**2 * int((start[span:] - start[:-span]).max()) if len(start) > span else count
    return MAX_ADDED if min(most, count) > 2 * MAX_ADDED else count


class DeviceSort:
    """The gather's lists, by compute programs: the same order as the native core's."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self._count, self._scatter, self._rank = (
            Program(device, stem, declared) for stem, declared in PROGRAMS.items()
        )
        self._scan = Scan(device)
        self._host = HostSort(device.ctx.buffer)
        self._fullest = device.buffer(4)
        self._reading: Reading | None = None  # of it, in the last pass
        self._buffers: dict[str, moderngl.Buffer] = {}

    def run(self, deposits: Deposits, grids: Sequence[Grid], spans: Sequence[int]) -> Sorted:
        """As Sort's."""
        count, place, deposit = deposits.tables()
        if count == 0:
            return NOTHING
        cells = grids[-1]["first_cell"] + math.prod(grids[-1]["grid_cells"])
        values: dict[str, Any] = {
            name: for_all_parts([grid[name] for grid in grids]) for name in OF_PARTS
        }
        values["grid_origin"] = grids[0]["grid_origin"]
        counts = self._buffer("counts", cells + 1)
        starts = self._buffer("starts", cells + 1)
        listed = self._buffer("listed", count)
        clear(self._device, counts, cells + 1)
        clear(self._device, self._fullest, 1)
        self._count.run(count, [counts, self._fullest], {"place": place}, uniforms=values)
        # Ranking costs the square of a cell's photons: a crowded focus goes to the host. Whether
        # there is one the last pass tells, for which no host waits; the first waits for its own,
        # and ranks none until then.
        last, self._reading = self._reading, self._device.ask(self._fullest, 1)
        if last and _is_crowded(last):
            return self._host.run(deposits, grids, spans)
        self._device.copy_buffer(starts, counts, 4 * (cells + 1))
        self._scan.run(starts, cells + 1)
        self._scatter.run(count, [counts, starts, listed], {"place": place}, uniforms=values)
        places, fluxes = (self._buffer(name, 4 * count) for name in ("places", "deposits"))
        textures = {"place": place, "deposit": deposit}
        self._rank.run(
            count,
            [starts, listed, places, fluxes, self._fullest],
            textures,
            uniforms={**values, "most_ranked": MOST_UINT if last else MAX_RANKED},
        )
        if not last and _is_crowded(self._reading):
            return self._host.run(deposits, grids, spans)
        lists = {"photon_place": places, "photon_deposit": fluxes, "cell_start": starts}
        return Sorted(lists, (Run(0, count, count),))  # a GPU ends no loop early

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
