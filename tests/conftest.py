# SPDX-License-Identifier: GPL-3.0-or-later
"""Fixtures that every test shares."""

from __future__ import annotations

import signal
from collections.abc import Iterator

import pytest

from addon.photon.photons.aim import Aiming
from addon.photon.stage import find_needs
from addon.streams import Device

# The plugin of the stability table: its hooks and fixtures count as this file's.
from tests.stability.table import (  # noqa: F401
    measured,
    pytest_addoption,
    pytest_collection_modifyitems,
    pytest_configure,
    pytest_runtest_makereport,
    pytest_terminal_summary,
    thorough,
)


@pytest.fixture(scope="session", autouse=True)
def signals_reach_children() -> None:
    """Whoever runs tests in the background may ignore signals, and what tests start would, too."""
    for name in ("SIGINT", "SIGHUP"):
        number = getattr(signal, name, None)
        if number and signal.getsignal(number) == signal.SIG_IGN:
            signal.signal(number, lambda *_: None)  # of a program that is started: the default


@pytest.fixture(scope="session")
def shared_device() -> Iterator[Device]:
    """One OpenGL context for all tests: making one costs more than most tests."""
    device = Device()
    yield device
    device.release()


@pytest.fixture
def not_aimed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Photons start anywhere at lights, by flux: a test counts them, or their noise."""
    monkeypatch.setattr(Aiming, "_learn", lambda self: self._plain)
    monkeypatch.setattr(Aiming, "knows", lambda *_: True)


@pytest.fixture
def no_panes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Photons bring what comes straight through glass: a test counts them."""
    monkeypatch.setattr(find_needs, "has_panes", lambda *_: False)


@pytest.fixture
def device(shared_device: Device) -> Iterator[Device]:
    """The shared device; a test that leaves an OpenGL error behind fails."""
    shared_device.use()
    yield shared_device
    shared_device.check()


@pytest.fixture
def resident(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """Lists of compute programs stay on the device, as on a GPU."""
    if not device.has_compute:
        pytest.skip(f"{device.name} has no compute programs")
    monkeypatch.setattr(device, "prefers_native", False)
