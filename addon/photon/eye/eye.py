# SPDX-License-Identifier: GPL-3.0-or-later
"""Paths from the eye: sent, shaded where they end, lit, and scattered while any is alive."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...streams import Count, Kernel, PingPong, Reading, Stream, Tally, of_parts
from ..backends.backend import Backend
from ..kernels.coverage import probes_of
from ..kernels.emitted import Emitted
from ..kernels.free_flight import FreeFlight, media_values
from ..kernels.launch import launch, launch_and_count, launch_and_tally
from ..kernels.scatter import Scatter
from ..kernels.shade import POINT, Shade
from ..kernels.surface_emission import SurfaceEmission
from ..photons.photon_pass import PhotonPass
from ..photons.radius_field import Radii
from ..scene import Scene
from ..settings import Region, Settings
from ..stage.geometry import Frame
from ..stage.needs import SceneNeeds
from ..stage.tables import Tables
from .camera import EyeCamera
from .compaction import Compaction
from .path import CAUSTIC, FIRST, WALKED, Path, PathStreams, Places


class Eye:
    """Follows a pass's paths over regions of the frame, all of one size."""

    def __init__(
        self,
        backend: Backend,
        tables: Tables,
        frame: Frame,
        scene: Scene,
        settings: Settings,
        needs: SceneNeeds,
        size: tuple[int, int],
        together: int = 1,
        passes: int = 1,
    ) -> None:
        """`size`: of a region; `together`: paths whose light is looked for together at most;
        `passes`: that are, at most."""
        device, layer = backend.device, backend.layer
        self._tally: Tally | None = None  # of rays that a path's bounces send
        self._tables, self._settings, self._needs = tables, settings, needs
        self._place = frame.points(scene.camera.matrix[:3, 3])
        self._ended: dict[Region, int] = {}  # the first bounce that ever sent no ray
        self._sent: Path | None = None  # ahead
        self.camera = EyeCamera(device, layer, scene, frame, settings, needs)
        self.footprint: dict[str, tuple[float, ...]] = {}  # of a pixel, where bumps ask; `prepare`
        self._shade: Shade | None = None
        self._tracers: list[Kernel] = []  # of eye rays, and of others if those see something else
        if needs.surfaces:
            self._tracers = [backend.tracer(rays=needs.rays("camera"))]
            if needs.secondary_rays and needs.visibility:
                self._tracers.append(backend.tracer(rays=needs.rays_of_chains))
            self._shade = Shade(device, layer, needs.eye_defines, made=needs.made)
        self._direct_light = backend.direct_light(needs, size) if needs.shadow_rays else None
        self._emitted = self._surface_emission = self._scatter = None
        self._walk: Kernel | None = None
        self._flight: FreeFlight | None = None
        if needs.media and needs.surfaces:
            self._flight = FreeFlight(device, layer, needs.flight_defines("EYE"))
        if needs.emitters_seen:
            defines = {**needs.emitted_defines, **backend.kind_defines}
            self._emitted = Emitted(device, layer, defines, made=needs.made)
        if needs.emission_programs.nodes:
            self._surface_emission = SurfaceEmission(
                device, layer, needs.surface_emission_defines, made=needs.surface_emission_made
            )
        if needs.secondary_rays:
            self._scatter = Scatter(device, layer, needs.eye_defines, made=needs.made)
            self._walk = backend.walk() if needs.walk_defines else None
            if backend.works_alone and self._most_bounces:
                self._tally = Tally(device, self._most_bounces)
        self._cuts = self._coverage = None
        if needs.photons and settings.boundary_correction:
            self._cuts, self._coverage = backend.cuts(), backend.coverage(settings)
        all_rows = size[0], size[1] * passes
        self.streams = PathStreams(device, needs, self._coverage is not None, all_rows)
        self._places = Places(self.streams, size[1])
        self._together = min(together, 1 + self._most_bounces) if needs.secondary_rays else 1
        self._compaction: Compaction | None = None
        if needs.secondary_rays and backend.shares_memory:
            self._compaction = Compaction(self.streams)

    def prepare(self) -> None:
        """Fill the streams that something is read from before it is written, and tell the
        footprint of pixels."""
        self.streams.prepare()
        if medium := self.streams.ones.get("first_medium"):
            inside = self._tables.around_eye(self._place)
            elements = np.zeros((medium.size[1], medium.size[0], 4), np.float32)
            elements[..., :2] = inside
            medium.upload(elements)
        self._together = self._places.grow(self._together)
        self.footprint = self.camera.widths() if self._needs.programs.bumps else {}

    def send_ahead(self, index: int, region: Region) -> None:
        """Send a pass's rays and light the points where they end, which no photon tells: a GPU
        traces them while the host waits for photons. `send` then gives this path."""
        path = self.send(range(index, index + 1), region)
        self.shade(path)
        self.direct(path)
        self._sent = path

    def send(self, passes: range, region: Region) -> Path:
        """Send one ray of each pass through each pixel of a region."""
        sent, self._sent = self._sent, None
        if sent and (sent.passes, sent.region) == (passes, region):
            return sent
        at = self._places.of(0, len(passes))
        origin, direction = (at.pairs[name].front for name in ("origin", "direction"))
        projection = self.camera.send(passes, region, origin, direction, at.ones["pixel"])
        carried = {name: at.ones[first] for name, first in FIRST.items() if first in at.ones}
        return Path(passes, region, 0, at, at.unit, at.unit, carried, projection, None)

    def shade(self, path: Path) -> None:
        """Find where the rays end, and evaluate the materials there."""
        if path.is_shaded or not (self._tracers and self._shade):
            return  # without surfaces the streams were made clear: no hits, no places
        tracer = self._tracers[min(path.depth, len(self._tracers) - 1)]
        launch(tracer, self.of(path), self._tables)
        self._fly(path)
        streams = {**self.of(path), "throughput": path.throughput}
        launch(self._shade, streams, self._tables, self._draw(path))
        path.is_shaded = True

    def _fly(self, path: Path) -> None:
        """Find what media leave of the rays, and which of them they scatter before their ends."""
        if not self._flight:
            return
        streams = {**self.of(path), "throughput": path.throughput}
        launch(self._flight, streams, self._tables, self._draw(path))
        ones = path.at.ones
        path.throughput = ones["left"]
        path.carried = path.carried | {"medium": ones["along"]}
        if self._needs.scattering:
            path.carried |= {"hit": ones["met"]}

    def follow(self, path: Path) -> list[Path]:
        """Shade a path, and what becomes of its rays, as far as that is known to be alive and there
        is a place: paths whose light is looked for together."""
        self.shade(path)
        paths = [path]
        while len(paths) < self._together:
            onward = self.scatter(paths[-1])
            if not (onward and self._goes_on(onward)):
                break
            self.shade(onward)
            paths.append(onward)
        return paths

    def _goes_on(self, path: Path) -> bool:
        """Whether a path's rays are alive; no, where passes before ended there: to know it the host
        would wait while the device has nothing else to do."""
        if path.count and path.region in self._ended:
            return False
        return path.alive

    def gathering(self, path: Path) -> tuple[NDArray[np.float64], ...]:
        """Where points of a path gather photons, (n, 3), the geometric normals there, and what
        share of a pixel sees each; waits for the device."""
        ones = path.at.ones
        place, facing, diffuse, throughput = (
            stream.download().reshape(-1, 4).astype(np.float64)
            for stream in (ones["place"], ones["facing"], ones["diffuse"], path.throughput)
        )
        there = (place[:, 3] != 0.0) & (diffuse[:, 3] > 0.0)
        return place[there, :3], facing[there, :3], throughput[there, :3].mean(axis=1)

    def look(self, paths: Sequence[Path], photons: PhotonPass | None) -> None:
        """Find the light of paths: what rays meet, what comes straight to the points, and what
        photons bring. For all of them kernel by kernel, each of which a GPU runs at once."""
        for path in paths:
            self._look_for_lights(path)
        for path in paths:
            self.direct(path)
        if not photons:
            for path in paths:
                path.coverage = path.at.unit_coverage
            return
        for path in paths:
            self._find_cuts(path, photons.radii)
        for path in paths:
            path.coverage = self._find_coverage(path, photons.radii)
        for path in paths:
            self._gather(path, photons)

    def _look_for_lights(self, path: Path) -> None:
        """Find what rays meet of lights, and of the world, if there is any to see."""
        if not self._emitted:
            return
        # Lights know of media by themselves.
        own = {"hit": path.at.ones["hit"], "throughput": path.arriving}
        streams = self.of(path) | own
        if self._surface_emission:
            launch(self._surface_emission, streams, self._tables, self._draw(path))
        launch(self._emitted, streams, self._tables, self._draw(path))
        path.emitted = path.at.ones["emitted"], path.at.ones["environment"]

    def direct(self, path: Path) -> None:
        """Direct light at the points, "direct", and its "illuminance" if that is asked for."""
        if path.direct is not None:
            return
        names = ("direct", "illuminance") if self._needs.illuminance else ("direct",)
        totals = {name: path.at.pairs[name] for name in names}
        for total in totals.values():
            total.restart(path.at.ones["zeros"])
        if self._direct_light:
            self._direct_light.add(totals, self.of(path), self._tables, self._draw(path))
        path.direct = {name: total.front for name, total in totals.items()}

    def _gather(self, path: Path, photons: PhotonPass) -> None:
        """Irradiance by photons at the points."""
        points = self.of(path)
        photons.gather(points, points["irradiance"], path.projection)
        if self._needs.caustics:
            own = {
                name.removeprefix(CAUSTIC): stream
                for name, stream in points.items()
                if name.startswith(CAUSTIC)
            }
            photons.gather_caustics(points | own, own["irradiance"], path.projection)

    @property
    def _most_bounces(self) -> int:
        """Of a path."""
        return self._needs.chain_depth + self._needs.transparent_depth

    def scatter(self, path: Path) -> Path | None:
        """Send secondary rays from the points, unless that was done; None if there are no more."""
        if not path.is_scattered:
            path.onward, path.is_scattered = self._scattered(path), True
        return path.onward

    def _scattered(self, path: Path) -> Path | None:
        if not self._scatter or path.depth == self._most_bounces:
            return None
        to = path.at
        if self._together > 1:
            to = self._places.of((path.depth + 1) % self._together, len(path.passes))
        count = self._count_scattered(path, to)
        onward = path.sent_on(to, count)
        if self._compaction and count:
            self._compaction.compact(onward, count.wait())
        pairs = onward.at.rays()
        onward.throughput = onward.arriving = pairs["throughput"].front
        onward.carried = {name: pairs[name].front for name in FIRST if name in pairs}
        if self._together > 1:
            onward.carried["pixel"] = self.of(path)["pixel"]
        return onward

    def _count_scattered(self, path: Path, to: PathStreams) -> Count | None:
        """Scatter, follow what goes below surfaces, and count the rays that go on; None: some are
        taken to.

        A GPU would wait while it is asked how many there are: it is not before the first bounce
        that sent none in a pass before.
        """
        assert self._scatter
        pairs, last = to.rays(), self._walk or self._scatter
        draw, streams = self._draw(path), {**self.of(path), "throughput": path.throughput}
        if self._walk:  # what goes on is known after that
            launch(self._scatter, streams | _next(pairs), self._tables, draw)
            _swap(pairs)
            pairs = {name: pairs[name] for name in WALKED}
            streams |= {name: pair.front for name, pair in pairs.items()}
        streams |= _next(pairs)
        count = None
        if self._tally:
            if path.depth == 0:
                self._tally.clear()
            launch_and_tally(last, streams, self._tables, draw, into=self._tally)
        else:
            count = launch_and_count(last, streams, self._tables, draw)
        _swap(pairs)
        if not self._tally or path.depth < self._ended.get(path.region, 0):
            return count
        return Count(partial(self._sent_last, path.region, self._tally.ask()))

    def _sent_last(self, region: Region, reading: Reading) -> int:
        """How many rays the last bounce sent; waits for the device."""
        sent = reading.numbers()
        if 0 in sent or len(sent) == self._most_bounces:
            ended = sent.index(0) if 0 in sent else len(sent)
            self._ended[region] = min(ended, self._ended.get(region, ended))
        return sent[-1]

    def launches(self) -> dict[str, int]:
        """How often each kernel has run."""
        counts = self._direct_light.launches() if self._direct_light else {}
        for kernel in self._kernels():
            counts[kernel.stem] = counts.get(kernel.stem, 0) + kernel.launches
        return counts

    def release(self) -> None:
        """Free streams and kernels."""
        self._places.release()
        if self._tally:
            self._tally.release()
        if self._compaction:
            self._compaction.release()
        for kernel in self._kernels():
            kernel.release()
        if self._direct_light:
            self._direct_light.release()

    def _kernels(self) -> list[Kernel]:
        known = (
            self.camera.kernel,
            *self._tracers,
            self._shade,
            self._surface_emission,
            self._emitted,
        )
        known += self._flight, self._scatter, self._walk, self._cuts, self._coverage
        return [kernel for kernel in known if kernel]

    def of(self, path: Path) -> dict[str, Stream]:
        """What there is of a path."""
        rays = {name: path.at.pairs[name].front for name in ("origin", "direction")}
        return {**path.at.ones, **rays, **path.carried}

    def _find_cuts(self, path: Path, radii: Radii) -> None:
        """Where each point's disc ends at what stands on its surface. Without a kernel nothing
        is cut off: the stream was made clear."""
        if kernel := self._cuts:
            names = "place", "facing", "diffuse", "cuts"
            kernel.run(
                {name: path.at.ones[name] for name in names},
                self._tables.of(kernel) | radii.tables(kernel),
                radii.uniforms,
            )

    def _find_coverage(self, path: Path, radii: Radii) -> Stream:
        """The share of the filter on each point's own surface and within its cuts."""
        kernel = self._coverage
        if kernel is None:
            return path.at.unit_coverage
        draw = self._draw(path) | probes_of(path.passes)
        draw = {n: value for n, value in draw.items() if n in kernel.uniforms}
        points = self.of(path)
        kernel.run(
            {name: points[name] for name in ("pixel", *POINT, "cuts", "coverage", "tilt")},
            self._tables.of(kernel) | radii.tables(kernel),
            draw | radii.uniforms,
        )
        return path.at.ones["coverage"]

    def _draw(self, path: Path) -> dict[str, Any]:
        """What random numbers of a pixel depend on, and which lights there are."""
        return {
            "seed": self._settings.seed,
            "pass_index": of_parts(path.passes),
            "depth": path.depth,
            "chain_depth": self._needs.chain_depth,
            "transparent_depth": self._needs.transparent_depth,
            "light_count": len(self._tables.lights),
            "seen_lights": self._tables.seen_lights,
            "asked_lights": len(self._tables.asked.lights),
            "light_leaves": self._tables.light_leaves,
            "world_light": self._tables.world_light,
            "world_rays": self._tables.world_rays,
            "lamps": len(self._tables.emitters),
            "frame_size": (self._settings.width, self._settings.height),
            **media_values(self._settings, self._tables),
            **self.footprint,
        }


def _next(pairs: Mapping[str, PingPong]) -> dict[str, Stream]:
    """What of a path is written for the next bounce."""
    return {f"next_{name}": pair.back for name, pair in pairs.items()}


def _swap(pairs: Mapping[str, PingPong]) -> None:
    for pair in pairs.values():
        pair.swap()
