# SPDX-License-Identifier: GPL-3.0-or-later
"""The grid that photons are gathered from: on the host and on the device, the same to the bit."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.photon.backends import backend as backends
from addon.photon.backends.backend import Backend, ResidentBackend
from addon.photon.photons import bounces, grid_sort, photon_grid
from addon.photon.photons.deposits import DeviceDeposits, HostDeposits
from addon.photon.photons.radius_field import RadiusField
from addon.photon.prepare import prepare
from addon.photon.settings import Settings
from addon.photon.variants import needs
from addon.streams import Device
from tests.kernels.landed import landed, make_room, streams
from tests.measure import render
from tests.scenes import cornell


@pytest.fixture(autouse=True)
def _compute(device: Device) -> None:
    if not device.has_compute:
        pytest.skip(f"{device.name} has no compute programs")


def grid_of(backend: Backend) -> Any:
    """Over a box of two a side."""
    mesh: Any = SimpleNamespace(extent=np.ones(3), area=24.0)
    return backend.photon_grid(mesh, Settings(), next(needs()), [False])


def count_host_sorts(monkeypatch: pytest.MonkeyPatch, max_ranked: int) -> list[int]:
    """Set the limit; the list grows with each of the device's grids that the host had to sort."""
    monkeypatch.setattr(grid_sort, "MAX_RANKED", max_ranked)
    counts: list[int] = []
    arrays = DeviceDeposits.arrays  # the host has no other way to them

    def spy(self: DeviceDeposits) -> Any:
        counts.append(self.tables()[0])
        return arrays(self)

    monkeypatch.setattr(DeviceDeposits, "arrays", spy)
    return counts


@pytest.mark.parametrize("max_ranked", [grid_sort.MAX_RANKED, 3])
@pytest.mark.parametrize("radius", [0.01, 0.2, 5.0])
def test_device_sort_equals_native_sort(
    device: Device, monkeypatch: pytest.MonkeyPatch, max_ranked: int, radius: float
) -> None:
    """The same cells in the same order; crowded ones too, which go by way of the host."""
    monkeypatch.setattr(device, "prefers_native", False)
    by_host = count_host_sorts(monkeypatch, max_ranked)
    bounces = [landed(seed) for seed in range(6)]
    tables: list[list[NDArray[np.float32]]] = []
    for kind, backend in (
        (HostDeposits, Backend(device, "compute")),
        (DeviceDeposits, ResidentBackend(device)),
    ):
        deposits = kind(device)
        make_room(deposits, *bounces)
        for bounce in bounces:
            deposits.append(*streams(device, *bounce))
        grid = grid_of(backend)
        grid.prepare(deposits, RadiusField.even(device, radius, 0.0).of_passes(1.0))
        count = deposits.tables()[0]
        device.bind.settle()
        places, fluxes = (
            np.frombuffer(grid._sorted.lists[name].read(), np.float32).reshape(-1, 4)[:count]
            for name in ("photon_place", "photon_deposit")
        )
        cells = int(np.prod(grid._uniforms["grid_cells"]))
        starts = np.frombuffer(grid._sorted.lists["cell_start"].read(), np.uint32)[: cells + 1]
        assert starts[0] == 0 and starts[-1] == count
        tables.append([places, fluxes, starts])
        grid.release()
        deposits.release()
    for host, on_device in zip(*tables, strict=True):
        assert host.tobytes() == on_device.tobytes()
    assert len(by_host) == (max_ranked == 3 and radius == 5.0)  # one cell holds them all


def test_crowds_are_not_ranked_unasked(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """In a first pass it is launched before the host knows whether cells are crowded: it would cost
    a GPU the square of their photons."""
    monkeypatch.setattr(device, "prefers_native", False)
    deposits = DeviceDeposits(device)
    bounces = [landed(seed) for seed in range(6)]
    make_room(deposits, *bounces)
    for bounce in bounces:
        deposits.append(*streams(device, *bounce))
    grid = grid_of(ResidentBackend(device))
    radii = RadiusField.even(device, 5.0, 0.0).of_passes(1.0)  # one cell holds them all
    grid.prepare(deposits, radii)
    sort, ranked = grid._sort, []
    for max_ranked in (3, 1 << 20):
        monkeypatch.setattr(grid_sort, "MAX_RANKED", max_ranked)
        sort._reading = None  # as in a first pass
        device.bind.settle()
        sort._buffers["places"].write(np.full(4 * deposits.count, 7.0, np.float32))
        grid.prepare(deposits, radii)
        device.bind.settle()
        places = np.frombuffer(sort._buffers["places"].read(), np.float32)
        ranked.append((places[: 4 * deposits.count] != 7.0).any())
    assert ranked == [False, True]
    grid.release()
    deposits.release()


def test_several_launches_sum_as_one(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where photons crowd, each launch adds to what those before it have summed."""
    pictures = []
    for most in (1 << 20, 64):
        monkeypatch.setattr(grid_sort, "MAX_ADDED", most)
        settings = Settings(width=24, height=24, passes=2, photons=2000, backend="fragment")
        renderer = prepare(cornell(True), settings, device)
        for _ in range(settings.passes):
            renderer.render_pass()
        pictures.append((renderer.launches()["gather"], renderer.images()))
        renderer.release()
    (few, whole), (many, parts) = pictures
    assert many > 10 * few
    for name in ("Indirect", "Mirror"):
        assert whole[name].any()
        np.testing.assert_allclose(parts[name], whole[name], rtol=1e-5, atol=1e-7)


@pytest.mark.thorough("5.0-8192", "0.0-3")
@pytest.mark.parametrize("max_ranked", [grid_sort.MAX_RANKED, 3])
@pytest.mark.parametrize("radius", [0.0, 5.0])
@pytest.mark.usefixtures("not_aimed")
def test_pictures_are_bit_equal(
    device: Device, monkeypatch: pytest.MonkeyPatch, max_ranked: int, radius: float
) -> None:
    """Whoever keeps the photons and moves those alive together: the host or the device; but for the
    rounding of the radii, where they make those."""
    settings: dict[str, Any] = {
        "backend": "compute",
        "radius": radius,
        "passes": 2,
        "photons": 20000,
    }
    monkeypatch.setattr(bounces, "LANDED_ROWS", 32)
    one_lane = photon_grid.Lanes()  # lanes add up in another order
    monkeypatch.setattr(backends, "lanes_of_gpu", lambda pixels: one_lane)
    monkeypatch.setattr(backends, "lanes_of_probes", lambda triangles, pixels: 1)
    # The device's rounds otherwise.
    monkeypatch.setattr(ResidentBackend, "resolver", Backend.resolver)
    by_host = count_host_sorts(monkeypatch, max_ranked)
    pictures = []
    for native in (True, False):
        monkeypatch.setattr(device, "prefers_native", native)
        pictures.append(render(device, cornell(True), **settings))
    for name in pictures[0]:
        if radius and device.is_software:
            assert pictures[0][name].tobytes() == pictures[1][name].tobytes(), name
        elif device.is_software:
            np.testing.assert_allclose(pictures[1][name], pictures[0][name], rtol=1e-5)
        else:  # rounds bounces in one launch otherwise, and counts a photon at a border elsewhere
            one, other = (picture[name][np.isfinite(picture[name])] for picture in pictures)
            assert one.shape == other.shape
            assert np.abs(other - one).sum() <= 1e-2 * np.abs(one).sum()
    assert pictures[0]["Indirect"].mean() > 0
    assert not by_host or max_ranked == 3
    assert by_host or max_ranked != 3 or radius != 5.0


def test_lanes_gather_the_same(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """Several invocations a visible point, as on GPUs, of eye rays and chains: to rounding."""
    monkeypatch.setattr(device, "prefers_native", False)
    pictures = []
    for lanes in (photon_grid.Lanes(), photon_grid.lanes_of_gpu(1)):
        monkeypatch.setattr(backends, "lanes_of_gpu", lambda pixels, lanes=lanes: lanes)
        pictures.append(render(device, cornell(True), backend="compute", passes=1, photons=20000))
    one, several = (picture["Combined"] for picture in pictures)
    assert np.abs(one - several).max() <= 1e-5 * one.max()
    assert (one != several).any() and pictures[1]["Mirror"].any()
