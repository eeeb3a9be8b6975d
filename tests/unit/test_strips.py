# SPDX-License-Identifier: GPL-3.0-or-later
"""Strips: each row once, all of one size; their films are one film."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from addon.photon.backends import backend as backend_module
from addon.photon.backends.backend import Backend, backend_of
from addon.photon.film.film import Film
from addon.photon.film.strips import StripFilm, strips_of
from addon.photon.kernels.records import RADIANCE
from addon.photon.prepare import prepare
from addon.photon.settings import Region, Settings
from addon.streams import Device, Stream
from tests.scenes import cornell

NAMES = ("combined", "direct")


@pytest.fixture
def pixels(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Sets how many a strip has."""

    def limit(count: int) -> None:
        for name in ("STRIP_PIXELS", "GPU_STRIP_PIXELS"):
            monkeypatch.setattr(backend_module, name, count)

    return limit


@pytest.mark.parametrize("most", [1, 7, 8, 50, 64, 799, 800, 801, 1 << 20])
@pytest.mark.parametrize(
    "region", [(0, 0, 8, 100), (0, 0, 1, 1), (3, 5, 10, 68), (0, 7, 800, 8), (2, 3, 3, 400)]
)
def test_each_row_once(most: int, region: Region) -> None:
    found = strips_of(region, most)
    x0, y0, x1, y1 = region
    rows = np.concatenate([np.arange(y1 - y0)[strip.rows] for strip in found])
    assert (rows == np.arange(y1 - y0)).all()
    assert len({strip.size for strip in found}) == 1
    width, height = found[0].size
    assert width == x1 - x0 and (height == 1 or width * height <= most)
    for strip in found:
        assert strip.region[0] == x0 and strip.region[2] == x1
        assert strip.region[1] - y0 == strip.rows.start and strip.region[3] <= y1
        assert 0 < strip.height <= height
    # No more of them than the limit asks for.
    assert len(found) == -(-(y1 - y0) // max(1, most // width))


def test_what_is_usual_is_one_strip(device: Device) -> None:
    size = (720, 720) if device.is_software else (1920, 1080)
    most = backend_of(Settings(), device).strip_pixels
    assert len(strips_of((0, 0, *size), most)) == 1
    assert len(strips_of((0, 0, 4096, 4096), most)) > 1


def test_films_are_one(device: Device, layer: Any) -> None:
    """Sums, squares and passes of strips that overlap, as of one film."""
    width, height, passes = 6, 11, 7
    region = (2, 3, 2 + width, 3 + height)
    found = strips_of(region, width * 4)
    assert [strip.height for strip in found] == [3, 4, 4]
    data = np.random.default_rng(3).normal(size=(passes, height, width, 4)).astype(np.float32)
    whole = Film(device, layer, (width, height), NAMES)
    parts = StripFilm(Backend(device, layer), found, NAMES)
    whole.prepare()
    parts.prepare()
    frame, part = (Stream(device, RADIANCE, size) for size in ((width, height), found[0].size))
    for one in data:
        frame.upload(one)
        whole.add(dict.fromkeys(NAMES, frame))
        for number, strip in enumerate(found):
            part.upload(one[strip.region[1] - 3 : strip.region[3] - 3])
            parts.add(number, dict.fromkeys(NAMES, part))
    one, other = whole.statistics(), parts.statistics()
    assert parts.passes == one.passes == other.passes == passes
    for name in NAMES:
        np.testing.assert_array_equal(one.means[name], other.means[name])
        np.testing.assert_array_equal(parts.means()[name], other.means[name])
    for length, squares in one.squares.items():
        assert squares.batches == other.squares[length].batches
        np.testing.assert_array_equal(squares.total, other.squares[length].total)
    for item in (whole, parts, frame, part):
        item.release()


def test_photons_are_traced_once_a_pass(device: Device, pixels: Any) -> None:
    """And mapped once, however many strips look them up."""
    settings = Settings(width=12, height=10, photons=2000, passes=1)
    counts = []
    for most in (1 << 20, 12):
        pixels(most)
        renderer = prepare(cornell(), settings, device)
        renderer.render_pass()
        counts.append(renderer.launches())
        renderer.release()
    one, ten = counts
    assert ten["gather"] == 10 * one["gather"] and ten["eye_rays"] == 10 * one["eye_rays"]
    for stem in ("generator", "paths"):
        assert one.get(stem) == ten.get(stem)


def test_depth_of_strips(device: Device, pixels: Any) -> None:
    """The first pass's, of all rows, and no later one's."""
    settings = Settings(width=12, height=10, photons=2000, passes=2)
    depths = []
    for most in (1 << 20, 12 * 3):
        pixels(most)
        renderer = prepare(cornell(), settings, device)
        for _ in range(2):
            renderer.render_pass()
            depths.append(renderer.images()["Depth"])
        renderer.release()
    for depth in depths[1:]:
        np.testing.assert_array_equal(depth, depths[0])
