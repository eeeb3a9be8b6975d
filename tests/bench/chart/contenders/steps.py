# SPDX-License-Identifier: GPL-3.0-or-later
"""What a contender yields while it climbs its ladder of efforts."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple


class Seconds(NamedTuple):
    """Wall time, and processor time of all threads of this process."""

    wall: float = 0.0
    cpu: float = 0.0

    def __add__(self, other: Any) -> Seconds:
        return Seconds(self.wall + other.wall, self.cpu + other.cpu)

    def __sub__(self, other: Seconds) -> Seconds:
        return Seconds(self.wall - other.wall, self.cpu - other.cpu)


class Step(NamedTuple):
    """A picture after some effort."""

    effort: float  # passes, or samples a pixel
    seconds: Seconds  # of rendering; what is not in them is the engine's docstring to say
    look: Callable[[], Any]  # (h, w, 3) linear RGB, row 0 at the bottom; until the next step


def now() -> Seconds:
    return Seconds(time.perf_counter(), time.process_time())


class Budget:
    """Says whether the next, twice as costly rung of a ladder still fits into a wall time."""

    def __init__(self, seconds: float) -> None:
        self._end = time.perf_counter() + seconds
        self._rung = time.perf_counter()

    @property
    def left(self) -> float:
        """[s]"""
        return self._end - time.perf_counter()

    def begin(self) -> None:
        """Count the first rung from here: what came before happens once."""
        self._rung = time.perf_counter()

    def fits(self, times: float = 2.0) -> bool:
        """Whether the time since the last call, so many times, is left."""
        last, self._rung = self._rung, time.perf_counter()
        return times * (self._rung - last) <= self.left


def doubling() -> Iterator[int]:
    """1, 2, 4, ..."""
    return (2**k for k in itertools.count())
