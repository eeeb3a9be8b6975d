# SPDX-License-Identifier: GPL-3.0-or-later
"""DevicePhotonMapper: bounces by the launch, foreseen, and the same deposits to the bit."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from addon.photon.photons import bounces, device_photon_mapper
from addon.photon.photons.deposits import DeviceDeposits
from addon.photon.photons.mapper import Mapper, PhotonBatch
from addon.photon.prepare import prepare
from addon.photon.settings import Settings
from addon.photon.stage.needs import SceneNeeds
from addon.streams import Device, Reading
from tests.measure import render
from tests.scenes import cornell


@pytest.fixture(autouse=True)
def _compute(device: Device) -> None:
    if not device.has_compute:
        pytest.skip(f"{device.name} has no compute programs")


def traced(mapper: Any, index: int) -> tuple[bytes, int]:
    """A pass's deposits, and how many photons were not finished by then."""
    mapper.start(PhotonBatch(index, 20000))
    deposits = mapper.finish()
    return b"".join(x.tobytes() for x in deposits.arrays()), mapper.unfinished


@pytest.fixture(params=[40, 1, "apart"])
def mapper(
    device: Device, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
) -> Iterator[Any]:
    """Of a device that keeps lists; photons end at their seventh bounce at the latest. They take
    two bounces in the first launch and more of those left in others, or one in each, or in one
    each kernel is launched apart."""
    monkeypatch.setattr(SceneNeeds, "shades_long", request.param == "apart")
    monkeypatch.setattr(bounces, "LANDED_ROWS", 40 if request.param == "apart" else request.param)
    monkeypatch.setattr(device, "prefers_native", False)
    settings = Settings(photons=20000, backend="compute", photon_bounces=6)
    renderer = prepare(cornell(True), settings, device)
    yield renderer.photons.mapper if renderer.photons else None
    renderer.release()


def found(mapper: Mapper) -> Any:
    """Where the photons of pass 1 land, and what they bring, (n, 8)."""
    mapper.start(PhotonBatch(1, 8000))
    return np.concatenate(mapper.finish().arrays(), axis=1)


@pytest.mark.usefixtures("resident")
@pytest.mark.thorough
def test_groups_of_a_warp(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever a work group holds, the picture is the same."""
    settings: dict[str, Any] = {"width": 24, "height": 16, "photons": 3000, "passes": 2}
    pictures = []
    for warp in (None, 32):
        monkeypatch.setattr(device, "warp", warp)
        pictures.append(render(device, cornell(True), backend="compute", **settings))
    for name, picture in pictures[0].items():
        np.testing.assert_array_equal(picture, pictures[1][name])


def test_several_bounces_in_one_launch(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """The deposits of one bounce a launch, and of one kernel a launch; for the latter a GPU's
    compiler may round otherwise, and a photon in thousands then turns at an edge."""
    lists, launches = [], []
    for prefers_native, rows in ((False, 2048), (False, 40), (False, 1), (True, 1), (False, 0)):
        monkeypatch.setattr(device, "prefers_native", prefers_native)
        monkeypatch.setattr(SceneNeeds, "shades_long", rows == 0)  # then kernels are launched apart
        monkeypatch.setattr(bounces, "LANDED_ROWS", rows)
        settings = Settings(photons=8000, backend="compute", photon_bounces=6)
        renderer = prepare(cornell(True), settings, device)
        mapper = renderer.photons and renderer.photons.mapper
        assert mapper
        lists.append(found(mapper))
        before = mapper.launches().get("bounces", 0)
        again = found(mapper)  # now it is foreseen
        assert again.tobytes() == lists[-1].tobytes()
        launches.append(mapper.launches().get("bounces", 0) - before)
        renderer.release()
    assert 1 == launches[0] < launches[1] < launches[2] and launches[3:] == [0, 0]
    assert lists[0].tobytes() == lists[1].tobytes() == lists[2].tobytes()
    assert lists[3].tobytes() == lists[4].tobytes()
    assert len(lists[0]) == pytest.approx(len(lists[3]), rel=1e-3)
    if device.is_software:
        assert lists[0].tobytes() == lists[3].tobytes()


@pytest.mark.thorough("40")
def test_host_does_not_wait_for_photons(
    device: Device, mapper: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After the first pass nothing is read before all is launched, and it is the same."""
    expected = traced(mapper, 0)
    reads: list[bool] = []
    data = Reading.data
    is_launched = False

    def read(reading: Reading) -> bytes:
        reads.append(is_launched)
        return data(reading)

    for reading in filter(None, device._readback._taken):
        reading.data()  # what nobody needed to know
    monkeypatch.setattr(Reading, "data", read)
    mapper.unfinished = 0
    mapper.start(PhotonBatch(0, 20000))
    is_launched = True
    mapper.finish()
    assert reads and all(reads)
    again = b"".join(x.tobytes() for x in mapper.deposits.arrays())
    assert (again, mapper.unfinished) == expected and expected[1] > 0


# Each part in one way, each way with one part.
@pytest.mark.thorough(
    "1-first", "1-second", "40-landed", "40-first", "apart-landed", "apart-second"
)
@pytest.mark.parametrize("part", ["landed", "first", "second"])
def test_more_photons_than_foreseen(
    device: Device, mapper: Any, monkeypatch: pytest.MonkeyPatch, part: str
) -> None:
    """More landed than there was room for, or were alive at a look than in any pass before."""
    monkeypatch.setattr(device_photon_mapper, "SPARE_PHOTONS", 0)
    expected = traced(mapper, 0)
    mapper.unfinished = 0
    foreseen = mapper._foreseen[20000]
    looked = sorted(foreseen.alive)[0 if part == "first" else 1]
    before = foreseen.landed, foreseen.alive[looked]
    if part == "landed":
        foreseen.landed //= 64
    else:
        foreseen.alive[looked] //= 64
    mapper.deposits.release()
    mapper.deposits = DeviceDeposits(device)
    launches = mapper.launches()["generator"]
    assert traced(mapper, 0) == expected
    assert mapper.launches()["generator"] == launches + 2  # it was traced again
    assert (foreseen.landed, foreseen.alive[looked]) == before and min(before) > 0
    traced(mapper, 0)
    assert mapper.launches()["generator"] == launches + 3


@pytest.mark.thorough("1]")
def test_more_deposits_than_guessed(
    device: Device, mapper: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first pass of all finds no room for what lands, and is traced again."""
    expected = traced(mapper, 0)
    monkeypatch.setattr(device_photon_mapper, "GUESSED", 0)
    mapper._foreseen.clear()
    mapper.unfinished = 0
    mapper.deposits.release()
    mapper.deposits = DeviceDeposits(device)
    before = mapper.launches()["generator"]
    assert traced(mapper, 0) == expected
    assert mapper.launches()["generator"] == before + 2


@pytest.mark.thorough("40")
def test_fewer_looks_than_foreseen(mapper: Any) -> None:
    """Photons outlive those of all passes before."""
    expected = traced(mapper, 0)
    mapper.unfinished = 0
    alive = mapper._foreseen[20000].alive
    del alive[max(alive)]
    assert traced(mapper, 0) == expected
