# SPDX-License-Identifier: GPL-3.0-or-later
"""Passes of photons: started, and awaited by who first asks what they brought."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from ...streams import Stream
from ..phases import Phases
from ..settings import Settings
from .aim import Aiming
from .kept import Kept
from .mapper import Mapper
from .photon_grid import Gathering
from .radius_field import Radii, RadiusField, radius_scale
from .splats import Projection, Splats

SPARE_DEPOSITS = 1.5  # room for so many times those foreseen


class PhotonPass:
    """The photons of a pass, or of passes together, on their way until the first point looks for
    them."""

    def __init__(self, photons: Photons, radii: Radii) -> None:
        self._photons, self.radii = photons, radii
        self._has_landed = False

    def gather(
        self, points: Mapping[str, Stream], irradiance: Stream, projection: Projection | None
    ) -> None:
        """Write the irradiance [W/m^2] at points: place, facing, cuts, coverage, tilt; and where
        their lobes gather photons, what those bring; the projection is that of eye rays."""
        self._land()
        self._photons.sum_about(points, irradiance, projection)

    def gather_caustics(
        self, points: Mapping[str, Stream], irradiance: Stream, projection: Projection | None
    ) -> None:
        """The same of those photons alone that came by way of lobes that are not diffuse."""
        self._land()
        self._photons.sum_caustics_about(points, irradiance, projection)

    def _land(self) -> None:
        if not self._has_landed:
            self._photons.land(self.radii)
            self._has_landed = True


class Photons:
    """Traces passes of photons and sums them about points."""

    def __init__(
        self,
        mapper: Mapper,
        kept: Kept,
        settings: Settings,
        field: RadiusField,
        splat: Splats | None,
        grid: Gathering | None,
        caustics: Gathering | None,
        traces_ahead: bool,
        phases: Phases,
        aiming: Aiming,
        find_field: Callable[[], RadiusField | None],
        most_deposits: float,
    ) -> None:
        """`splat` draws what the eye sees directly, if there is one; `grid` gathers the rest, and
        `caustics` those photons again that are told apart, if any are.
        `traces_ahead`: the device traces while the host waits for something else;
        `aiming`: where photons start; `find_field`: radii for photons that start elsewhere;
        `most_deposits`: of passes together that lists have room for."""
        self.mapper, self.field, self.splat, self.grid = mapper, field, splat, grid
        self._caustics = caustics
        self._kept, self._settings = kept, settings
        self._traces_ahead, self._phases = traces_ahead, phases
        self._aiming, self._find_field = aiming, find_field
        self.dropped = 0  # deposits that were not finite, of the passes so far
        self._most_deposits = most_deposits
        self._landed = field.deposits  # of a pass, whichever had the most

    def started_alike(self, passes: range) -> range:
        """Those of passes, from the first on, that can be traced together: their photons start by
        the same that is known, and what they leave has room."""
        if not self._aiming.knows(passes.start):
            return passes[:1]
        alike = self._aiming.alike(passes.start, len(passes))
        room = self._most_deposits / (SPARE_DEPOSITS * max(self._landed, 1.0))
        return passes[: max(1, int(min(alike, room)))]

    def start(self, passes: range) -> PhotonPass:
        """Launch the photons of passes together, unless that was done."""
        index = passes.start
        if not self._aiming.knows(index):
            with self._phases.timed("aim"):
                self._aim(index)
        self._aiming.set(index)
        with self._phases.timed("photons"):
            self._kept.start(self.mapper, self._settings, index, passes=len(passes))
        return PhotonPass(self, self.field.of_passes(*map(self._radius_scale, passes)))

    def _aim(self, index: int) -> None:
        """Learn where a pass's photons start, and their radii if that is elsewhere."""
        self._aiming.set(index)
        field = self._find_field() if self._aiming.is_aimed else None
        if field:
            self.field.release()
            self.field = field

    def prefetch(self, passes: range) -> None:
        """Launch the photons of passes to come, where that costs these nothing."""
        if not self._aiming.knows(passes.start):
            return  # that takes longer
        if self._traces_ahead and passes:
            self.start(passes)

    def land(self, radii: Radii) -> None:
        """Wait for the photons that were started, and make them ready to be summed."""
        with self._phases.timed("photons"):
            deposits = self._kept.finish(self.mapper)
            self.dropped = deposits.dropped
            self._landed = max(self._landed, deposits.count / len(radii.scales))
        with self._phases.timed("photon map"):
            for estimator in (self.splat, self.grid):
                if estimator:
                    estimator.prepare(deposits, radii)
            if self._caustics:
                assert deposits.caustics
                self._caustics.prepare(deposits.caustics, radii)

    def sum_about(
        self, points: Mapping[str, Stream], irradiance: Stream, projection: Projection | None
    ) -> None:
        """As PhotonPass.gather, of the photons that landed last."""
        if self.splat and projection:
            self.splat.estimate(points, irradiance, projection)
        else:
            assert self.grid
            self.grid.estimate(points, irradiance, in_chain=projection is None)

    def sum_caustics_about(
        self, points: Mapping[str, Stream], irradiance: Stream, projection: Projection | None
    ) -> None:
        """As PhotonPass.gather_caustics, of the photons that landed last."""
        assert self._caustics
        self._caustics.estimate(points, irradiance, in_chain=projection is None)

    def radius(self, index: int) -> float:
        """The radius of a pass, typical of where photons fall [scene units]."""
        return self.field.of_passes(self._radius_scale(index)).typical[0]

    def launches(self) -> dict[str, int]:
        """How often each kernel has run."""
        counts = self.mapper.launches()
        grids = [grid for grid in (self.grid, self._caustics) if grid]
        if grids:
            counts["gather"] = sum(grid.launches for grid in grids)
        return counts | (self.splat.launches() if self.splat else {})

    def release_field(self) -> None:
        """Free the radii."""
        self.field.release()

    def release(self) -> None:
        """Free everything on the device."""
        for part in (self.mapper, self.field, self.splat, self.grid, self._caustics):
            if part:
                part.release()

    def _radius_scale(self, index: int) -> float:
        return radius_scale(self._settings.radius_decay, index)
