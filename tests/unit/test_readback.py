# SPDX-License-Identifier: GPL-3.0-or-later
"""Readback: numbers as they were when asked for."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from addon.photon.photons.deposits import MOST_APPENDS
from addon.photon.photons.device_radii import SAMPLED
from addon.streams import Device, StreamError, Tally, readback
from addon.streams.readback import SLOT, SLOTS, Readback


@pytest.fixture(params=["fences", "copies alone"])
def reads(
    request: pytest.FixtureRequest, device: Device, monkeypatch: pytest.MonkeyPatch
) -> Iterator[Readback]:
    """By fences, and as where OpenGL 4.5 is missing."""
    if request.param == "copies alone":
        monkeypatch.setattr(readback, "_functions", lambda: None)
    elif device.ctx.version_code < 450:
        pytest.skip(f"{device.name} has no OpenGL 4.5")
    made = Readback(device.ctx)
    yield made
    made.release()


def test_numbers_are_those_of_the_time(device: Device, reads: Readback) -> None:
    """Whatever is written later, and in whichever order they are read."""
    buffer = device.ctx.buffer(reserve=16)
    asked = []
    for k in range(5):
        buffer.write(np.arange(k, k + 4, dtype=np.uint32))
        asked.append(reads.ask(buffer, 3))
    for k in (3, 0, 4, 1, 2, 3):
        assert asked[k].numbers() == (k, k + 1, k + 2)
    buffer.release()


def test_more_than_there_are_slots(device: Device, reads: Readback) -> None:
    """The oldest are read when their slot is wanted."""
    buffer = device.ctx.buffer(reserve=SLOT)
    asked = []
    for k in range(3 * SLOTS + 1):
        buffer.write(np.full(SLOT // 4, 7 * k, np.uint32))
        asked.append(reads.ask(buffer, SLOT // 4))
    for k, reading in enumerate(asked):
        assert set(reading.numbers()) == {7 * k}
    buffer.release()


def test_nothing_is_asked_for(device: Device, reads: Readback) -> None:
    buffer = device.ctx.buffer(reserve=16)
    assert reads.ask(buffer, 0).numbers() == ()
    buffer.release()


def test_what_is_asked_for_fits() -> None:
    """The photons that tell the median radius, where each append ends, and a tally's runs."""
    assert 4 * (1 + max(SAMPLED, MOST_APPENDS)) <= SLOT


def test_too_much_at_once(device: Device, reads: Readback) -> None:
    buffer = device.ctx.buffer(reserve=2 * SLOT)
    with pytest.raises(StreamError, match="more than can be asked for"):
        reads.ask(buffer, SLOT // 4 + 1)
    buffer.release()


def test_full_tally(device: Device) -> None:
    tally = Tally(device, 2)
    assert [tally.next_slot(), tally.next_slot()] == [0, 1]
    with pytest.raises(StreamError, match="2 runs is full"):
        tally.next_slot()
    tally.clear()
    assert tally.next_slot() == 0 and tally.ask().numbers() == (0,)
    tally.release()
