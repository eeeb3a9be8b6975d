# SPDX-License-Identifier: GPL-3.0-or-later
"""Photon Stream as a contender, at its default settings."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from addon.photon.renderer import Renderer, open_device
from addon.photon.scene import Scene
from addon.photon.settings import Settings

from ...speed.launches import replaced
from .steps import Budget, Seconds, Step, doubling, now

FEATURE_PASSES = 8
METHODS = {"Photon Stream": "photons"}


def waiting(start: Any) -> Any:
    """Count photons that a GPU would trace while the host builds programs, which no one counts."""

    def run(renderer: Renderer) -> None:
        with renderer._timed("radius"):
            start(renderer)
            renderer.device.ctx.finish()

    return run


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
        renderer = Renderer(self.scene, settings, self.device)
        try:
            for _ in range(FEATURE_PASSES):
                renderer.render_pass()
            images = renderer.images()
            return {name: images[name] for name in ("Depth", "Normal")}
        finally:
            renderer.release()

    def climb(self, method: str, seed: int, budget: Budget) -> Iterator[Step]:
        """Pictures of 1, 2, 4, ... passes; the seconds are those of the passes and of the photons
        that tell the radii: not the BVH and the programs. `where` holds them by phase."""
        settings = Settings(width=self.size, height=self.size, seed=seed)
        with replaced({(Renderer, "_start_pilot"): waiting}):
            renderer = Renderer(self.scene, settings, self.device)
        budget.begin()
        radius = renderer.seconds["radius"]
        before = renderer.seconds | {"radius": 0.0}
        seconds, done = Seconds(radius, radius * (os.cpu_count() or 1)), 0
        try:
            for effort in doubling():
                while done < effort:
                    start = now()
                    renderer.render_pass()
                    self.device.ctx.finish()
                    seconds += now() - start
                    done += 1
                self.where = {
                    phase: spent - before.get(phase, 0.0)
                    for phase, spent in renderer.seconds.items()
                    if spent > before.get(phase, 0.0)
                }
                yield Step(done, seconds, renderer.images()["Combined"][..., :3])
                if not budget.fits():
                    return
        finally:
            renderer.release()
