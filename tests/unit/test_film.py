# SPDX-License-Identifier: GPL-3.0-or-later
"""Film: means and variances against numpy in double precision."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.photon.film.film import Film, HostFilm, in_first_half, merged
from addon.photon.kernels.records import RADIANCE
from addon.streams import Device, Stream

SIZE = (7, 5)
PASSES = 200


@pytest.fixture(params=["fragment", "compute", "native"])
def layer(request: pytest.FixtureRequest, device: Device) -> str:
    """What adds passes up."""
    if request.param == "compute" and not device.has_compute:
        pytest.skip(f"{device.name} has no compute programs")
    return str(request.param)


def film_of(
    device: Device, layer: Any, names: tuple[str, ...], halved: tuple[str, ...] = ()
) -> Film | HostFilm:
    if layer == "native":
        return HostFilm(SIZE, names, halved)
    made = Film(device, layer, SIZE, names, halved=halved)
    made.prepare()
    return made


def fill(
    device: Device,
    layer: Any,
    data: NDArray[np.float32],
    names: tuple[str, ...],
    halved: tuple[str, ...] = (),
) -> Film | HostFilm:
    """A film of the passes (n, h, w, 4); the second image is the first one's negative."""
    film = film_of(device, layer, names, halved)
    streams = {name: Stream(device, RADIANCE, SIZE) for name in names}
    for one in data:
        for sign, stream in zip((1, -1), streams.values(), strict=False):
            stream.upload(np.float32(sign) * one)
        film.add(streams)
    return film


@pytest.fixture
def noise() -> NDArray[np.float64]:
    return np.random.default_rng(5).normal(size=(PASSES, SIZE[1], SIZE[0], 4))


def test_means(device: Device, layer: Any, noise: NDArray[np.float64]) -> None:
    """A running float32 sum loses digits here; the compensated one does not."""
    data = (1e4 + 0.5 * noise).astype(np.float32)
    film = fill(device, layer, data, ("combined", "other"))
    expected = data.astype(np.float64).mean(axis=0)
    plain = np.add.accumulate(data, axis=0, dtype=np.float32)[-1] / np.float32(PASSES)
    assert np.abs(plain - expected).max() > 1e-3  # else this test shows nothing
    means = film.means()
    assert np.abs(means["combined"] - expected).max() < 1e-4
    assert np.abs(means["other"] + expected).max() < 1e-4
    assert film.passes == PASSES
    film.release()


def test_small_among_large(device: Device, layer: Any) -> None:
    """What a plain float32 sum would not notice at all."""
    data = np.full((PASSES, SIZE[1], SIZE[0], 4), 1.0, np.float32)
    data[0] = 2.0**25
    film = fill(device, layer, data, ("combined",))
    total = film.means()["combined"] * PASSES
    assert np.allclose(total, 2.0**25 + PASSES - 1, rtol=0, atol=0.01)
    film.release()


def batch_variance(data: NDArray[Any], length: int) -> NDArray[np.float64]:
    """Variance of the mean, from the means of batches."""
    whole = len(data) // length * length
    batches = data[:whole].astype(np.float64).reshape(-1, length, *data.shape[1:]).mean(axis=1)
    return batches.var(axis=0, ddof=1) * length / len(data)


@pytest.mark.parametrize("passes", [8, 9, 15, 16, 19, PASSES])
@pytest.mark.parametrize(("offset", "spread"), [(0.0, 1.0), (1.0, 1e-2), (1e4, 0.5)])
def test_variance(
    device: Device,
    layer: Any,
    noise: NDArray[np.float64],
    offset: float,
    spread: float,
    passes: int,
) -> None:
    data = (offset + spread * noise[:passes]).astype(np.float32)
    film = fill(device, layer, data, ("combined",))
    expected = batch_variance(data, 2 if passes < 16 else 4)
    assert np.allclose(
        film.statistics().variance_of_mean(), expected, rtol=5e-3, atol=1e-2 * expected.mean()
    )
    film.release()


def test_variance_of_low_discrepancy(device: Device, layer: Any) -> None:
    """Passes that err in opposite directions: single ones would tell several times the variance."""
    step = np.arange(64) * 0.7548776662466927
    data = np.zeros((64, SIZE[1], SIZE[0], 4), np.float32)
    data += ((step[:, None] + np.linspace(0, 1, SIZE[0])) % 1.0 < 0.3)[:, None, :, None]
    film = fill(device, layer, data, ("combined",))
    variance = film.statistics().variance_of_mean()
    assert variance is not None
    single = data.astype(float).var(axis=0, ddof=1).mean() / 64
    error = ((data.mean(axis=0) - 0.3) ** 2).mean()
    assert error < 0.2 * single and error < variance.mean() < 0.4 * single
    film.release()


@pytest.mark.parametrize("split", [1, 8, 16, 50])
def test_merged_variance(
    device: Device, layer: Any, noise: NDArray[np.float64], split: int
) -> None:
    """Of two ranges of passes, as if they had been one: the same batches, if it is cut at one."""
    data = (3.0 + noise[:100]).astype(np.float32)
    films = [fill(device, layer, x, ("combined",)) for x in (data[:split], data[split:], data)]
    *parts, whole = (film.statistics() for film in films)
    both = merged(parts)
    assert both.passes == 100
    assert np.allclose(both.means["combined"], whole.means["combined"])
    found, expected = both.variance_of_mean(), whole.variance_of_mean()
    assert found is not None and expected is not None
    if split % 4 == 0:
        assert np.allclose(found, expected, rtol=1e-3)
    assert found.mean() == pytest.approx(expected.mean(), rel=0.05)
    for film in films:
        film.release()


@pytest.mark.parametrize("passes", [1, 2, 3, 8, 21])
def test_halves(device: Device, layer: Any, noise: NDArray[np.float64], passes: int) -> None:
    """Means of the passes that count to the first half: one of two, and about half of more, in
    pairs later; merged, of all ranges' first halves."""
    names, data = ("combined", "other"), (5.0 + noise[:passes]).astype(np.float32)
    first = [k for k in range(passes) if in_first_half(k)]
    assert 1 <= len(first) <= passes // 2 + 1 and abs(2 * len(first) - passes) <= 2
    film = fill(device, layer, data, names, halved=names)
    plain = fill(device, layer, data, names)
    whole = film.statistics()
    assert whole.half_passes == len(first) and not plain.statistics().halves
    for sign, name in zip((1, -1), names, strict=True):
        assert np.allclose(whole.halves[name], sign * data[first].mean(axis=0), rtol=1e-5)
        assert np.array_equal(whole.means[name], plain.means()[name])
    both = merged([whole, whole])
    assert both.half_passes == 2 * len(first)
    assert np.allclose(both.halves["other"], whole.halves["other"])
    film.release()
    plain.release()


def test_merged_of_few_passes_each(device: Device, noise: NDArray[np.float64]) -> None:
    """Ranges too short for batches of four still tell the variance, by pairs."""
    data = (3.0 + noise[:24]).astype(np.float32)
    films = [fill(device, "native", data[k : k + 3], ("combined",)) for k in range(0, 24, 3)]
    both = merged([film.statistics() for film in films])
    found = both.variance_of_mean()
    assert both.passes == 24 and both.squares[4].batches == 0 and found is not None
    assert found.mean() == pytest.approx(data.var(axis=0, ddof=1).mean() / 24, rel=0.3)


def test_few_passes(device: Device, layer: Any) -> None:
    data = np.stack(
        [
            np.full((SIZE[1], SIZE[0], 4), v, np.float32)
            for v in (3.0, 5.0, 1.0, 1.0, 3.0, 5.0, 1.0, 1.0)
        ]
    )
    film = film_of(device, layer, ("combined",))
    assert not film.means()["combined"].any() and film.statistics().variance_of_mean() is None
    film.release()
    for passes, mean in ((1, 3.0), (2, 4.0), (3, 3.0), (6, 3.0)):
        film = fill(device, layer, data[:passes], ("combined",))
        assert (film.means()["combined"] == mean).all()
        assert film.statistics().variance_of_mean() is None
        film.release()
    film = fill(device, layer, data, ("combined",))
    variance = film.statistics().variance_of_mean()
    assert variance is not None and np.allclose(variance, 0.75)  # 4 * 1.5^2 / (4 - 1) / 4
    film.release()


@contextmanager
def busy_cores() -> Iterator[None]:
    """Other work for every core."""
    work = [sys.executable, "-c", "while True: pass"]
    others = [subprocess.Popen(work) for _ in range(os.cpu_count() or 1)]
    try:
        yield
    finally:
        for other in others:
            other.kill()
            other.wait()


def test_is_whole_when_read(device: Device) -> None:
    """What is read holds all that was drawn; Mesa's llvmpipe left out whole passes of one film in
    ten where it had to share its cores."""
    one = np.ones((1, SIZE[1], SIZE[0], 4), np.float32)
    with busy_cores():
        for _ in range(60):
            film = fill(device, "fragment", np.repeat(one, 50, axis=0), ("combined", "other"))
            for sign, mean in zip((1, -1), film.means().values(), strict=True):
                assert (mean == sign).all()
            film.release()
