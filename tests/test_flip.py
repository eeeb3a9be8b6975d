# SPDX-License-Identifier: GPL-3.0-or-later
"""FLIP's own promises."""

from __future__ import annotations

import numpy as np
import pytest

from tests.flip import flip, mean_flip


def uniform(value: float | tuple[float, float, float]) -> np.ndarray:
    return np.broadcast_to(np.asarray(value, float), (24, 32, 3))


def test_ends_of_the_scale() -> None:
    noise = np.random.default_rng(0).random((24, 32, 3))
    assert mean_flip(noise, noise) == 0.0
    # Green and blue are the farthest colours of a screen: the scale's end by definition.
    assert flip(uniform((0, 1, 0)), uniform((0, 0, 1))).mean() == pytest.approx(1.0)
    assert 0.9 < flip(uniform(0.0), uniform(1.0)).mean() < 1.0


def test_grows_with_the_difference_and_is_symmetric() -> None:
    values = [flip(uniform(0.5), uniform(0.5 + step)).mean() for step in (0.001, 0.01, 0.1)]
    assert 0 < values[0] < values[1] < values[2]
    assert flip(uniform(0.6), uniform(0.5)).mean() == pytest.approx(values[2])


def test_edges_count_more_than_colour() -> None:
    flat = uniform(0.5)
    line = np.array(flat)
    line[:, 16] = 1.0
    found = flip(flat, line)
    assert found[:, 16].min() > 2 * flip(flat, uniform(0.5 + 0.5 / 32)).mean()
    assert found[:, :4].max() < 0.5 * found[:, 16].max()


def test_exposure_does_not_matter() -> None:
    rng = np.random.default_rng(1)
    a, b = rng.random((2, 16, 16, 3))
    assert mean_flip(a, b) == pytest.approx(mean_flip(1000 * a, 1000 * b))
