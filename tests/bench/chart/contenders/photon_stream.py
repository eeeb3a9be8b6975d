# SPDX-License-Identifier: GPL-3.0-or-later
"""Photon Stream as a contender, at its default settings; "photons 65536" is with so many a pass."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from addon.photon.prepare import prepare
from addon.photon.renderer import Renderer
from addon.photon.scene import Scene
from addon.photon.settings import Settings
from addon.photon.stage.geometry import Mesh
from addon.photon.ways.way import open_device

from .steps import Budget, Step, doubling, now

FEATURE_PASSES = 8
METHODS = {"Photon Stream": "photons"}


class Clocked(Renderer):
    """Launches the photons that tell the radii when all programs are made, and not before: what a
    GPU traces while the host makes programs no clock would count."""

    def _start_pilot(self) -> None:
        pass

    def _start_first_pass(self, mesh: Mesh) -> None:
        self.device.ctx.finish()
        self._tick(self._phase)  # what is under way: making programs
        self.begun, self.phases_before = now(), dict(self.seconds)
        super()._start_pilot()
        super()._start_first_pass(mesh)


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
        that tell the radii: not the BVH and the programs. `where` holds them by phase."""
        _, _, photons = method.partition(" ")
        settings = Settings(
            width=self.size,
            height=self.size,
            seed=seed,
            passes=1 << 24,
            photons=int(photons) if photons else None,
        )
        renderer = Clocked(self.scene, settings, self.device)
        budget.begin()
        before = renderer.phases_before
        seconds, done = now() - renderer.begun, 0
        try:
            for effort in doubling():
                start = now()
                while done < effort:
                    renderer.render_pass()
                    done += 1
                self.device.ctx.finish()
                seconds += now() - start
                self.where = {
                    phase: spent - before.get(phase, 0.0)
                    for phase, spent in renderer.seconds.items()
                    if spent > before.get(phase, 0.0)
                }
                yield Step(done, seconds, lambda: renderer.images()["Combined"][..., :3])
                if not budget.fits():
                    return
        finally:
            renderer.release()
