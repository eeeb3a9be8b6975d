# SPDX-License-Identifier: GPL-3.0-or-later
"""Stops: passes, time and error, whichever comes first."""

from __future__ import annotations

import math
from typing import Any

import pytest

from addon.photon.jobs.stops import Stops
from addon.photon.settings import Settings


def run(
    error: Any = None, second: float = 0.0, together: int = 1, **settings: Any
) -> tuple[int, str, list[int]]:
    """After how many passes it ended and why, and when the error was looked at; `together`: so many
    passes at once, where it lets."""
    looks: list[int] = []
    stops, passes, reached = Stops(Settings(**settings)), 0, ""
    while not reached:
        passes += min(together, stops.most_together())

        def look(done: int = passes) -> float:
            looks.append(done)
            return float(error(done))

        reached = stops.reached(passes, passes * second, look)
    return passes, reached, looks


def test_passes() -> None:
    assert run(passes=7) == (7, "passes", [])


def test_time() -> None:
    assert run(passes=100, second=1.0, time_limit=3.5) == (4, "time", [])


def test_error() -> None:
    """Falling with the root of the passes: found at once, with few looks."""
    passes, reached, looks = run(lambda n: 0.2 / math.sqrt(n), passes=1 << 20, noise_threshold=0.01)
    assert reached == "error" and 400 <= passes <= 424
    assert looks[:3] == [8, 16, 32] and len(looks) < 10


def test_bias_that_stays() -> None:
    """An error that falls more slowly costs more looks, yet none is missed."""
    passes, reached, looks = run(
        lambda n: math.hypot(0.2 / math.sqrt(n), 0.03 * n ** (-1 / 6)),
        passes=1 << 20,
        noise_threshold=0.01,
    )
    assert reached == "error"
    before = looks[-2]
    assert math.hypot(0.2 / math.sqrt(before), 0.03 * before ** (-1 / 6)) > 0.01
    assert passes <= 1.07 * before + 4 and len(looks) < 40


@pytest.mark.parametrize(("least", "expected"), [(8, 8), (9, 10), (17, 20), (100, 100)])
def test_min_passes(least: int, expected: int) -> None:
    found = run(lambda n: 0.001, passes=200, noise_threshold=0.01, min_passes=least)
    assert found == (expected, "error", [expected])


def test_max_passes_before_min_passes() -> None:
    assert run(lambda n: 0.001, passes=3, noise_threshold=0.01) == (3, "passes", [])


@pytest.mark.parametrize("together", [3, 8])
def test_passes_together(together: int) -> None:
    """Its looks and its end are those of one by one."""
    errors = (
        lambda n: 0.2 / math.sqrt(n),
        lambda n: math.hypot(0.2 / math.sqrt(n), 0.03 * n ** (-1 / 6)),
        lambda n: 0.011,
    )
    for error in errors:
        for least in (8, 9, 17):
            settings = {"passes": 3000, "noise_threshold": 0.01, "min_passes": least}
            assert run(error, together=together, **settings) == run(error, **settings)


def test_passes_together_are_not_waited_for() -> None:
    """A second each: by the time limit none is rendered in vain. Of a hundredth each, a
    quarter of a second's worth."""
    assert run(passes=100, second=1.0, together=8, time_limit=3.5) == (4, "time", [])
    stops = Stops(Settings(passes=1000, time_limit=1.1))
    assert stops.most_together() == 1  # nobody knows yet what one takes
    for passes in (1, 2):
        stops.reached(passes, 0.01 * passes, lambda: 1.0)
    assert stops.most_together() == 16
    stops.reached(100, 1.0, lambda: 1.0)
    assert stops.most_together() == 8
    assert stops.reached(108, 1.2, lambda: 1.0) == "time"


@pytest.mark.parametrize("unknown", [math.inf, math.nan])
def test_unknown_error_goes_on(unknown: float) -> None:
    assert run(lambda n: unknown, passes=50, noise_threshold=0.01)[:2] == (50, "passes")


def test_time_before_error() -> None:
    found = run(lambda n: 1.0, passes=1 << 20, second=1.0, noise_threshold=0.01, time_limit=20.5)
    assert found[:2] == (21, "time")


def test_expected_passes() -> None:
    stops = Stops(Settings(passes=1000, noise_threshold=0.01))
    assert stops.expected == 1000
    stops.reached(8, 0.0, lambda: 0.05)
    assert stops.expected == 200
    stops.reached(16, 0.0, lambda: 0.5)
    assert stops.expected == 1000
