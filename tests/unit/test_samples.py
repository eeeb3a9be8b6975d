# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a pass's eye rays go through their pixels."""

from __future__ import annotations

import numpy as np
import pytest

from addon.photon.eye.samples import pixel_jitter
from addon.photon.settings import Settings


@pytest.mark.parametrize("seed", [0, 7])
@pytest.mark.parametrize("first", [0, 48])
def test_passes_fill_a_pixel_evenly(seed: int, first: int) -> None:
    """Each sixteen from a multiple on: one in each of sixteen parts, of any of five shapes."""
    settings = Settings(seed=seed, pixel_filter="box")
    points = np.array([pixel_jitter(settings, first + number) for number in range(16)])
    assert points.min() >= 0.0 and points.max() < 1.0
    for across in (1, 2, 4, 8, 16):
        parts = {(int(x * across), int(y * 16 / across)) for x, y in points}
        assert len(parts) == 16, across


def test_seeds_differ_and_none_leans() -> None:
    """One pass of many seeds is anywhere in its pixel."""
    of_seeds = np.array(
        [pixel_jitter(Settings(seed=seed, pixel_filter="box"), 5) for seed in range(2000)]
    )
    counts = np.histogram2d(*of_seeds.T, bins=4, range=((0, 1), (0, 1)))[0]
    assert np.abs(counts - 125).max() < 5 * np.sqrt(125)


def test_filters_weigh_by_how_often() -> None:
    """The mean of what passes see is the filter's: of a half of the pixel, of its tail."""
    settings = Settings(pixel_filter="blackman_harris", pixel_width=1.5)
    points = np.array([pixel_jitter(settings, number) for number in range(1024)]) - 0.5
    assert np.abs(points).max() <= 1.5
    np.testing.assert_allclose(points.mean(axis=0), 0.0, atol=2e-3)
    np.testing.assert_allclose((points < 0.0).mean(axis=0), 0.5, atol=2e-3)
