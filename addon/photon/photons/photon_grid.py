# SPDX-License-Identifier: GPL-3.0-or-later
"""The photon map as a grid: photons sorted by cell, ready for Gather."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ...streams import Defines, Device, Made, PingPong, Stream, of_parts
from ...streams.device import Layer
from ..kernels.gather import Gather
from ..kernels.shade import depth_for
from .deposits import Deposits
from .grid_sort import NOTHING, OF_PARTS, Sort
from .radius_field import Radii

MAX_CELLS = 1 << 22  # 16 MB of cell starts; a smaller radius then shares cells
# A cell is as wide as the typical radius, or narrower where it would hold more photons than this:
# looking into more cells then costs less than photons beyond the disc.
PHOTONS_A_CELL, NARROWEST = 120.0, 0.35
# Invocations of a GPU that share a visible point. Where neighbours see the same photons, one a
# point reads least, but fills a large GPU only with a million of them. After a bounce off a glossy
# surface none is beside its like; and a kernel takes as long as its slowest point, of which more
# share the photons where those crowd.
LANES, LANES_OF_CHAINS = 8, 16
POINTS_THAT_FILL = 1 << 20


# What a launch's sums begin with.
_BEGINS = {"irradiance": "sum", "gloss": "gloss_sum"}


class Lanes(NamedTuple):
    """Invocations that share a visible point."""

    eye: int = 1
    chain: int = 1


def lanes_of_gpu(pixels: int) -> Lanes:
    """By the pixels of the frame, also where a region of it is rendered: sums are to have the same
    order."""
    return Lanes(1 if pixels >= POINTS_THAT_FILL else LANES, LANES_OF_CHAINS)


class Cells:
    """The scene's box, cut into cells."""

    def __init__(self, extent: NDArray[Any]) -> None:
        """`extent` (3,): half the scene's size along each axis [scene units]."""
        self._lengths = [2 * float(x) for x in extent]
        self._origin = tuple(float(-np.float32(x)) for x in extent)

    def of(self, width: float) -> dict[str, Any]:
        """Where the grid begins, and cells that wide, or wider where that makes too many: as
        kernels read it."""
        cell = float(np.float32(_cell_size(self._lengths, width)))
        cells = tuple(int(length / cell) + 1 for length in self._lengths)
        return {"grid_origin": self._origin, "cell_size": cell, "grid_cells": cells}


class Gathering(Protocol):
    """What sums a pass's photons around visible points: a PhotonGrid, or the native core's."""

    def prepare(self, deposits: Deposits, radii: Radii) -> None:
        """Build the grid for the deposits and radii of a pass, or of passes together."""

    def estimate(
        self, points: Mapping[str, Stream], irradiance: Stream, in_chain: bool = False
    ) -> None:
        """Write the irradiance [W/m^2] at points: place, facing, cuts, coverage, tilt and zeros,
        with which sums begin; and where lobes gather photons, the points' gloss and gathered.
        `in_chain`: of secondary rays."""

    @property
    def launches(self) -> int:
        """How often gathering has run."""

    def release(self) -> None:
        """Put streams and lists back, free the kernels."""


class PhotonGrid:
    """Sorts a pass's photons into cells and sums those around each visible point."""

    def __init__(
        self,
        device: Device,
        layer: Layer,
        defines: Defines,
        cells: Cells,
        area: float,
        sort: Sort,
        lanes: Lanes,
        in_chains: Iterable[bool] = (False,),
        made: Made | None = None,
    ) -> None:
        """`defines`: the filter, and lobes that gather; `made`: what those are; `area`: of the
        scene's surfaces [scene units]; `in_chains`: whether for visible points of secondary rays,
        of eye rays, or both."""
        self._made = made
        self._device, self._layer, self._defines = device, layer, defines
        self._cells, self._area, self._sort, self._lanes = cells, area, sort, lanes
        self._kernels: dict[int, Gather] = {}  # by their lanes
        for in_chain in in_chains:
            self._kernel(in_chain)  # for the first pass to find it
        self._sorted = NOTHING
        self._uniforms: dict[str, Any] = {}
        self._radii: Radii | None = None
        self._sums: dict[Any, PingPong] = {}  # by size and output; where one launch is too long

    def prepare(self, deposits: Deposits, radii: Radii) -> None:
        """As Gathering's."""
        self._forget()
        self._radii = radii
        grids, spans, first = [], [], 0
        for width, largest in zip(radii.typical, radii.largest, strict=True):
            # By what the radii were told by: passes rendered together have the cells of each alone.
            crowd = radii.field.deposits * width**2 / self._area if self._area else 0.0
            share = max(NARROWEST, (PHOTONS_A_CELL / max(crowd, 1.0)) ** 0.5)
            grid = {**self._cells.of(width * min(1.0, share)), "first_cell": first}
            first += math.prod(grid["grid_cells"])
            grids.append(grid)
            spans.append(math.ceil(2 * largest / grid["cell_size"]) + 2)
        own = {name: of_parts([grid[name] for grid in grids]) for name in OF_PARTS}
        self._uniforms = radii.uniforms | own | {"grid_origin": grids[0]["grid_origin"]}
        self._sorted = self._sort.run(deposits, grids, spans)

    def estimate(
        self, points: Mapping[str, Stream], irradiance: Stream, in_chain: bool = False
    ) -> None:
        """As Gathering's."""
        assert self._radii
        kernel = self._kernel(in_chain)
        lists, runs, _ = self._sorted
        found = {name: points[name] for name in kernel.outputs if name != "irradiance"}
        found["irradiance"] = irradiance
        if not runs:
            for stream in found.values():
                stream.clear()
            return
        ports = {name: points[name] for name in kernel.inputs if name not in _BEGINS.values()}
        sums = {name: points["zeros"] for name in found if name in _BEGINS}
        launches = max(-(-(run.end - run.first) // max(run.launch, 1)) for run in runs)
        for number in range(launches):
            of_each = of_parts([run.part(number) for run in runs])
            is_last = number == launches - 1
            pairs = {name: self._pair(found[name], name) for name in sums if not is_last}
            begin = {_BEGINS[name]: stream for name, stream in sums.items()}
            kernel.run(
                ports | begin | found | {name: pair.back for name, pair in pairs.items()},
                lists | self._radii.tables(kernel),
                self._uniforms | depth_for(kernel, in_chain) | {"photon_range": of_each},
            )
            for name, pair in pairs.items():
                pair.swap()
                sums[name] = pair.front

    @property
    def launches(self) -> int:
        """As Gathering's."""
        return sum(kernel.launches for kernel in self._kernels.values())

    def _pair(self, like: Stream, name: str) -> PingPong:
        key = like.size, name
        if key not in self._sums:
            self._sums[key] = PingPong(self._device, like.record, like.size)
        return self._sums[key]

    def _kernel(self, in_chain: bool) -> Gather:
        lanes = self._lanes.chain if in_chain else self._lanes.eye
        if lanes not in self._kernels:
            self._kernels[lanes] = Gather(
                self._device, self._layer, self._defines, lanes, self._made
            )
        return self._kernels[lanes]

    def _forget(self) -> None:
        for item in self._sorted.own:
            self._device.free(item)
        self._sorted = NOTHING

    def release(self) -> None:
        """As Gathering's."""
        self._forget()
        for sums in self._sums.values():
            sums.release()
        for kernel in self._kernels.values():
            kernel.release()
        self._sort.release()


def _cell_size(lengths: Sequence[float], width: float) -> float:
    """A cell's edge: the width, or more where that makes too many."""
    cell = max(width, max(lengths) * 1e-6, 1e-30)
    while math.prod(int(length / cell) + 1 for length in lengths) > MAX_CELLS:
        cell *= 1.26  # two in volume for three steps
    return cell
