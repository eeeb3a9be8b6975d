# SPDX-License-Identifier: GPL-3.0-or-later
"""RendererProcess: a render that is left ends at once, and the next one works."""

from __future__ import annotations

import time

import numpy as np
import pytest

from addon.photon.jobs.process import RendererProcess
from tests.process.renders import HUGE, LONG, SMALL, finish, start
from tests.scenes import cornell


def test_cancel_at_random_moments(process: RendererProcess, thorough: bool) -> None:
    """Closing returns at once, and the next render works. At most 0.2 s, and what others take:
    beside other tests the slowest of ten tell of these."""
    rng = np.random.default_rng(12)
    times = []
    for number in range(10):
        events = process.render(cornell(), HUGE if number % 2 else LONG)
        moment = time.monotonic() + rng.uniform(0.0, 1.2)
        for _ in events:
            if time.monotonic() >= moment:
                break
        begun = time.monotonic()
        events.close()
        times.append(time.monotonic() - begun)
    print("cancelled in", " ".join(f"{t:.3f}" for t in times), "s")
    most, worst = (sorted(times)[-2], 0.5) if thorough else (sorted(times)[5], 2.0)
    assert most <= 0.25 and max(times) <= worst
    finish(process)


def test_cancel_small_passes_keeps_the_child(process: RendererProcess) -> None:
    events = start(process, LONG)
    pid = process.pid
    for _ in range(3):
        next(events)
    events.close()
    assert process.pid == pid
    finish(process)
    assert process.pid == pid


def test_cancel_before_anything_began(process: RendererProcess) -> None:
    events = process.render(cornell(), SMALL)
    next(events)
    events.close()
    process.render(cornell(), SMALL).close()
    assert process.pid is None
    finish(process)


def test_leaving_after_the_last_event_is_no_cancel(process: RendererProcess) -> None:
    finish(process)
    pid = process.pid
    for _ in range(3):
        for event in process.render(cornell(), SMALL):
            if event.done:
                break
        assert process.pid == pid
    finish(process)
    assert process.pid == pid


def test_forgotten_iterator_cancels(process: RendererProcess) -> None:
    events = start(process, LONG)
    del events
    finish(process)


def test_ctrl_c_cancels(process: RendererProcess) -> None:
    events = start(process, LONG)
    with pytest.raises(KeyboardInterrupt):
        events.throw(KeyboardInterrupt)
    finish(process)
