# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether the renderer's own choice of backend and estimator is the fastest: a grid of renders."""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, get_args

import numpy as np

from addon.photon.prepare import photons_per_disc
from addon.photon.scene import Scene
from addon.photon.settings import Settings, SplatShape
from addon.photon.stage.geometry import frame_of
from addon.streams import Device

from .passes import Clock, Predictor, Way, compare, time_way, ways_of
from .report import Report, duration

COMBINATIONS = 32
LOSS = 0.10  # what the renderer may lose by its choice
RADII = (0.0, 0.02, 0.1)  # of half the scene; 0: automatic
PHOTONS = {False: (4096, 65536, 524288), True: (4096, 16384, 65536)}  # on software OpenGL
SIZES = {False: (128, 512, 1024), True: (64, 128, 256)}  # [px] a side
_SLICE = 0.25  # [s] of passes that a way gets
# A pass that would take longer [s], and so many times what another way took, is not begun.
_LONGEST, _HOPELESS = 4.0, 5.0
# Losses above are measured again, with so many [s] of passes that take turns.
_TWICE, _AGAIN = 0.05, 1.0


@dataclass(frozen=True)
class Combination:
    """A picture to render."""

    scene: str
    photons: int
    radius: float  # of half the scene; 0: automatic
    size: int  # [px] a side

    def kind(self, way: Way) -> tuple[Way, str, bool]:
        """Renders of a kind take as long as their work says: scenes differ in their mirrors, and
        automatic radii in their largest, which splats pay for."""
        return way, self.scene, self.radius == 0

    @property
    def work(self) -> float:
        """About in proportion to a pass's time: photons, pixels, and pairs of them."""
        disc = photons_per_disc(self.photons)
        if self.radius:
            disc = self.photons * self.radius**2 * math.pi / 24  # over the walls of a cube
        return 64.0 * self.photons + self.size**2 * (64.0 + disc)


@dataclass
class Choice:
    """What each way took for a combination."""

    combination: Combination
    chosen: Way
    seconds: dict[Way, float] = field(default_factory=dict)
    skipped: list[Way] = field(default_factory=list)

    @property
    def best(self) -> Way:
        """The fastest."""
        return min(self.seconds, key=lambda way: self.seconds[way])

    @property
    def loss(self) -> float:
        """How much longer the renderer's own choice takes, of the fastest's time."""
        return self.seconds[self.chosen] / self.seconds[self.best] - 1.0


def grid(scenes: Sequence[str], software: bool, count: int) -> list[Combination]:
    """So many combinations, the same each time; the shortest first.

    Each is drawn among those whose scene, photons, radius and size were drawn least before.
    """
    lists = (scenes, PHOTONS[software], RADII, SIZES[software])
    every = [Combination(*each) for each in itertools.product(*lists)]
    left = [every[i] for i in np.random.default_rng(0).permutation(len(every))]
    used: Counter[tuple[str, Any]] = Counter()
    drawn: list[Combination] = []
    for _ in range(min(count, len(every))):
        each = min(left, key=lambda each: sum(used[value] for value in vars(each).items()))
        left.remove(each)
        used.update(vars(each).items())
        drawn.append(each)
    return sorted(drawn, key=lambda each: each.work)


def measure_choices(
    report: Report,
    device: Device,
    scenes: Mapping[str, Scene],
    clock: Clock,
    count: int = COMBINATIONS,
    shapes: tuple[str, ...] = ("quad",),
) -> None:
    """Render the grid with every backend and estimator that the device has."""
    combinations = grid([*scenes], device.is_software, count)
    table = report.table(
        f"Whether `auto` is the fastest: {len(combinations)} combinations",
        "scene, photons, radius, size", "fastest", "pass", "auto chooses", "pass", "loss",
    )  # fmt: skip
    predictor, choices = Predictor(), []
    for number, each in enumerate(combinations):
        ways = ways_of(device, shapes)
        needed = 3 * sum(predictor.seconds(each.kind(way), each.work) for way in ways)
        if clock.left <= 0 or clock.left < min(needed, 2 * _LONGEST * len(ways)):
            table.note(f"the last {len(combinations) - number} not measured: no time left")
            break
        choice = _measure(each, scenes[each.scene], device, predictor, ways)
        choices.append(choice)
        radius = f"{each.radius:g}" if each.radius else "automatic"
        table.add(
            f"{each.scene}, {each.photons}, {radius}, {each.size}x{each.size}",
            choice.best,
            duration(choice.seconds[choice.best]),
            choice.chosen,
            duration(choice.seconds[choice.chosen]),
            f"{choice.loss:.0%}",
        )
        if choice.skipped:
            skipped = ", ".join(map(str, choice.skipped))
            table.note(f"row {number + 1} without {skipped}: predicted to take too long")
        report.data["choices"] = [choice_data(each) for each in choices]
    for line in verdict(choices):
        table.note(line)
    table.note("radius: of half the scene's largest extent; splat shapes: " + ", ".join(shapes))


def verdict(choices: Sequence[Choice]) -> list[str]:
    """Whether the choice is never much slower than the best by hand."""
    if not choices:
        return []
    worst = max(choices, key=lambda choice: choice.loss)
    slow = [choice for choice in choices if choice.loss > LOSS]
    wins = sum(choice.chosen == choice.best for choice in choices)
    each = worst.combination
    return [
        f"`auto` takes the fastest way in {wins} of {len(choices)} combinations and is more than"
        f" {LOSS:.0%} slower in {len(slow)}; worst: {worst.loss:.0%} ({each.scene},"
        f" {each.photons} photons, radius {each.radius:g}, {each.size} px: {worst.chosen} instead"
        f" of {worst.best})"
    ]


def choice_data(choice: Choice) -> dict[str, Any]:
    """A choice as JSON."""
    return vars(choice.combination) | {
        "seconds": {str(way): seconds for way, seconds in choice.seconds.items()},
        "skipped": [str(way) for way in choice.skipped],
        "chosen": str(choice.chosen),
        "best": str(choice.best),
        "loss": choice.loss,
    }


def _measure(
    each: Combination,
    scene: Scene,
    device: Device,
    predictor: Predictor,
    ways: Sequence[Way],
) -> Choice:
    settings = Settings(
        width=each.size,
        height=each.size,
        photons=each.photons,
        radius=each.radius * frame_of(scene).scale,
    )
    timing = time_way(scene, settings, device, _SLICE)
    choice = Choice(each, timing.way, {timing.way: timing.seconds})
    predictor.learn(each.kind(timing.way), each.work, timing.seconds)
    for way in ways:
        if way in choice.seconds:
            continue
        least = min(choice.seconds.values())
        if predictor.seconds(each.kind(way), each.work) > max(_LONGEST, _HOPELESS * least):
            choice.skipped.append(way)
            continue
        timing = time_way(scene, way.of(settings), device, min(_SLICE, 8 * least))
        choice.seconds.setdefault(timing.way, timing.seconds)
        predictor.learn(each.kind(way), each.work, timing.seconds)
    if choice.loss > _TWICE:  # by chance?
        pair = (choice.chosen, choice.best)
        again = compare(scene, settings, device, pair, _AGAIN)
        choice.seconds |= dict(zip(pair, again, strict=True))
    return choice


ALL_SHAPES: tuple[str, ...] = get_args(SplatShape)
