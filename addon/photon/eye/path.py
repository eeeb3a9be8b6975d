# SPDX-License-Identifier: GPL-3.0-or-later
"""A path from the eye, and the streams that hold it and what is found where its rays end."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...streams import TEXEL, Count, Device, PingPong, Stream
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


# Paths of a pass whose light is looked for together, and points of all of these, at most: for each
# alone a GPU would wait for few threads that take long.
MOST_TOGETHER, POINTS_TOGETHER = 4, 1 << 21


def paths_together(size: tuple[int, int]) -> int:
    """How many of a pass's paths may have places, of streams of a size."""
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

    def rays(self) -> dict[str, PingPong]:
        """What secondary rays are written to, and read from."""
        return {name: self.pairs[name] for name in RAY if name in self.pairs}

    def release(self) -> None:
        """Put all back."""
        for stream in (*self.ones.values(), self.unit, self.unit_coverage):
            stream.release()
        for pair in self.pairs.values():
            pair.release()


@dataclass
class Path:
    """The eye rays of a region, or the secondary rays that they became."""

    index: int  # of the pass
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
            self.index,
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
