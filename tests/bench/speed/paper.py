# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's two tables (Marino & Abbate, Tables 1 and 2): the same cells, our seconds.

The same scene and the same method: light by photons alone, a fixed radius, splats; and beside it
what the renderer would choose today, to gather.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple, get_args

from addon.photon.scene import Scene
from addon.photon.settings import Settings, SplatShape
from addon.photon.stage.geometry import frame_of

from .launches import Timer
from .passes import Clock, Predictor, Timing, Way, time_way
from .report import Report, Table, duration

ROOM = 10.0  # [m] the paper's unit is a tenth of the room
SHARE_OF_SPLATS = (0.70, 0.75)  # of the photons, by the paper
_SLICE = {True: 0.1, False: 0.2}  # [s] of passes that a cell's splat shape gets; on software OpenGL


class Cell(NamedTuple):
    """A cell of the tables."""

    photons: int
    radius: float
    size: int  # [px] a side

    @property
    def work(self) -> float:
        """In proportion to the pairs of a photon and a visible point."""
        return self.photons * self.radius**2 * self.size**2


@dataclass(frozen=True)
class Seconds:
    """A frame; NaN for what is not known."""

    total: float
    tracing: float = math.nan
    splatting: float = math.nan


# Of the tables' cells those that are known here. The others' dimensions are an assumption: three
# counts of photons, three radii and three sizes that include the known ones.
KNOWN = {
    Cell(262144, 1.25, 512): Seconds(16.92, 7.26, 5.51),
    Cell(262144, 1.5, 512): Seconds(20.43),
}
PHOTONS, RADII, SIZES = (65536, 131072, 262144), (1.0, 1.25, 1.5), (128, 256, 512)
ASSUMED = (
    f"the paper's hardware: GeForce 6600; its seconds are known here for {len(KNOWN)} cells of 27."
    " ASSUMED: that the other cells are those of "
    + f"{'/'.join(map(str, PHOTONS))} photons, radius {'/'.join(map(str, RADII))},"
    + f" {'/'.join(map(str, SIZES))} px"
)


def cells() -> list[Cell]:
    """The smallest, by which the others are predicted, then the known ones, then by their work."""
    every = sorted(itertools.starmap(Cell, itertools.product(PHOTONS, RADII, SIZES)), key=_work)
    return sorted(every, key=lambda cell: (cell != every[0], cell not in KNOWN, cell.work))


def _ratio(value: float) -> str:
    return "-" if math.isnan(value) else f"{value:.3g}"


def _work(cell: Cell) -> float:
    return cell.work


def measure_paper(report: Report, timer: Timer, scene: Scene, clock: Clock) -> None:
    """Time each cell with each splat shape."""
    device = timer.device
    width = 2 * frame_of(scene).scale
    shapes = get_args(SplatShape)
    gather = Way("auto", "gather")
    table = report.table(
        "The paper's tables: seconds a frame",
        "photons, radius, size", *shapes, "tracing", "splatting", "splats a photon",
        "paper", "tracing", "splatting", "paper / splats", "gather", "paper / gather",
    )  # fmt: skip
    left_out: list[float] = []  # [s] guessed
    predictor, results = Predictor(), report.data.setdefault("paper", [])

    def timed(cell: Cell, way: Way) -> Timing | None:
        """None: there is no time left for it."""
        if 3 * predictor.seconds(way, cell.work) > clock.left:
            return None
        settings = Settings(
            width=cell.size,
            height=cell.size,
            photons=cell.photons,
            radius=cell.radius * width / ROOM,
            direct_by_photons=True,
        )
        timing = time_way(scene, way.of(settings), device, _SLICE[device.is_software], timer)
        predictor.learn(way, cell.work, timing.seconds)
        return timing

    # First, for it takes a hundredth of what splats take: of these there may be too many.
    gathers = {cell: timed(cell, gather) for cell in cells()}
    for cell, gather_timing in gathers.items():
        of_splats = {shape: timed(cell, Way("auto", "splat", shape)) for shape in shapes}
        found = {shape: timing for shape, timing in of_splats.items() if timing}
        results.append(_tell(table, cell, found, gather_timing))
        if not found:
            ways = [Way("auto", "splat", shape) for shape in shapes]
            left_out.append(min(predictor.seconds(way, cell.work) for way in ways))
    if left_out:
        table.note(
            f"{len(left_out)} cells without splats: a pass would take"
            f" {duration(min(left_out))} to {duration(max(left_out))} by the largest measured"
        )
    low, high = SHARE_OF_SPLATS
    table.note(ASSUMED)
    table.note(
        f"a frame of ours is a pass: photons, splats, mirror chains of the glossy walls, boundary"
        f" correction, estimated error; tracing: its photons; tracing and splatting: of the fastest"
        f" shape; splats a photon: {low:.0%} to {high:.0%} by the paper; the room is {width:.3g} m"
        " wide"
    )


def _tell(
    table: Table, cell: Cell, of_splats: Mapping[str, Timing], gather: Timing | None
) -> dict[str, Any]:
    """Add a cell's row, of the timings of shapes of splats; what the data have of it."""
    seconds = {shape: timing.seconds for shape, timing in of_splats.items()}
    gathered = gather.seconds if gather else math.nan
    best = min(seconds, key=lambda shape: seconds[shape]) if seconds else ""
    splats = [*of_splats.values()][-1].splats if of_splats else math.nan
    tracing = splatting = math.nan
    if fastest := of_splats.get(best):
        assert fastest.watch
        tracing = fastest.phases.get("photons", math.nan)
        splatting = fastest.watch.of("splat").seconds
    known = KNOWN.get(cell, Seconds(math.nan))
    ratios = [known.total / seconds[best] if seconds else math.nan, known.total / gathered]
    table.add(
        f"{cell.photons}, {cell.radius:g}, {cell.size}x{cell.size}",
        *(duration(seconds.get(shape, math.nan)) for shape in get_args(SplatShape)),
        *map(duration, (tracing, splatting)),
        f"{splats / cell.photons:.0%}" if seconds else "-",
        *map(duration, (known.total, known.tracing, known.splatting)),
        _ratio(ratios[0]),
        duration(gathered),
        _ratio(ratios[1]),
    )
    return (
        cell._asdict()
        | {"seconds": seconds, "tracing": tracing, "splatting": splatting}
        | {"splats": splats, "gather": gathered, "paper": vars(known)}
        | {"paper over splats and gather": ratios}
    )
