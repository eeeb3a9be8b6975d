# SPDX-License-Identifier: GPL-3.0-or-later
"""Photon Stream as a contender, at its default settings, and with Denoise; "photons 65536" is with
so many a pass."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

from addon.photon.backends.backend import open_device
from addon.photon.photons.deposits import Deposits
from addon.photon.photons.kept import Kept
from addon.photon.photons.mapper import Mapper
from addon.photon.prepare import prepare
from addon.photon.scene import Scene
from addon.photon.settings import Settings
from addon.streams import Device
from tests.bench.host import CORES

from .steps import Budget, Seconds, Step, doubling, now

FEATURE_PASSES = 8
SET_UP = ("bvh", "programs")  # phases that no clock counts
METHODS = {"Photon Stream": "photons", "Photon Stream + Denoise": "denoised"}


class Late(Kept):
    """Launches the photons that tell the radii when all programs are made, and not before: what a
    GPU traces while the host makes programs no clock would count."""

    def __init__(self, device: Device) -> None:
        super().__init__(device, budget=0)
        self.begun: Seconds | None = None
        self._first: Callable[[], None] | None = None

    def start(self, *arguments: Any, **named: Any) -> None:
        launch = partial(super().start, *arguments, **named)
        if self.begun:
            launch()
        else:
            self._first = launch

    def finish(self, mapper: Mapper) -> Deposits:
        if self._first:
            self.begun, first, self._first = now(), self._first, None
            first()
        return super().finish(mapper)


class Engine:
    """Photon Stream with one scene loaded."""

    def __init__(self) -> None:
        self.device = open_device(Settings())
        self.about = f"Photon Stream, {self.device.name}"
        self.where: dict[str, float] = {}

    def load(self, snapshot: Path, blend: Path, size: int) -> None:
        """Read the scene, and render a pass so that the driver has compiled the programs."""
        self.scene, self.size = Scene.load(snapshot), size
        next(self.climb("photons", 0, Budget(0)))

    def features(self) -> dict[str, Any]:
        """Depth (of one pass) and Normal (a mean over passes) of what the camera sees."""
        settings = Settings(width=self.size, height=self.size, photons=1024)
        renderer = prepare(self.scene, settings, self.device)
        try:
            for _ in range(FEATURE_PASSES):
                renderer.render_pass()
            images = renderer.images()
            return {name: images[name] for name in ("Depth", "Normal")}
        finally:
            renderer.release()

    def climb(self, method: str, seed: int, budget: Budget) -> Iterator[Step]:
        """Pictures of 1, 2, 4, ... passes; the seconds are those of the passes and of the photons
        that tell the radii: not the BVH and the programs; with Denoise also that of making the
        picture. `where` holds them by phase."""
        _, _, photons = method.partition(" ")
        settings = Settings(
            width=self.size,
            height=self.size,
            seed=seed,
            passes=1 << 24,
            photons=int(photons) if photons else None,
            denoise=method == "denoised",
        )
        kept = Late(self.device)
        renderer = prepare(self.scene, settings, self.device, kept)
        budget.begin()
        seconds, done = now() - (kept.begun or now()), 0
        before = {phase: renderer.seconds[phase] for phase in SET_UP}
        # The first rays, and what tells where photons start, before those.
        sent = renderer.seconds["eye"] + renderer.seconds.get("aim", 0.0)
        seconds += Seconds(sent, sent * CORES)
        try:
            for effort in doubling():
                start = now()
                while done < effort:
                    done += renderer.render_passes(effort - done)
                self.device.ctx.finish()
                seconds += now() - start
                self.where = {
                    phase: spent - before.get(phase, 0.0)
                    for phase, spent in renderer.seconds.items()
                    if spent > before.get(phase, 0.0)
                }
                if settings.denoise:
                    start = now()
                    picture = renderer.images(["Combined"])["Combined"]
                    yield Step(done, seconds + (now() - start), lambda: picture[..., :3])  # noqa: B023
                else:
                    yield Step(done, seconds, lambda: renderer.images()["Combined"][..., :3])
                if not budget.fits():
                    return
        finally:
            renderer.release()
            kept.release()
