# SPDX-License-Identifier: GPL-3.0-or-later
"""Film: means and variances against numpy in double precision."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.photon.film import Film
from addon.photon.records import RADIANCE
from addon.streams import Device, Stream

SIZE = (7, 5)
PASSES = 200


def fill(device: Device, layer: Any, data: NDArray[np.float32], names: tuple[str, ...]) -> Film:
    """A film of the passes (n, h, w, 4); the second image is the first one's negative."""
    film = Film(device, layer, SIZE, names)
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


@pytest.mark.parametrize(("offset", "spread"), [(0.0, 1.0), (1.0, 1e-2), (1e4, 0.5)])
def test_variance(
    device: Device, layer: Any, noise: NDArray[np.float64], offset: float, spread: float
) -> None:
    data = (offset + spread * noise).astype(np.float32)
    film = fill(device, layer, data, ("combined",))
    expected = data.astype(np.float64).var(axis=0, ddof=1) / PASSES
    assert np.allclose(film.variance_of_mean(), expected, rtol=2e-3)
    film.release()


def test_few_passes(device: Device, layer: Any) -> None:
    data = np.stack([np.full((SIZE[1], SIZE[0], 4), v, np.float32) for v in (3.0, 5.0)])
    film = Film(device, layer, SIZE, ("combined",))
    assert not film.means()["combined"].any() and np.isinf(film.variance_of_mean()).all()
    film.release()
    film = fill(device, layer, data[:1], ("combined",))
    assert (film.means()["combined"] == 3.0).all() and np.isinf(film.variance_of_mean()).all()
    film.release()
    film = fill(device, layer, data, ("combined",))
    assert (film.means()["combined"] == 4.0).all()
    assert np.allclose(film.variance_of_mean(), 1.0)  # (1 + 1) / (2 - 1) / 2
    film.release()
