# SPDX-License-Identifier: GPL-3.0-or-later
"""A renderer process that is cancelled, or killed, at any moment: what its parent is left with."""

from __future__ import annotations

import os
import signal
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from addon.photon.errors import RenderError
from addon.photon.jobs.process import Images, Progress, RendererProcess
from addon.photon.settings import Settings
from tests.scenes import cornell
from tests.stability.table import Measured

SMALL = Settings(width=24, height=16, photons=1000, passes=2)
PROMISED = 0.2  # [s] in which closing a render returns
OTHERS = 0.5  # [s] for which other programs may keep the cores from us, once in a hundred times


def under_way(process: RendererProcess, settings: Settings, seconds: float) -> Iterator[Progress]:
    """A render, so many seconds after it was asked for."""
    moment = time.monotonic() + seconds
    events = process.render(cornell(), settings)
    for _ in events:
        if time.monotonic() >= moment:
            break
    return events


def finish(process: RendererProcess, backend: str) -> Images:
    """A render to its end."""
    *_, last = process.render(cornell(), replace(SMALL, backend=backend))
    assert last.done and last.images
    return last.images


def same(one: Images, other: Images) -> bool:
    return all(np.array_equal(other[name], image) for name, image in one.items())


@pytest.mark.stability(48)
@pytest.mark.thorough  # tests/process/test_cancelling.py cancels at random moments, too
@pytest.mark.parametrize("backend", ["native", "fragment"])
def test_cancel(measured: Measured, thorough: bool, backend: str) -> None:
    """At random moments: start, scene, programs, passes that are short, or take seconds."""
    rng = np.random.default_rng(48)
    process = RendererProcess()
    expected = finish(process, backend)
    shared: set[Path | None] = set()
    times, killed = [], 0
    for number in range(500 if thorough else 12):
        short = replace(SMALL, backend=backend, passes=1 << 20)
        settings = short if number % 5 else replace(short, photons=1 << 22)
        events = under_way(process, settings, rng.exponential(0.1))
        before = process.pid
        shared.add(process._folder)
        begun = time.monotonic()
        events.close()
        times.append(time.monotonic() - begun)
        killed += process.pid != before
        if number % 7 == 0:
            assert same(finish(process, backend), expected)
    process.close()
    assert not any(folder and folder.exists() for folder in shared)
    times.sort()
    print(f"{backend}: {len(times)} cancelled, {killed} by ending the process;", times[-5:])
    measured(f"{backend}, median of {len(times)}", times[len(times) // 2], " s")
    late = sum(seconds > PROMISED for seconds in times)
    assert measured("worst", times[-1], " s") <= PROMISED + OTHERS
    assert measured(f"later than {PROMISED} s", late) <= max(1, len(times) // 100)


@pytest.mark.stability(52)
@pytest.mark.skipif(sys.platform == "win32", reason="no SIGKILL")
@pytest.mark.thorough("short")
@pytest.mark.parametrize("photons", [1000, 1 << 22], ids=["short passes", "long passes"])
def test_killed(measured: Measured, thorough: bool, photons: int) -> None:
    """At random moments: one error, which says so, and the next render is right."""
    rng = np.random.default_rng(52)
    process = RendererProcess()
    expected = finish(process, "auto")
    settings = replace(SMALL, photons=photons, passes=1 << 20)
    count, longest = 50 if thorough else 3, 0.0
    for _ in range(count):
        events = under_way(process, settings, rng.uniform(0.0, 0.5))
        assert process.pid and process._folder
        shared = process._folder
        os.kill(process.pid, signal.SIGKILL)
        begun = time.monotonic()
        with pytest.raises(RenderError, match="the renderer process ended by signal 9"):
            list(events)
        longest = max(longest, time.monotonic() - begun)
        assert process.pid is None and not shared.exists()
        assert same(finish(process, "auto"), expected)
    process.close()
    assert measured(f"of {count}, known after at most", longest, " s") <= 1.0 + OTHERS
