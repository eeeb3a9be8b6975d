# SPDX-License-Identifier: GPL-3.0-or-later
"""A path from the eye, and the streams that hold it and what is found where its rays end."""

from __future__ import annotations

import copy
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...streams import TEXEL, Count, Device, PingPong, Stream, StreamError
from ...streams.declaration import present
from ..kernels.records import (
    CHAIN,
    COVERAGE,
    CUTS,
    HIT,
    ILLUMINANCE,
    IRRADIANCE,
    MEDIUM,
    PIXEL,
    RADIANCE,
    RAY_DIRECTION,
    RAY_ORIGIN,
    THROUGHPUT,
    TILT,
    WALK,
)
from ..kernels.shade import GLOSSY, LOBES, POINT
from ..photons.splats import Projection
from ..settings import Region
from ..stage.needs import SceneNeeds

CAUSTIC = "caustic_"  # how streams of the part of gathered light begin that caustics are
# What a secondary ray takes with it.
RAY = ("origin", "direction", "throughput", "chain", "medium")
WALKED = ("origin", "direction", "throughput")  # of these, what walks below surfaces change
# Of these, what the eye's own rays have, zero, in streams of their own.
FIRST = {"chain": "first_chain", "medium": "first_medium"}


# Paths, of a pass or of passes together, whose light is looked for together, and points of all of
# these, at most: for each alone a GPU would wait for few threads that take long.
MOST_TOGETHER, POINTS_TOGETHER = 4, 1 << 22


def paths_together(size: tuple[int, int]) -> int:
    """How many paths may have places, of streams of a size."""
    return max(1, min(MOST_TOGETHER, POINTS_TOGETHER // (size[0] * size[1])))


class PathStreams:
    """Those that a scene has a use for, of one size; made at once, for the first pass to find."""

    def __init__(
        self, device: Device, needs: SceneNeeds, probes: bool, size: tuple[int, int]
    ) -> None:
        """`probes`: whether the coverage of points is estimated."""
        self.device, self.size = device, size
        self._needs, self._probes = needs, probes
        ones = {"hit": HIT, **present({**POINT, **LOBES, **GLOSSY}, needs.eye_defines)}
        ones |= {"pixel": PIXEL, "irradiance": IRRADIANCE, "zeros": TEXEL}
        if needs.emitters_seen:
            ones |= {"emitted": RADIANCE, "environment": RADIANCE}
        if needs.emission_programs.nodes:
            ones["emission"] = RADIANCE
        twos = {"origin": RAY_ORIGIN, "direction": RAY_DIRECTION, "direct": RADIANCE}
        if needs.photons:
            ones |= {"cuts": CUTS, "coverage": COVERAGE, "tilt": TILT}
        if needs.caustics:
            found = {"irradiance": IRRADIANCE, **present(GLOSSY, needs.eye_defines)}
            ones |= {f"{CAUSTIC}{name}": record for name, record in found.items()}
        if needs.illuminance:
            twos["illuminance"] = ILLUMINANCE
        if needs.secondary_rays:
            twos["throughput"] = THROUGHPUT
        if needs.walk_defines:
            ones["walk"] = WALK
        if needs.transparent:
            ones["first_chain"] = twos["chain"] = CHAIN
        if needs.media:
            ones |= {"first_medium": MEDIUM, "along": MEDIUM, "left": THROUGHPUT}
            ones |= {"met": HIT} if needs.scattering else {}
            twos |= {"medium": MEDIUM} if needs.secondary_rays else {}
        self.ones = {name: Stream(device, record, size) for name, record in ones.items()}
        self.pairs = {name: PingPong(device, record, size) for name, record in twos.items()}
        self.unit = Stream(device, THROUGHPUT, size)
        self.unit_coverage = Stream(device, COVERAGE, size)

    def prepare(self) -> None:
        """Fill those that something is read from before it is written."""
        for stream in self.ones.values():
            stream.clear()
        self._fill_ones()

    def _fill_ones(self) -> None:
        ones = [self.unit, self.unit_coverage]
        if "coverage" in self.ones and not self._probes:
            ones.append(self.ones["coverage"])  # which gathering reads
        for stream in ones:
            stream.fill(1.0)

    def of_size(self, size: tuple[int, int]) -> PathStreams:
        """The same of another size, for secondary rays. They leave surfaces, so every kernel runs
        on them, and only what none writes is cleared."""
        made = PathStreams(self.device, self._needs, self._probes, size)
        names = ["zeros"]
        names += [] if self._needs.photons else ["irradiance"]
        names += ["cuts", "tilt"] if self._needs.photons and not self._probes else []
        for name in names:
            made.ones[name].clear()
        made._fill_ones()
        return made

    def first_rows(self, rows: int) -> PathStreams:
        """Streams that are the first rows of these."""
        part = copy.copy(self)
        part.size = self.size[0], rows
        part.ones = {name: stream.first_rows(rows) for name, stream in self.ones.items()}
        part.pairs = {name: pair.first_rows(rows) for name, pair in self.pairs.items()}
        part.unit = self.unit.first_rows(rows)
        part.unit_coverage = self.unit_coverage.first_rows(rows)
        return part

    def rays(self) -> dict[str, PingPong]:
        """What secondary rays are written to, and read from."""
        return {name: self.pairs[name] for name in RAY if name in self.pairs}

    def release(self) -> None:
        """Put all back."""
        for stream in (*self.ones.values(), self.unit, self.unit_coverage):
            stream.release()
        for pair in self.pairs.values():
            pair.release()


class Places:
    """Streams of paths, one after the other and again from the first."""

    def __init__(self, first: PathStreams, rows: int) -> None:
        """`first`: of as many passes as are rendered together at most; `rows`: of a pass."""
        self.all, self._rows = [first], rows
        self._of_fewer: dict[tuple[int, int], PathStreams] = {}

    def grow(self, count: int) -> int:
        """To so many, or as many as there is room for: with fewer it only takes longer."""
        first = self.all[0]
        while len(self.all) < count:
            try:
                self.all.append(first.of_size(first.size))
            except StreamError:
                break
        return len(self.all)

    def of(self, number: int, passes: int) -> PathStreams:
        """The place of a number, for so many passes."""
        place, rows = self.all[number], passes * self._rows
        if rows == place.size[1]:
            return place
        if (number, rows) not in self._of_fewer:
            self._of_fewer[number, rows] = place.first_rows(rows)
        return self._of_fewer[number, rows]

    def release(self) -> None:
        """Put all back."""
        for place in self.all:
            place.release()


@dataclass
class Path:
    """The eye rays of a region, of a pass or of passes together, one's above those of the one
    before; or the secondary rays that they became."""

    passes: range
    region: Region
    depth: int
    at: PathStreams  # what holds it
    throughput: Stream
    # What rays carry where they begin; media take of it what throughput lacks.
    arriving: Stream
    carried: dict[str, Stream]  # what else there is of FIRST
    projection: Projection | None  # of eye rays
    count: Count | None  # of the rays that are alive; None: they are taken to be
    # Of the region, that the first elements are of; None: each is of the pixel at its place.
    pixels: NDArray[np.int64] | None = None
    is_shaded: bool = False
    onward: Path | None = None  # what became of its rays, once that is known
    is_scattered: bool = False
    # Light at the points, once it is known; what rays meet of lights and the world, if there are
    # any; and the coverage of what photons bring.
    direct: dict[str, Stream] | None = None
    emitted: tuple[Stream, Stream] | None = None
    coverage: Stream | None = None

    def sent_on(self, to: PathStreams, count: Count | None) -> Path:
        """The path that its rays become, which are written to streams; `count`: as Path's."""
        return Path(
            self.passes,
            self.region,
            self.depth + 1,
            to,
            self.throughput,
            self.arriving,
            {},
            projection=None,
            count=count,
            pixels=self.pixels,
        )

    @property
    def alive(self) -> bool:
        """Whether any ray is; waits for the device, if it was asked."""
        return self.count is None or self.count.wait() > 0
