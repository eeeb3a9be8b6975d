# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from addon.photon.photons.kept import Kept
from addon.streams import Device
from addon.streams.source import glsl_root
from tests.unit.glsl_files import use_root


@pytest.fixture
def root(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A GLSL root with nothing but what empties streams on a GPU."""
    fills = Path("kernels/fill_texture.glsl")
    (tmp_path / "glsl" / fills).parent.mkdir(parents=True)
    shutil.copy(glsl_root() / fills, tmp_path / "glsl" / fills)
    return use_root(tmp_path / "glsl", monkeypatch)


@pytest.fixture(params=["fragment", "compute"])
def layer(request: pytest.FixtureRequest, device: Device) -> str:
    """Each physical layer that the device has."""
    if request.param == "compute" and not device.has_compute:
        pytest.skip(f"{device.name} has no compute programs")
    return request.param


@pytest.fixture
def kept(device: Device) -> Iterator[Kept]:
    made = Kept(device)
    yield made
    made.release()
