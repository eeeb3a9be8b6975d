# SPDX-License-Identifier: GPL-3.0-or-later
"""Where eye rays go through their pixels."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.photon.film.film import in_first_half
from addon.photon.kernels.eye_rays import EyeRays
from addon.photon.settings import PixelFilter, Settings
from addon.photon.stage.switches import made_camera
from tests.filters import below
from tests.kernels.conftest import Bench
from tests.kernels.statistics import excess

MANY = 1 << 16


def offsets(
    bench: Bench, index: int, seed: int = 0, count: int = MANY, name: PixelFilter = "box"
) -> NDArray[Any]:
    """A pass's, from pixels' middles [widths], (count, 2): a flat camera shows them."""
    size = (bench.WIDTH, -(-count // bench.WIDTH))
    uniforms: dict[str, Any] = {
        "camera": tuple(np.eye(4).ravel()),
        "camera_parameters": (0.0,) * 4,
        "window": (0.0, float(size[0]), 0.0, float(size[1])),
        "clip": (0.0, 1.0),
        "frame_size": size,
        "region_origin": (0, 0),
        "pixel_filter_width": 1.0,
        "seed": seed,
        "pass_index": index,
    }
    defines, made = {f"PIXEL_{name.upper()}": 1}, made_camera("ortho")
    found = bench.run(EyeRays, {}, uniforms, defines=defines, count=count, made=made)
    places: NDArray[Any] = found["origin"][:, :2] - found["pixel"][:, :2] - 0.5
    return places


@pytest.mark.parametrize("is_first_half", [True, False])
@pytest.mark.parametrize("first", [0, 48])
def test_passes_fill_a_pixel_evenly(bench: Bench, is_first_half: bool, first: int) -> None:
    """Each sixteen of a half from a multiple on: one in each of sixteen parts, of any of five
    shapes. Of the first pixel, where a flat camera rounds least."""
    passes = [n for n in range(256) if in_first_half(n) == is_first_half][first : first + 16]
    for seed in range(6):
        points = 0.5 + np.vstack([offsets(bench, index, seed, count=1) for index in passes])
        assert points.min() > 0.0 and points.max() < 1.0
        for across in (1, 2, 4, 8, 16):
            parts = np.floor(points * (across, 16 // across)) @ (16, 1)
            assert len(np.unique(parts)) == 16, (seed, across)


@pytest.mark.parametrize("seed", [0, 7])
def test_the_first_goes_about_the_middle(bench: Bench, seed: int) -> None:
    for name in ("box", "gauss", "blackman_harris"):
        found = offsets(bench, 0, seed, 1000, name)
        assert np.abs(found).max() < 0.032 and np.abs(found.mean(axis=0)).max() < 0.002, name


@pytest.mark.parametrize("index", [1, 3, 5])
def test_pixels_have_places_of_their_own(one_bench: Bench, index: int) -> None:
    """Those of one pass are anywhere, whatever their neighbours' are, or another seed's."""
    found = offsets(one_bench, index)
    cells = np.floor(found * 4 + 2).clip(0, 3) @ (4, 1)
    assert excess(np.bincount(cells.astype(int), minlength=16), np.full(16, MANY / 16)) < 1
    for other in (
        np.roll(found, 1, axis=0),
        np.roll(found, one_bench.WIDTH, axis=0),
        offsets(one_bench, index, seed=1),
    ):
        for a, b in ((0, 0), (0, 1), (1, 1)):
            assert abs(np.corrcoef(found[:, a], other[:, b])[0, 1]) < 5 / MANY**0.5


def test_halves_know_nothing_of_each_other(one_bench: Bench) -> None:
    """Passes 1 and 2 are of one half, 3 and 6 of the other: those of one go to different sides."""
    one, two, three, six = (offsets(one_bench, index)[:, 0] for index in (1, 2, 3, 6))
    assert np.corrcoef(one, two)[0, 1] < -0.5
    for first in (one, two):
        for other in (three, six):
            assert abs(np.corrcoef(first, other)[0, 1]) < 5 / MANY**0.5


@pytest.mark.parametrize("name", ["box", "gauss", "blackman_harris"])
def test_filters_weigh_by_how_often(one_bench: Bench, name: PixelFilter) -> None:
    """In both directions, each by itself; and no ray goes farther than is told."""
    found = offsets(one_bench, 1, name=name)
    settings = Settings(pixel_filter=name, pixel_width=1.0)
    assert np.abs(found).max() <= settings.pixel_filter_reach * (1 + 1e-4)
    edges = np.linspace(-1.5, 1.5, 25)
    shares = np.diff([below(name, 1.0, x) for x in edges])
    counts = np.histogram2d(*found.T, bins=(edges, edges))[0]
    assert excess(counts, MANY * np.outer(shares, shares)) < 1
