# SPDX-License-Identifier: GPL-3.0-or-later
"""Time the passes of a scene for one way to render it."""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, get_args

from addon.photon.photons.mapper import Mapper, PhotonBatch
from addon.photon.prepare import prepare
from addon.photon.renderer import Renderer
from addon.photon.scene import Scene
from addon.photon.settings import Settings, SplatShape
from addon.streams import Device

from .counts import Work
from .launches import EYE, LONGEST_QUERY, PHOTONS, Timer, Watch
from .machine import WARM_UP

MOST_PASSES = 15
# A render does not wait after each pass: on a GPU so many are timed together, if they are short.
AT_ONCE, LONG = 8, 0.1  # [s]


class Clock:
    """What is left of a run's time."""

    def __init__(self, seconds: float) -> None:
        self._end = time.monotonic() + seconds

    @property
    def left(self) -> float:
        """[s]; below zero once it is over."""
        return self._end - time.monotonic()

    def part(self, share: float) -> Clock:
        """A clock for a share of what is left."""
        return Clock(max(self.left, 0.0) * share)


@dataclass(frozen=True)
class Way:
    """A way to render: the picture is the same."""

    backend: str
    estimator: str
    shape: str = ""  # of a splat

    def __str__(self) -> str:
        return " ".join(filter(None, (self.backend, self.estimator, self.shape)))

    def of(self, settings: Settings) -> Settings:
        """The settings that render in this way."""
        choice: dict[str, Any] = {"backend": self.backend}
        if self.estimator != "none":  # as a renderer without photons says
            choice["estimator"] = self.estimator
        if self.shape:
            choice["splat_shape"] = self.shape
        return replace(settings, **choice)

    @staticmethod
    def taken(renderer: Renderer) -> Way:
        """The way that a renderer has taken, chosen by itself or not."""
        shape = renderer.settings.splat_shape if renderer.estimator == "splat" else ""
        return Way(renderer.backend.name, renderer.estimator, shape)


def ways_of(device: Device, shapes: tuple[str, ...] = get_args(SplatShape)) -> list[Way]:
    """Every way that a device has, the fast ones first."""
    backends = [*["compute"] * device.has_compute, "fragment"]
    backends.insert(0 if device.is_software else len(backends), "native")
    gathers = [Way(backend, "gather") for backend in backends]
    return gathers + [Way(backend, "splat", shape) for backend in backends for shape in shapes]


class Predictor:
    """Guesses how long a pass takes from those of its kind: too long rather than too short."""

    def __init__(self) -> None:
        self._known: dict[Hashable, list[tuple[float, float]]] = {}

    def learn(self, kind: Hashable, work: float, seconds: float) -> None:
        """A pass of so much work took so long."""
        self._known.setdefault(kind, []).append((work, seconds))

    def seconds(self, kind: Hashable, work: float) -> float:
        """As the most similar pass known, in proportion if this one is larger; 0 if none is."""
        known = self._known.get(kind, [])
        if not known:
            return 0.0
        nearest, seconds = min(known, key=lambda item: abs(math.log(item[0] / work)))
        return seconds * max(1.0, work / nearest)


@dataclass
class Timing:
    """What passes of one way took."""

    way: Way
    seconds: float  # median of a pass
    spread: tuple[float, float]  # least and most
    passes: int
    start: float  # [s] building the renderer and its first pass
    phases: dict[str, float] = field(default_factory=dict)  # [s] a pass, as the renderer tells
    watch: Watch | None = None  # of one pass more
    splats: int = 0  # photons that landed where they count, in the last pass


def steady(settings: Settings) -> Settings:
    """The same for any number of passes, each as long as the first."""
    return replace(settings, radius_decay=1.0, passes=1 << 20)


def time_way(
    scene: Scene,
    settings: Settings,
    device: Device,
    seconds: float,
    timer: Timer | None = None,
) -> Timing:
    """Time passes until `seconds` are over, one at least, after some to warm up.

    With a timer, the kernels of one pass more are timed.
    """
    before = time.perf_counter()
    renderer = prepare(scene, steady(settings), device)
    try:
        renderer.render_pass()
        device.ctx.finish()
        start = time.perf_counter() - before
        warmed = time.perf_counter() + (0.0 if device.is_software else WARM_UP)
        while time.perf_counter() < warmed:
            _pass(renderer)
        renderer.seconds.clear()
        times, passes, watch = [_pass(renderer)], 1, None
        at_once = 1 if device.is_software else max(1, min(AT_ONCE, int(LONG / times[0])))
        if at_once > 1:
            times.clear()
        while not times or (len(times) < MOST_PASSES and sum(times) * at_once < seconds):
            times.append(_pass(renderer, at_once))
            passes += at_once
        phases = {name: spent / passes for name, spent in renderer.seconds.items()}
        if timer:
            watch = _watched_pass(renderer, timer, times[-1])
        mapper = renderer.photons.mapper if renderer.photons else None
        return Timing(
            Way.taken(renderer),
            statistics.median(times),
            (min(times), max(times)),
            passes,
            start,
            phases,
            watch,
            _landed(mapper, renderer.settings) if mapper else 0,
        )
    finally:
        renderer.release()


def compare(
    scene: Scene, settings: Settings, device: Device, ways: Sequence[Way], seconds: float
) -> list[float]:
    """Medians of ways whose passes take turns: what else the machine does meets all alike."""
    renderers = [prepare(scene, steady(way.of(settings)), device) for way in ways]
    times: list[list[float]] = [[] for _ in ways]
    begun = time.perf_counter()
    try:
        for renderer in renderers:
            _pass(renderer)
        while not times[0] or time.perf_counter() - begun < seconds:
            for renderer, own in zip(renderers, times, strict=True):
                own.append(_pass(renderer))
    finally:
        for renderer in renderers:
            renderer.release()
    return [statistics.median(own) for own in times]


def _landed(mapper: Mapper, settings: Settings) -> int:
    """How many of pass 0's photons land."""
    mapper.start(PhotonBatch(0, settings.photons_a_pass))
    return mapper.finish().count


def _pass(renderer: Renderer, count: int = 1) -> float:
    """Seconds of each of the next passes."""
    before = time.perf_counter()
    for _ in range(count):
        renderer.render_pass()
    renderer.device.ctx.finish()
    return (time.perf_counter() - before) / count


def _watched_pass(renderer: Renderer, timer: Timer, expected: float) -> Watch:
    """The kernels of the next pass, which is not among those that the renderer tells of."""
    watch = Watch(timer, waits=renderer.device.is_software or expected > LONGEST_QUERY)
    told = dict(renderer.seconds)
    with watch.watching():
        watch.wall = _pass(renderer)
    renderer.seconds.clear()
    renderer.seconds.update(told)
    return watch


@dataclass(frozen=True)
class Rates:
    """What a way does in a second; NaN where it has no kernel for that alone."""

    paths: float  # photons, from light to end, a second of the photon pass
    photon_rays: float  # a second of the kernel that traces
    eye_rays: float  # of eye, mirror and shadow rays, of the kernels that trace these
    pairs: float  # a photon and a visible point that it adds to, a second of the estimator
    overhead: float  # [s] a pass that no kernel runs


def rates_of(timing: Timing, work: Work) -> Rates:
    """A timing's rates; `timing.watch` must be there."""
    watch = timing.watch
    assert watch
    splats = timing.way.estimator == "splat"
    estimator = watch.of("splat" if splats else "gather", EYE).seconds
    pairs = work.splat_pairs if splats else work.gather_pairs
    # A watch that waits makes passes longer; its own wall time is what its kernels are part of.
    tracers = sum(watch.of(stem, EYE).seconds for stem in ("tracer", "direct"))
    wall = watch.wall if watch.waits else timing.seconds
    return Rates(
        _ratio(work.photons, timing.phases.get("photons", 0.0)),
        _ratio(work.rays[PHOTONS], watch.of("tracer", PHOTONS).seconds),
        _ratio(work.rays[EYE], tracers),
        _ratio(pairs, estimator),
        max(0.0, wall - watch.seconds),
    )


def _ratio(count: float, seconds: float) -> float:
    return count / seconds if seconds > 0 else math.nan
