# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders by a RendererProcess, for tests of it."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from addon.photon.jobs.process import Progress, RendererProcess
from addon.photon.settings import Settings
from tests.scenes import cornell

SMALL = Settings(width=24, height=16, photons=1000, passes=3)
LONG = replace(SMALL, passes=1 << 20)
HUGE = replace(LONG, photons=1 << 22)  # one pass takes seconds
linux = pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")


def finish(process: RendererProcess, settings: Settings = SMALL) -> Progress:
    """Render to the end; the last event."""
    *_, last = process.render(cornell(), settings)
    assert last.done and last.images is not None
    assert np.isfinite(last.images["Combined"]).all() and last.images["Direct"].mean() > 0
    return last


def start(process: RendererProcess, settings: Settings) -> Any:
    """A render under way: the child has made its programs."""
    events = process.render(cornell(), settings)
    for event in events:
        if event.phase != "Starting":
            return events
    raise AssertionError("the render is over")


def alive(pid: int) -> bool:
    """Whether a process runs; one that only waits for its parent's word doesn't."""
    try:
        stat = Path(f"/proc/{pid}/stat").read_text()
    except (FileNotFoundError, ProcessLookupError):
        return False
    return stat.rpartition(")")[2].split()[0] not in "ZX"


def wait_for(condition: Callable[[], bool], seconds: float) -> float:
    """Seconds until the condition held; fails if it did not in time."""
    start = time.monotonic()
    while not condition():
        assert time.monotonic() - start < seconds, f"not within {seconds} s"
        time.sleep(0.02)
    return time.monotonic() - start
