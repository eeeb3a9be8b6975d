# SPDX-License-Identifier: GPL-3.0-or-later
"""A renderer of a scene that needs several renders (scene/takes.py), pass by pass."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from .film.composite import composite, group_name
from .film.error import DARK, Error, relative_squares
from .film.resolver import Picture
from .renderer import ALL_IMAGES, Parts, Renderer
from .scene import Scene
from .scene.takes import Take
from .settings import Settings

Number = TypeVar("Number", int, float)
# What is counted for all takes together.
COUNTED = ("photons", "photons_a_pass", "unfinished_photons", "dropped_photons")


def settings_of(take: Take, settings: Settings) -> Settings:
    """Those that a take is rendered with: where only catchers are shown nothing is behind them, and
    what is behind them needs no photons."""
    if take.part in ("caught", "alone"):
        return replace(settings, transparent=True)
    return replace(settings, photons=0) if take.part == "behind" else settings


class TakesRenderer(Renderer):
    """Renders a pass of each take at a time, and puts their pictures together.

    Every take has photons, streams and a film of its own. What else is asked is answered by the
    first one.
    """

    def __init__(
        self,
        scene: Scene,
        settings: Settings,
        takes: Sequence[Take],
        parts: Sequence[Parts],
        warnings: tuple[str, ...],
    ) -> None:
        super().__init__(scene, settings, parts[0], warnings)
        self._takes = takes
        self._of_takes = [
            Renderer(take.scene, settings_of(take, settings), part, ())
            for take, part in zip(takes, parts, strict=True)
        ]

    def render_passes(self, most: int) -> int:
        """Add the next passes of every take to its film; how many."""
        count = min(len(renderer.passes_together(most)) for renderer in self._of_takes)
        after = self.film.passes + count
        for renderer in self._of_takes:
            while renderer.film.passes < after:
                renderer._render_next(after - renderer.film.passes, most)
        return count

    def images(self, wanted: Collection[str] | None = None, is_preview: bool = False) -> Picture:
        """As Renderer.images, and the light groups'; each take is denoised on its own."""
        settings, groups = self.settings, self.scene.light_groups
        if wanted is None:
            wanted = {*ALL_IMAGES, *map(group_name, groups)}
        own = {"Combined", "Error", *wanted}.intersection(ALL_IMAGES)
        found = [renderer.images(own, is_preview) for renderer in self._of_takes]
        said = [x for renderer in self._of_takes for x in renderer.warnings]
        self.warnings += tuple(dict.fromkeys(x for x in said if x not in self.warnings))
        shots = list(zip(self._takes, found, strict=True))
        images = composite(shots, groups, settings.transparent)
        errors = [renderer.error() for renderer in self._of_takes]
        error = _error_of(images, errors, settings.exposure)
        self._telling = self.film.passes, lambda: error
        return {name: image for name, image in images.items() if name in wanted}

    @property
    def seconds(self) -> dict[str, float]:
        """By phase, of all takes."""
        return _summed(renderer.seconds for renderer in self._of_takes)

    def info(self) -> dict[str, Any]:
        """As Renderer.info; photons are those of all takes."""
        infos = [renderer.info() for renderer in self._of_takes]
        counts = {name: sum(x[name] for x in infos) for name in COUNTED}
        return super().info() | counts | {"denoiser": infos[0]["denoiser"]}

    def launches(self) -> dict[str, int]:
        """How often each kernel has run, for all takes."""
        return _summed(renderer.launches() for renderer in self._of_takes)

    def _let_go(self) -> None:
        for renderer in self._of_takes:
            renderer._let_go()


def _summed(counts: Iterable[dict[str, Number]]) -> dict[str, Number]:
    total: dict[str, Number] = {}
    for of_one in counts:
        for name, count in of_one.items():
            total[name] = total[name] + count if name in total else count
    return total


def _error_of(
    images: dict[str, NDArray[np.float32]], errors: Sequence[Error], exposure: float
) -> Error:
    """Of the picture, whose noise and bias are to each other as those of all takes are."""
    image, combined = images["Error"], images["Combined"][..., :3].astype(np.float64)
    if not np.isfinite(image).all():
        return Error(math.inf, math.inf, image)
    brightness = np.abs(combined.mean(axis=-1))
    floor = DARK * (float(brightness.mean()) or 1.0)
    total = math.sqrt(float(relative_squares(image[..., 0], brightness, floor).mean()))
    noise = math.hypot(*(error.noise for error in errors))
    bias = math.hypot(*(error.bias for error in errors))
    scale = total / (math.hypot(noise, bias) or 1.0)
    return Error(scale * noise, scale * bias, image / np.float32(exposure))
