# SPDX-License-Identifier: GPL-3.0-or-later
"""When a render is over: at its passes, its time limit or its error, whichever comes first."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

from ..film.film import FOUR, PAIR, PASSES_FOR_FOURS
from ..settings import Settings

# Error falls with the root of the passes at best: the next look comes after this share of the
# passes that are then still to go, but after no fewer than a sixteenth more than there are.
SHARE_TO_NEXT_LOOK = 0.75
LEAST_GROWTH = 1.0 / 16.0
# [s] that passes together may take: who stops a render, or looks, waits for them, and a driver ends
# a program that holds a GPU for longer than two.
PATIENCE = 0.25


@dataclass
class Stops:
    """Says after each pass whether it was the last one.

    The error is looked at after numbers of passes that depend on the picture alone, so that the
    same seed gives the same picture.
    """

    settings: Settings
    expected: int = field(init=False)  # passes until then, as far as the error tells
    _next_look: int = field(init=False)
    _last: tuple[int, float] = (0, 0.0)  # passes and seconds when it was asked
    _each: float = math.inf  # [s] a pass, of those rendered last

    def __post_init__(self) -> None:
        self.expected = self.settings.passes
        self._next_look = _whole_batches(self.settings.min_passes)

    def reached(self, passes: int, seconds: float, error: Callable[[], float]) -> str:
        """Return "passes", "time" or "error" when that ends the render, "" if it goes on."""
        settings, before = self.settings, self._last
        self._last = passes, seconds
        if passes > before[0]:
            self._each = (seconds - before[1]) / (passes - before[0])
        if settings.noise_threshold > 0 and passes >= self._next_look:
            excess = error() / settings.noise_threshold
            if excess <= 1:
                return "error"
            wanted = passes * (min(excess**2, 1e6) if math.isfinite(excess) else 2.0)
            self.expected = min(settings.passes, math.ceil(wanted))
            further = max(LEAST_GROWTH * passes, SHARE_TO_NEXT_LOOK * (wanted - passes))
            self._next_look = _whole_batches(passes + math.ceil(min(passes, further)))
        if passes >= settings.passes:
            return "passes"
        if 0 < settings.time_limit < seconds:
            return "time"
        return ""

    def most_together(self) -> int:
        """How many passes may be rendered next before this is to be asked again: none beyond the
        next look at the error or what ends the render, and not for long."""
        settings, (passes, seconds) = self.settings, self._last
        most = settings.passes - passes
        if settings.noise_threshold > 0:
            most = min(most, self._next_look - passes)
        time = min(PATIENCE, settings.time_limit - seconds) if settings.time_limit else PATIENCE
        in_time = math.frexp(max(1.0, time / max(self._each, 1e-6)))[1] - 1  # a power of two
        return max(1, min(most, 1 << in_time))


def _whole_batches(passes: int) -> int:
    """The next number of passes after which the variance is known anew."""
    batch = FOUR if passes > PASSES_FOR_FOURS else PAIR
    return -(-passes // batch) * batch
