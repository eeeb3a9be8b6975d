# SPDX-License-Identifier: GPL-3.0-or-later
"""The error of pictures whose noise and bias are known."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from addon.photon.film.error import (
    DARK,
    EXTRAPOLATION,
    INNER_AREA,
    LEAST_SQUARE,
    Error,
    error_of,
)
from addon.photon.film.film import Squares, Statistics
from addon.photon.film.picture import FILM_IMAGES, picture_of
from addon.photon.prepare import prepare
from addon.photon.settings import Settings
from addon.streams import Device
from addon.streams.source import read
from tests.scenes import cornell

SHAPE = (40, 30)
# What errors of a picture of radiance one are over.
BRIGHT = math.hypot(1.0, DARK)


def over(noise: float, value: float = 1.0) -> float:
    """The same with noise, whose square is taken off."""
    return math.sqrt(value**2 - noise**2 + DARK**2)


def statistics(noise: Any, change: Any = 0.0, coverage: Any = 1.0, passes: int = 64) -> Statistics:
    """A grey picture of indirect light of radiance one, whose passes vary by `noise` and whose
    change from the inner radius is `change`."""
    coverage = np.broadcast_to(coverage, SHAPE)
    means = {name: np.zeros((*SHAPE, 4)) for name in (*FILM_IMAGES, "blur")}
    means["direct"][..., 3] = 1.0  # the weight: a white surface
    means["indirect"][..., :3], means["indirect"][..., 3] = coverage[..., None], coverage
    means["combined"][..., :3] = coverage[..., None]
    means["combined"][..., 3] = change * coverage
    means["blur"][..., 0] = (1 - change) * coverage
    means["blur"][..., 1] = coverage
    squares = {}
    for length in (2, 4):
        n = passes // length
        variance = np.zeros((*SHAPE, 4), np.float32)
        variance[..., :3] = np.broadcast_to(noise, SHAPE)[..., None] ** 2
        squares[length] = Squares(n, (n - 1) * variance / length)
    return Statistics(passes, means, squares)


def error(statistics: Statistics) -> Error:
    return error_of([statistics], picture_of(statistics.means)["Combined"])


def test_noise() -> None:
    found = error(statistics(0.2))
    assert found.noise == pytest.approx(0.2 / 8 / over(0.2 / 8), rel=1e-4)
    assert found.bias == 0.0 and found.total == found.noise
    np.testing.assert_allclose(found.image, 0.2 / 8, rtol=1e-4)


def test_what_a_speck_hides() -> None:
    """A pixel that one pass of many made bright is far off, not by as much as it is bright itself:
    up to what a few batches can tell."""
    for noise, expected in ((0.5, 0.5 / over(0.5)), (0.95, 0.95 / math.hypot(0.5, DARK))):
        found = error(statistics(8 * noise))
        assert found.noise == pytest.approx(expected, rel=1e-4)
        np.testing.assert_allclose(found.image, noise, rtol=1e-4)


def test_what_is_left_of_a_speck() -> None:
    """A share of what it was, however bright, in a denoised picture that shows none."""
    wanted = statistics(0.0)
    speck = 1e4
    for name in ("indirect", "combined"):
        wanted.means[name][3, 4, :3] = speck
    for squares in wanted.squares.values():
        squares.total[3, 4, :3] = speck**2 * squares.batches * (squares.batches - 1)
    plain, shown = picture_of(wanted.means)["Combined"], np.ones((*SHAPE, 3), np.float32)
    left = np.full(SHAPE, 0.01, np.float32)
    found = error_of([wanted], plain, shown=shown, left=left)
    of_speck = 0.01 / LEAST_SQUARE  # of its square
    assert found.noise == pytest.approx(math.sqrt(of_speck / left.size), rel=0.01)


@pytest.mark.parametrize("part", [0.0, 0.25, 1.0, 2.0])
def test_noise_that_is_not_denoised(part: float) -> None:
    """Of emission, which the halves tell: all of it is left, and a share of the rest."""
    noise, left = 0.2 / 8, 0.1
    wanted = statistics(0.2)
    wanted.means["emission"] = np.zeros((*SHAPE, 4))
    half = np.full((*SHAPE, 4), math.sqrt(part) * noise)
    wanted = replace(wanted, halves={"emission": half}, half_passes=32)
    plain = picture_of(wanted.means)["Combined"]
    found = error_of([wanted], plain, shown=plain, left=np.full(SHAPE, left, np.float32))
    remains = math.sqrt(left + (1.0 - left) * min(part, 1.0))
    assert found.noise == pytest.approx(remains * noise / over(noise), rel=1e-4)


def test_bias() -> None:
    found = error(statistics(0.0, 0.01))
    assert found.noise == 0.0 and found.bias == pytest.approx(
        0.01 * EXTRAPOLATION / BRIGHT, rel=1e-4
    )
    np.testing.assert_allclose(found.image, 0.01 * EXTRAPOLATION, rtol=1e-3)


def test_both() -> None:
    found = error(statistics(0.2, 0.01))
    assert found.total == pytest.approx(
        math.hypot(0.2 / 8, 0.01 * EXTRAPOLATION) / over(0.2 / 8), rel=1e-4
    )
    np.testing.assert_allclose(found.image, math.hypot(0.2 / 8, 0.01 * EXTRAPOLATION), rtol=2e-3)


def test_noise_is_no_bias() -> None:
    """A change that is as large as its own standard deviation says nothing."""
    rng = np.random.default_rng(3)
    wanted = statistics(0.0, 0.01 * rng.standard_normal(SHAPE))
    for squares in wanted.squares.values():
        n = squares.batches
        squares.total[..., 3] = 0.01**2 * n * (n - 1)
    assert error(wanted).bias < 0.01 * EXTRAPOLATION * 0.4  # else 1


def test_where_it_is() -> None:
    """The image shows where, and adds up to the whole."""
    x = np.linspace(0.0, 0.4, SHAPE[1])
    change = np.where(np.arange(SHAPE[0]) < 20, 0.0, 0.02)[:, None]
    found = error(statistics(x, change))
    assert np.sqrt(np.mean(found.image**2)) == pytest.approx(found.total * BRIGHT, rel=0.01)
    np.testing.assert_allclose(found.image[5, 2:-2, 0], x[2:-2] / 8, rtol=0.02)
    assert found.image[30, 2, 0] == pytest.approx(0.02 * EXTRAPOLATION, rel=0.1)


def test_the_dark_counts() -> None:
    """Errors are relative down to a tenth of the picture's mean."""
    dark = np.where(np.arange(SHAPE[0]) < 20, 1.0, 0.01)[:, None]
    wanted = statistics(0.01 * dark)
    for name in ("indirect", "combined"):
        wanted.means[name][..., :3] *= dark[..., None]
    mean = (1 + 0.01) / 2
    noise = 0.01 / 8
    squares = [(noise * x) ** 2 / (x**2 + (DARK * mean) ** 2) for x in (1.0, 0.01)]
    assert error(wanted).noise == pytest.approx(math.sqrt(np.mean(squares)), rel=1e-4)


def test_coverage_divides_the_deviations_too() -> None:
    found = error(statistics(0.2, coverage=0.5))
    assert found.noise == pytest.approx(0.2 / 8 / 0.5 / over(0.2 / 8 / 0.5), rel=1e-4)
    assert found.bias == 0.0


@pytest.mark.parametrize("passes", [0, 1, 4, 7])
def test_unknown(passes: int) -> None:
    found = error(statistics(0.2, passes=passes))
    assert found.noise == found.bias == found.total == math.inf and np.isinf(found.image).all()


def test_black_picture() -> None:
    black = statistics(0.0)
    for image in black.means.values():
        image[:] = 0.0
    found = error(black)
    assert found.total == 0.0 and not found.image.any()


def test_inner_area_is_the_shaders() -> None:
    (area,) = re.findall(r"const float INNER_AREA = ([\d.]+);", read("lib/density.glsl", "test"))
    assert float(area) == INNER_AREA


@pytest.mark.parametrize("corrected", [False, True])
@pytest.mark.parametrize("estimator", ["splat", "gather"])
def test_inner_estimate_is_that_of_the_inner_radius(
    device: Device, estimator: str, corrected: bool
) -> None:
    """What a pass carries along is what it would be with the smaller radius, to rounding.

    But that cuts are those of the outer one: next to the ball they lie where it is higher; and so
    is what a point's own triangle says of how much a cut disc is tilted, and whether light is
    summed over what the cuts leave, as its coverage then is, too.
    """

    def means(radius: float) -> Any:
        settings = Settings(
            width=24,
            height=24,
            photons=20000,
            radius=radius,
            estimator=estimator,  # type: ignore[arg-type]
            radius_decay=1.0,
            boundary_correction=corrected,
        )
        renderer = prepare(cornell(mirror=True, lobe=True), settings, device)
        try:
            renderer.render_pass()
            return renderer.film.means()
        finally:
            renderer.release()

    outer, inner = means(1.0), means(math.sqrt(INNER_AREA))
    here, there = (m["combined"][..., 3] + m["blur"][..., 0] for m in (inner, outer))
    # Photons on the rim of the disc may fall on either side of it.
    same = np.isclose(outer["blur"][..., 0], here, rtol=1e-3, atol=1e-5 * here.max())
    if corrected:
        covered = inner["indirect"][..., 3] + inner["mirror_indirect"][..., 3]
        over = outer["blur"][..., 0] * covered, here * outer["blur"][..., 1]
        same |= np.isclose(*over, rtol=1e-2)
    assert same.all() or (corrected and same.mean() > 0.97)
    assert np.abs(there - here).max() > 0.01 * here.max()


def test_without_photons_there_is_no_bias(device: Device) -> None:
    renderer = prepare(cornell(), Settings(width=16, height=16, photons=0), device)
    for _ in range(8):
        renderer.render_pass()
    assert renderer.error().bias == 0.0 and 0 < renderer.error().noise < 1
    assert "blur" not in renderer.film.means()
    renderer.release()


def test_edges_take_the_bias_of_the_even_surface() -> None:
    """Their own is hidden by the coverage's noise, here a change ten times as large."""
    edge = np.arange(SHAPE[1]) < 10
    wanted = statistics(0.0, np.where(edge, 0.1, 0.01), np.where(edge, 0.25, 1.0))
    assert error(wanted).bias == pytest.approx(0.01 * EXTRAPOLATION / BRIGHT, rel=1e-3)
    nothing_but_edges = statistics(0.0, 0.1, 0.25)
    assert error(nothing_but_edges).bias == pytest.approx(0.1 * EXTRAPOLATION / BRIGHT, rel=1e-3)


@pytest.mark.filterwarnings("error")
def test_dim_pictures(device: Device) -> None:
    """Squares of a very dim picture's reciprocals are beyond float32."""
    scene = cornell()
    lights = tuple(replace(light, power=(1e-17,) * 3) for light in scene.lights)
    renderer = prepare(
        replace(scene, lights=lights), Settings(width=16, height=16, photons=500), device
    )
    for _ in range(8):
        renderer.render_pass()
    images, error = renderer.images(), renderer.error()
    renderer.release()
    assert np.isfinite(error.total) and np.isfinite(images["Error"]).all()
