# SPDX-License-Identifier: GPL-3.0-or-later
"""Lists of deposits: on the host and on the device, the same to the bit."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.photon.photons.deposits import Deposits, DeviceDeposits, HostDeposits
from addon.photon.prepare import prepare
from addon.photon.settings import Settings
from addon.streams import Device, Stream
from tests.kernels.landed import expected, landed, make_room, streams
from tests.scenes import cornell
from tests.stability.table import Measured


@pytest.fixture(autouse=True)
def _compute(device: Device) -> None:
    if not device.has_compute:
        pytest.skip(f"{device.name} has no compute programs")


@pytest.fixture(params=[HostDeposits, DeviceDeposits])
def deposits(request: pytest.FixtureRequest, device: Device) -> Any:
    made = request.param(device)
    yield made
    made.release()


def listed(deposits: Deposits) -> NDArray[np.float32]:
    """The list as (P, 8)."""
    count, *textures = deposits.tables()
    deposits._device.bind.settle()
    columns = [np.frombuffer(t.read(), np.float32).reshape(-1, 4)[:count] for t in textures]
    return np.concatenate(columns, axis=1)


def test_dense_and_in_order(device: Device, deposits: Any) -> None:
    bounces = [landed(seed) for seed in range(12)]  # more than a row of the table
    for _ in range(2):  # the second pass starts afresh
        deposits.clear()
        make_room(deposits, *bounces)
        for bounce in bounces:
            deposits.append(*streams(device, *bounce))
        rows = expected(*bounces)
        assert len(rows) > 2 * 4096
        assert np.array_equal(listed(deposits), rows)
        assert deposits.dropped == 0


def test_nothing_landed(deposits: Any) -> None:
    deposits.clear()
    assert deposits.tables()[0] == 0


@pytest.mark.stability(47)
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("channel", [0, 2, 3, 4, 6, 7])
def test_not_finite_is_dropped_and_counted(
    device: Device, deposits: Any, channel: int, value: float
) -> None:
    """Its neighbours stay as they are."""
    place, deposit = landed(0)
    rows = expected((place, deposit))
    y, x = np.argwhere(place[..., 3] != 0)[100]
    (place, deposit)[channel // 4][y, x, channel % 4] = value
    deposits.clear()
    make_room(deposits, (place, deposit))
    deposits.append(*streams(device, place, deposit))
    assert deposits.dropped == 1
    assert np.array_equal(listed(deposits), np.delete(rows, 100, axis=0))
    deposits.clear()
    assert deposits.dropped == 1  # over all passes


@pytest.mark.stability(47)
@pytest.mark.thorough("splat-DeviceDeposits")
@pytest.mark.parametrize("kind", [HostDeposits, DeviceDeposits])
@pytest.mark.parametrize("estimator", ["gather", "splat"])
def test_poison_does_not_spread(
    device: Device, monkeypatch: pytest.MonkeyPatch, kind: Any, estimator: str, measured: Measured
) -> None:
    """A render with a NaN photon is the render without that photon, bit for bit."""
    monkeypatch.setattr(device, "prefers_native", kind is HostDeposits)
    append, pictures, appends = kind.append, [], 0
    for poison in (np.nan, 0.0):

        def spoil(
            self: Any, place: Stream, deposit: Stream, *more: Any, by: float = poison, **rows: int
        ) -> None:
            nonlocal appends
            appends += int(np.isnan(by))
            places, fluxes = place.download(), deposit.download()
            y, x = np.argwhere(places[..., 3] != 0)[10]
            if np.isnan(by):
                fluxes[y, x, 1] = by
                deposit.upload(fluxes)
            else:
                places[y, x] = fluxes[y, x] = 0.0
                place.upload(places)
                deposit.upload(fluxes)
            append(self, place, deposit, *more, **rows)

        monkeypatch.setattr(kind, "append", spoil)
        settings = Settings(
            width=32,
            height=32,
            photons=5000,
            backend="compute",
            estimator=estimator,
            photon_bounces=2,
        )
        renderer = prepare(cornell(), settings, device)
        renderer.render_pass()
        pictures.append(renderer.images()["Combined"])
        dropped = renderer.info()["dropped_photons"]
        assert dropped == (appends if np.isnan(poison) else 0)
        renderer.release()
    assert np.isfinite(pictures[0]).all() and pictures[0].any()
    spread = np.count_nonzero(pictures[0] != pictures[1])
    assert measured("pixel values that the poison changes", spread) == 0
