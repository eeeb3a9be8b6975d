# SPDX-License-Identifier: GPL-3.0-or-later
"""What repeats exactly, and what must not."""

from __future__ import annotations

import numpy as np
import pytest

from addon.streams import Device
from tests.kernels.statistics import excess
from tests.measure import rendered
from tests.regression.test_repeat import digest, picture
from tests.scenes import closed_sphere
from tests.stability.table import Measured


@pytest.mark.stability(45)
@pytest.mark.parametrize("backend", ["fragment", "compute"])
def test_same_seed(device: Device, measured: Measured, thorough: bool, backend: str) -> None:
    """A hundred renders of everything that there is, one hash."""
    if backend == "compute" and not device.has_compute:
        pytest.skip(f"{device.name} has no compute programs")
    count = 100 if thorough else 10
    small = {"width": 24, "height": 20, "photons": 3000, "passes": 2}
    hashes = {digest(picture(device, backend=backend, **small)) for _ in range(count)}
    assert measured(f"hashes of {count} renders", len(hashes)) == 1


@pytest.mark.stability(46)
def test_many_seeds(device: Device, measured: Measured, thorough: bool) -> None:
    """32 or 64 seeds: normal about the truth, and their spread falls with the root of passes."""
    counts, truth, seeds = (1, 2, 4, 8), 0.5 / np.pi, 64 if thorough else 32
    pixels = np.zeros((seeds, len(counts), 4, 4))
    settings = {"photons": 2000, "radius": 0.3, "filter": "constant", "boundary_correction": False}
    for seed in range(seeds):
        options = {"seed": seed, "width": 4, "height": 4}
        with rendered(device, closed_sphere(0.5), **settings, **options) as renderer:
            for column, passes in enumerate(counts):
                while renderer.film.passes < passes:
                    renderer.render_pass()
                pixels[seed, column] = renderer.images()["Indirect"][..., 0]
    spread = np.sqrt(pixels.var(axis=0, ddof=1).mean(axis=(1, 2)))
    slope = np.polyfit(np.log(counts), np.log(spread), 1)[0]
    assert abs(measured("slope", slope) + 0.5) <= 0.05
    # Ten equally likely classes of the normal distribution about the truth.
    z = (pixels[:, -1, ::3, ::3] - truth) / spread[-1]  # corners: they share no photons
    edges = [-1.2816, -0.8416, -0.5244, -0.2533, 0.0, 0.2533, 0.5244, 0.8416, 1.2816]
    classes = np.bincount(np.searchsorted(edges, z.ravel()), minlength=10)
    fit = excess(classes, np.full(10, z.size / 10))
    assert measured("chi-square over its critical value", fit) < 1
