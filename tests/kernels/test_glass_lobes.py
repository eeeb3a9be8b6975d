# SPDX-License-Identifier: GPL-3.0-or-later
"""Lobes that let light through: densities and weights on both sides, Fresnel, Snell, energy, and
what a photon does that a ray of the eye does not."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.photon.scene import Lobe
from tests.kernels.conftest import Bench
from tests.kernels.statistics import Cells, assert_density
from tests.kernels.test_lobes import CASES, COLOURED, COUNT, WHITE, at, glass, probe

ROUGH = [Lobe("ggx_glass", COLOURED, parameters) for parameters in CASES["ggx_glass"].parameters]
NAMES = [
    " ".join(f"{lobe.parameters[n]:.3g}" for n in ("ior", "reflects", "alpha", "open"))
    for lobe in ROUGH
]
ANGLES = (10, 70)
rough = pytest.mark.parametrize("lobe", ROUGH, ids=NAMES)
FLIP = (1, 1, -1)


def fresnel(angle: float, ior: float) -> float:
    """Unpolarised reflectance (Born & Wolf, sec. 1.5)."""
    cosine, sine = math.cos(math.radians(angle)), math.sin(math.radians(angle)) / ior
    if sine >= 1.0:
        return 1.0
    below = math.sqrt(1.0 - sine * sine)
    s = (cosine - ior * below) / (cosine + ior * below)
    p = (ior * cosine - below) / (ior * cosine + below)
    return 0.5 * (s * s + p * p)


def refracted(viewer: Any, ior: float) -> NDArray[np.float64]:
    """Where it looks to through a smooth surface; along the surface at total reflection."""
    flat = np.asarray(viewer) * (-1, -1, 0) / ior
    found = flat - (0, 0, math.sqrt(max(1e-6, 1.0 - flat @ flat)))
    return np.asarray(found / np.linalg.norm(found))


def sample(bench: Bench, lobe: Lobe, viewer: Any, seed: int = 11, **defines: int) -> Any:
    """COUNT directions and their weights, and whether these go on at all."""
    numbers = np.random.default_rng(seed).integers(0, 1 << 24, (COUNT, 2)) / (1 << 24)
    of_all = np.broadcast_to(viewer, (COUNT, 3))
    first, second = probe(bench, lobe, of_all, numbers, SAMPLE=1, **defines)
    assert np.isfinite(first).all() and np.isfinite(second).all() and second.min() >= 0
    return first[:, :3], second[:, :3]


def behind(lobe: Lobe) -> Lobe:
    """The same surface for who is on the other side."""
    return replace(lobe, parameters={**lobe.parameters, "ior": 1.0 / lobe.parameters["ior"]})  # type: ignore[operator]


def sides(lobe: Lobe, viewer: Any, directions: Any, weight: Any) -> Any:
    """Those that went on by each side, and about where."""
    axes = viewer * (-1, -1, 1), refracted(viewer, lobe.parameters["ior"])
    for axis, sign in zip(axes, (1, -1), strict=True):
        part = (directions[:, 2] * sign > 0) & weight.any(axis=1)
        if part.mean() > 1e-2:
            yield axis, sign, part


@pytest.mark.parametrize("angle", ANGLES)
@rough
def test_samples_and_weights(one_bench: Bench, lobe: Lobe, angle: float) -> None:
    """On each side samples have the density, and a weight of f cos / pdf."""
    viewer = at(angle)
    directions, weight = sample(one_bench, lobe, viewer)
    others = sample(one_bench, lobe, viewer, seed=12)
    for axis, sign, part in sides(lobe, viewer, directions, weight):
        cells = Cells(others[0][(others[0][:, 2] * sign > 0) & others[1].any(axis=1)], axis)
        value, _ = probe(one_bench, lobe, np.broadcast_to(viewer, cells.points.shape), cells.points)
        density = value[:, 3] * (cells.points[:, 2] * sign > 0)
        share = cells.integral(density).sum()
        error = 4 * math.sqrt(share / COUNT)  # of the number of samples
        assert part.mean() == pytest.approx(share, abs=error + 3e-3 * share)
        assert_density(directions[part], cells, density, share)
        value, _ = probe(
            one_bench, lobe, np.broadcast_to(viewer, (part.sum(), 3)), directions[part]
        )
        cosine = np.abs(directions[part, 2:])
        expected = value[:, :3] * cosine / np.maximum(value[:, 3:], 1e-30)
        near = np.isclose(weight[part], expected, rtol=5e-3, atol=1e-6).all(axis=1)
        assert near.mean() > 0.999


@pytest.mark.parametrize("angle", ANGLES)
@pytest.mark.parametrize("ior", [1.1, 1.5, 2.4])
@pytest.mark.parametrize("roughness", [0.2, 0.45, 0.8])
def test_white_glass_loses_nothing(
    one_bench: Bench, ior: float, roughness: float, angle: float
) -> None:
    """From either side, to what the fits of the lost energy are good for."""
    for index in (ior, 1.0 / ior):
        parameters = {**glass(index, 2.0), "alpha": roughness**2, "compensated": 1.0}
        directions, weight = sample(one_bench, Lobe("ggx_glass", WHITE, parameters), at(angle))
        energy = weight[:, 0] * np.where(directions[:, 2] < 0, index**2, 1.0)
        assert energy.mean() == pytest.approx(1.0, abs=0.012)


@pytest.mark.thorough("0.8-")
@pytest.mark.parametrize("angle", [0, 30, 45, 60, 85])
@pytest.mark.parametrize("ior", [1.5, 1 / 1.5, 1.0, 0.8])
def test_smooth_glass_is_fresnels_and_snells(one_bench: Bench, ior: float, angle: float) -> None:
    viewer, exact = at(angle), fresnel(angle, ior)
    mirrored, through = viewer * (-1, -1, 1), refracted(viewer, ior)
    for reflects, share, is_open in (
        (0.0, 0.0, 0.0),
        (1.0, exact, 0.0),
        (2.0, exact, 0.0),
        (2.0, exact, 1.0),
    ):
        lobe = Lobe("glass", COLOURED, glass(ior, reflects, is_open))
        directions, weight = sample(one_bench, lobe, viewer)
        up = directions[:, 2] > 0
        goes_on = weight.any(axis=1)
        if exact == 1.0 and reflects == 0.0:
            assert not goes_on.any()
            continue
        energy = np.array(COLOURED) if reflects == 2.0 else np.ones(3)
        above, below = (weight[up & goes_on], weight[~up & goes_on])
        flux = above.sum(axis=0) / COUNT
        np.testing.assert_allclose(flux, share * energy, atol=2e-3)
        passed = (1 - share) * np.array(COLOURED) / (1.0 if is_open else ior**2)
        np.testing.assert_allclose(below.sum(axis=0) / COUNT, passed, atol=4e-3)
        np.testing.assert_allclose(directions[up & goes_on], mirrored + 0 * above, atol=1e-5)
        np.testing.assert_allclose(directions[~up & goes_on], through + 0 * below, atol=1e-5)


@rough
def test_reciprocal_but_for_the_index(one_bench: Bench, lobe: Lobe) -> None:
    """f(v, l) / n_l^2 = f(l, v) / n_v^2 of what is not compensated; of a sheet the other way."""
    lobe = replace(lobe, parameters={**lobe.parameters, "compensated": 0.0})
    rng = np.random.default_rng(6)
    above, below = rng.normal(size=(2, 100_000, 3))
    for v in (above, below):
        v /= np.linalg.norm(v, axis=1, keepdims=True)
        v[:, 2] = np.abs(v[:, 2])
    ior = float(lobe.parameters["ior"])  # type: ignore[arg-type]
    forth = probe(one_bench, lobe, above, below * FLIP)[0][:, :3] * ior ** (
        -2 if lobe.parameters["open"] else 2
    )
    back = probe(one_bench, behind(lobe), below, above * FLIP)[0][:, :3]
    assert forth.max() > 0
    # Of some that graze, rounding decides; on an H100 of 1.1 in ten thousand.
    assert np.isclose(forth, back, rtol=5e-3, atol=1e-5).mean() > 0.99985


@pytest.mark.parametrize("angle", ANGLES)
@rough
def test_photons_carry_what_eyes_see(one_bench: Bench, lobe: Lobe, angle: float) -> None:
    """Its weights sum up to the BSDF of all viewers that it may reach, times their cosines."""
    light = at(angle)
    directions, weight = sample(one_bench, lobe, light, PHOTON=1)
    for axis, sign, part in sides(lobe, light, directions, weight):
        cells = Cells(directions[part], axis)
        lights = np.broadcast_to(light, cells.points.shape)
        seen = lobe if sign > 0 else behind(lobe)
        turned = (1, 1, sign)
        value, _ = probe(one_bench, seen, cells.points * turned, lights * turned)
        cosine = np.maximum(cells.points[:, 2:] * sign, 0.0)
        integral = cells.integral(value[:, :3] * cosine).sum(axis=(0, 1))
        own = np.where(part[:, None], weight, 0.0)
        error = 4 * own.std(axis=0) / math.sqrt(COUNT)
        assert (np.abs(own.mean(axis=0) - integral) <= error + 4e-3 * integral).all()


@pytest.mark.parametrize("angle", ANGLES)
@pytest.mark.parametrize("photon", [{}, {"PHOTON": 1}])
def test_translucent_is_even_behind(one_bench: Bench, photon: Any, angle: float) -> None:
    """By the cosine, whoever goes through it and from wherever."""
    lobe, viewer = Lobe("translucent", COLOURED, {}), at(angle)
    directions, weight = sample(one_bench, lobe, viewer, **photon)
    np.testing.assert_allclose(weight, np.broadcast_to(COLOURED, weight.shape), rtol=1e-6)
    cells = Cells(sample(one_bench, lobe, viewer, seed=12, **photon)[0], np.array((0.0, 0.0, -1.0)))
    assert_density(directions, cells, np.maximum(-cells.points[:, 2], 0.0) / math.pi, 1.0)
    viewers = np.broadcast_to(viewer, directions.shape)
    value = probe(one_bench, lobe, viewers, directions)[0]
    np.testing.assert_allclose(value[:, :3], weight / math.pi, rtol=1e-5)
    np.testing.assert_allclose(value[:, 3], -directions[:, 2] / math.pi, rtol=1e-4, atol=1e-6)
    assert not probe(one_bench, lobe, viewers, directions * FLIP)[0].any()
