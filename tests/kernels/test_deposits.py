# SPDX-License-Identifier: GPL-3.0-or-later
"""Deposits and their grid: on the host and on the device, the same to the bit."""

from __future__ import annotations

from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.photon.kernels.records import DEPOSIT, PLACE
from addon.photon.photons import bounces, device_photon_mapper, grid_sort, photon_grid
from addon.photon.photons.deposits import Deposits, DeviceDeposits, HostDeposits
from addon.photon.photons.mapper import Mapper, PhotonBatch
from addon.photon.photons.radius_field import RadiusField
from addon.photon.prepare import prepare
from addon.photon.settings import Settings
from addon.photon.stage.needs import SceneNeeds
from addon.photon.variants import needs
from addon.photon.ways.way import ResidentWay, Way
from addon.streams import Device, Reading, Stream
from tests.measure import render
from tests.scenes import cornell
from tests.stability.table import Measured

SIZE = (64, 48)


@pytest.fixture(autouse=True)
def _compute(device: Device) -> None:
    if not device.has_compute:
        pytest.skip(f"{device.name} has no compute programs")


@pytest.fixture(params=[HostDeposits, DeviceDeposits])
def deposits(request: pytest.FixtureRequest, device: Device) -> Any:
    made = request.param(device)
    yield made
    made.release()


def landed(seed: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """A bounce's streams: about a third of the elements holds a deposit."""
    rng = np.random.default_rng(seed)
    place, deposit = rng.uniform(-1, 1, (2, SIZE[1], SIZE[0], 4)).astype(np.float32)
    place[..., 3] = np.where(rng.random(place.shape[:2]) < 0.3, 2.0, 0.0)
    for array in (place, deposit):
        array[place[..., 3] == 0] = 0.0
    return place, deposit


def streams(device: Device, *arrays: NDArray[np.float32]) -> list[Stream]:
    made = [Stream(device, record, SIZE) for record in (PLACE, DEPOSIT)]
    for stream, array in zip(made, arrays, strict=True):
        stream.upload(array)
    return made


def listed(deposits: Deposits) -> NDArray[np.float32]:
    """The list as (P, 8)."""
    count, *textures = deposits.tables()
    columns = [np.frombuffer(t.read(), np.float32).reshape(-1, 4)[:count] for t in textures]
    return np.concatenate(columns, axis=1)


def expected(*bounces: tuple[NDArray[np.float32], NDArray[np.float32]]) -> NDArray[np.float32]:
    rows = np.concatenate([np.concatenate(b, axis=2).reshape(-1, 8) for b in bounces])
    return rows[rows[:, 3] != 0]


def make_room(deposits: Any, *bounces: tuple[NDArray[np.float32], NDArray[np.float32]]) -> None:
    """A list on the device does not grow by itself."""
    if isinstance(deposits, DeviceDeposits):
        deposits.make_room(len(expected(*bounces)))


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


# The grid.


def grid_of(way: Way) -> Any:
    """Over a box of two a side."""
    mesh: Any = SimpleNamespace(extent=np.ones(3), area=24.0)
    return way.photon_grid(mesh, Settings(), next(needs()), [False])


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
    for kind, way in (
        (HostDeposits, Way(device, "compute")),
        (DeviceDeposits, ResidentWay(device)),
    ):
        deposits = kind(device)
        make_room(deposits, *bounces)
        for bounce in bounces:
            deposits.append(*streams(device, *bounce))
        grid = grid_of(way)
        grid.prepare(deposits, RadiusField.even(device, radius).of_pass(1.0))
        count = deposits.tables()[0]
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
    grid = grid_of(ResidentWay(device))
    radii = RadiusField.even(device, 5.0).of_pass(1.0)  # one cell holds them all
    grid.prepare(deposits, radii)
    sort, ranked = grid._sort, []
    for max_ranked in (3, 1 << 20):
        monkeypatch.setattr(grid_sort, "MAX_RANKED", max_ranked)
        sort._reading = None  # as in a first pass
        sort._buffers["places"].write(np.full(4 * deposits.count, 7.0, np.float32))
        grid.prepare(deposits, radii)
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
    monkeypatch.setattr(photon_grid, "LANES", 1)  # lanes add up in another order
    monkeypatch.setattr(photon_grid, "LANES_OF_CHAINS", 1)
    monkeypatch.setattr(ResidentWay, "resolver", Way.resolver)  # the device's rounds otherwise
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
    mapper.start(PhotonBatch(1, 20000))
    return np.concatenate(mapper.finish().arrays(), axis=1)


def test_several_bounces_in_one_launch(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """The deposits of one bounce a launch, and of one kernel a launch; for the latter a GPU's
    compiler may round otherwise, and a photon in thousands then turns at an edge."""
    lists, launches = [], []
    for prefers_native, rows in ((False, 2048), (False, 40), (False, 1), (True, 1), (False, 0)):
        monkeypatch.setattr(device, "prefers_native", prefers_native)
        monkeypatch.setattr(SceneNeeds, "shades_long", rows == 0)  # then kernels are launched apart
        monkeypatch.setattr(bounces, "LANDED_ROWS", rows)
        settings = Settings(photons=20000, backend="compute", photon_bounces=6)
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


def test_host_does_not_wait_for_photons(mapper: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """After the first pass nothing is read before all is launched, and it is the same."""
    expected = traced(mapper, 0)
    reads: list[bool] = []
    data = Reading.data
    is_launched = False

    def read(reading: Reading) -> bytes:
        reads.append(is_launched)
        return data(reading)

    for reading in filter(None, mapper._device._readback._taken):
        reading.data()  # what nobody needed to know
    monkeypatch.setattr(Reading, "data", read)
    mapper.unfinished = 0
    mapper.start(PhotonBatch(0, 20000))
    is_launched = True
    mapper.finish()
    assert reads and all(reads)
    again = b"".join(x.tobytes() for x in mapper.deposits.arrays())
    assert (again, mapper.unfinished) == expected and expected[1] > 0


@pytest.mark.parametrize("part", ["landed", "first", "second"])
def test_more_photons_than_foreseen(
    mapper: Any, monkeypatch: pytest.MonkeyPatch, part: str
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
    mapper.deposits = DeviceDeposits(mapper._device)
    launches = mapper.launches()["generator"]
    assert traced(mapper, 0) == expected
    assert mapper.launches()["generator"] == launches + 2  # it was traced again
    assert (foreseen.landed, foreseen.alive[looked]) == before and min(before) > 0
    traced(mapper, 0)
    assert mapper.launches()["generator"] == launches + 3


def test_more_deposits_than_guessed(mapper: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """The first pass of all finds no room for what lands, and is traced again."""
    expected = traced(mapper, 0)
    monkeypatch.setattr(device_photon_mapper, "GUESSED", 0)
    mapper._foreseen.clear()
    mapper.unfinished = 0
    mapper.deposits.release()
    mapper.deposits = DeviceDeposits(mapper._device)
    before = mapper.launches()["generator"]
    assert traced(mapper, 0) == expected
    assert mapper.launches()["generator"] == before + 2


def test_fewer_looks_than_foreseen(mapper: Any) -> None:
    """Photons outlive those of all passes before."""
    expected = traced(mapper, 0)
    mapper.unfinished = 0
    alive = mapper._foreseen[20000].alive
    del alive[max(alive)]
    assert traced(mapper, 0) == expected


def test_lanes_gather_the_same(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """Several invocations a visible point, as on GPUs, of eye rays and chains: to rounding."""
    monkeypatch.setattr(device, "prefers_native", False)
    pictures = []
    for lanes in ((1, 1), (8, 32)):
        monkeypatch.setattr(photon_grid, "LANES", lanes[0])
        monkeypatch.setattr(photon_grid, "LANES_OF_CHAINS", lanes[1])
        pictures.append(render(device, cornell(True), backend="compute", passes=1, photons=20000))
    one, several = (picture["Combined"] for picture in pictures)
    assert np.abs(one - several).max() <= 1e-5 * one.max()
    assert (one != several).any() and pictures[1]["Mirror"].any()
