# SPDX-License-Identifier: GPL-3.0-or-later
"""How much a pass does, whoever does it: rays, and photon-pixel pairs. Counted, not timed."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import photon_stream_native as native
from numpy.typing import NDArray

from addon.photon.backends.native_kernels import NativeTracer
from addon.photon.kernels.direct import Direct, ShadowRays
from addon.photon.kernels.tracer import Tracer
from addon.photon.photons.photon_grid import PhotonGrid
from addon.photon.photons.photon_mapper import PhotonMapper
from addon.photon.photons.radius_field import Radii
from addon.photon.prepare import prepare
from addon.photon.renderer import Renderer
from addon.photon.scene import Scene
from addon.photon.settings import Settings
from addon.streams import Device, Stream

from .launches import EYE, PHOTONS, kernel_classes, replaced

# The pass whose work is counted. All do about the same, but the photons of pass 0 may be traced
# before it begins, for the radii.
WATCHED = 2
_CELLS = 64  # along the longest axis of the grid that pairs are counted with


@dataclass
class Work:
    """What one pass of a scene asks for."""

    photons: int  # emitted
    deposits: int = 0  # landed where they count: as many splats
    rays: dict[str, int] = field(default_factory=lambda: {PHOTONS: 0, EYE: 0})  # shadow rays: eye
    pairs: list[int] = field(default_factory=list)  # of the camera's points, then each mirror's

    @property
    def splat_pairs(self) -> int:
        """Those that splatting can reach."""
        return self.pairs[0] if self.pairs else 0

    @property
    def gather_pairs(self) -> int:
        """All of them."""
        return sum(self.pairs)


def count_work(scene: Scene, settings: Settings, device: Device) -> Work:
    """Count the work of pass WATCHED, by fragment programs, which run kernel by kernel, and the
    gather: every way does the same."""
    # A renderer's first pass is launched in part before anyone asks for it.
    settings = replace(settings, first_pass=WATCHED - 1, backend="fragment", estimator="gather")
    renderer = prepare(scene, settings, device)
    counter = _Counter(Work(settings.photons_a_pass), renderer)
    try:
        renderer.render_pass()
        with counter.counting():
            renderer.render_pass()
    finally:
        renderer.release()
    return counter.work


def count_pairs(
    place: NDArray[np.float32],
    facing: NDArray[np.float32],
    photons: NDArray[np.float32],
    deposits: NDArray[np.float32],
    radii: Radii,
) -> int:
    """Pairs of a visible point (place, facing: (h, w, 4)) and a photon (P, 4) that adds to it:
    within the point's radius, on its surface, and facing as it does, be it cut off or not.

    A gather by a constant filter of photons of flux 1 gives each point's count over pi r^2.
    """
    if len(photons) == 0:
        return 0
    unit = deposits.copy()
    unit[:, :3] = 1.0
    low, high = photons[:, :3].min(axis=0), photons[:, :3].max(axis=0)
    cell = max(float((high - low).max()) / _CELLS, radii.largest[0] / 4, 1e-6)
    cells = tuple(int(n) + 1 for n in (high - low) / cell)
    none, whole = np.zeros_like(place), np.ones_like(place)  # uncut, and covered
    discs = radii.field.on_host, radii.scales[0], "constant"
    photon_map = native.PhotonMap(photons, unit, tuple(map(float, low)), cell, cells)
    sums = photon_map.gather((place, facing, none, whole, none), *discs)
    at = radii.field.on_host.at(place.reshape(-1, 4), facing.reshape(-1, 4))
    radius = at.astype(np.float64) * radii.scales[0]
    return int(np.rint(sums[..., 0].ravel() * (math.pi * radius**2)).sum())


class _Counter:
    """Looks into the streams of a pass under way."""

    def __init__(self, work: Work, renderer: Renderer) -> None:
        self.work, self._renderer = work, renderer
        self._part = EYE
        self._photons: tuple[Any, Any] = np.zeros((2, 0, 4), np.float32)  # type: ignore[assignment]
        self._radii: Radii | None = None

    @contextmanager
    def counting(self) -> Iterator[None]:
        """Count what renders within."""
        patches: dict[tuple[Any, str], Callable[[Any], Any]] = {
            (kind, "_launch"): self._count_rays for kind in kernel_classes()
        }
        patches |= {
            (NativeTracer, "hits"): self._count_shadow_rays,
            (PhotonMapper, "start"): self._take_photons,
            (PhotonGrid, "prepare"): self._take_radii,
            (PhotonGrid, "estimate"): self._count_pairs,
        }
        with replaced(patches):
            yield

    def _count_rays(self, function: Any) -> Any:
        def run(kernel: Any, streams: Any, *args: Any, **kwargs: Any) -> Any:
            if kernel.stem == Tracer.stem:
                self._count_in(streams)
            if kernel.stem == Direct.stem:
                self.work.rays[self._part] += self._shadow_rays(streams, *args, **kwargs)
            return function(kernel, streams, *args, **kwargs)

        return run

    def _count_in(self, streams: Any) -> None:
        rays = streams["direction"].download()[..., :3].any(axis=-1)
        self.work.rays[self._part] += int(rays.sum())

    def _count_shadow_rays(self, function: Any) -> Any:
        def run(tracer: Any, streams: Any) -> Any:
            self._count_in(streams)
            return function(tracer, streams)

        return run

    def _shadow_rays(self, streams: Any, tables: Any, uniforms: Any, *_: Any) -> int:
        """How many Direct traces of these streams."""
        needs, device = self._renderer.needs, self._renderer.device
        aim = ShadowRays(device, "fragment", needs.direct_defines, made=needs.made)
        size = streams["place"].size
        aimed = {name: Stream(device, record, size) for name, record in aim.outputs.items()}
        points = {name: streams[name] for name in aim.inputs}
        own = {name: tables[name] for name in aim.tables}
        values = {name: value for name, value in uniforms.items() if name in aim.uniforms}
        rays = 0
        for number in range(1 - uniforms.get("world_rays", 1), needs.shadow_rays):
            aim.run(points | aimed, own, {**values, "number": number})
            rays += int(aimed["shadow_direction"].download()[..., :3].any(axis=-1).sum())
        for item in (*aimed.values(), aim):
            item.release()
        return rays

    def _as_photons(self, function: Any) -> Any:
        def run(*args: Any, **kwargs: Any) -> Any:
            self._part = PHOTONS
            try:
                return function(*args, **kwargs)
            finally:
                self._part = EYE

        return run

    def _take_photons(self, function: Any) -> Any:
        def run(mapper: Any, *args: Any) -> None:
            self._as_photons(function)(mapper, *args)
            self._photons = mapper.deposits.arrays()
            self.work.deposits = len(self._photons[0])

        return run

    def _take_radii(self, function: Any) -> Any:
        def run(grid: Any, deposits: Any, radii: Radii, *args: Any) -> None:
            self._radii = radii
            function(grid, deposits, radii, *args)

        return run

    def _count_pairs(self, function: Any) -> Any:
        def run(grid: Any, points: Any, *args: Any, **kwargs: Any) -> None:
            assert self._radii
            place, facing = points["place"].download(), points["facing"].download()
            self.work.pairs.append(count_pairs(place, facing, *self._photons, self._radii))
            function(grid, points, *args, **kwargs)

        return run
