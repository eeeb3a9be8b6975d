# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a render's time goes."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager


class Phases:
    """Seconds by phase, each counted once."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._phase: str | None = None
        self._ticked = 0.0

    @contextmanager
    def timed(self, phase: str) -> Iterator[None]:
        """Counts a block's seconds as the phase's, and not as those of the phase around it."""
        around, self._phase = self._phase, phase
        self._tick(around)
        try:
            yield
        finally:
            self._tick(phase)
            self._phase = around

    def _tick(self, phase: str | None) -> None:
        """Count the seconds since the last tick."""
        now = time.perf_counter()
        if phase:
            self.seconds[phase] = self.seconds.get(phase, 0.0) + now - self._ticked
        self._ticked = now
