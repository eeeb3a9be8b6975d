# SPDX-License-Identifier: GPL-3.0-or-later
"""Reflector and Projector of what Shade finds on a single triangle."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.photon.kernels.projector import Projector
from addon.photon.kernels.reflector import Reflector
from addon.photon.scene import MIRROR, Lobe, Material, phong
from tests.kernels.conftest import Bench
from tests.kernels.shading import EYE, PHOTONS, SURFACE, made_for, shade
from tests.kernels.statistics import excess
from tests.scenes import plain_material

COUNT = 100_000
GOLD = (0.3, 0.2, 0.1)
MIRRORS = phong((0.05, 0.1, 0.2))
INCOMING = np.array([0.6, 0.0, -0.8])
FLUX = np.array([2.0, 1.0, 0.5])


def incoming(direction: Any = INCOMING) -> dict[str, NDArray[np.float32]]:
    """Photons that all meet the triangle's centroid; every tenth misses."""
    flux = np.concatenate([np.tile(FLUX, (COUNT, 1)), np.arange(COUNT)[:, None]], 1)
    hit = np.tile([0.7, 1.0, 1 / 3, 1 / 3], (COUNT, 1))
    hit[::10] = 0.0
    return {
        "direction": np.tile([*direction, 3e38], (COUNT, 1)).astype(np.float32),
        "hit": hit.astype(np.float32),
        "flux": flux.astype(np.float32),
    }


def reflect(bench: Bench, material: Material, bounce: int = 0, **kwargs: Any) -> dict[str, Any]:
    values = {"seed": 1, "pass_index": 2, "bounce": bounce}
    points = shade(bench, material, incoming(**kwargs), values, PHOTONS)
    return bench.run(Reflector, points, values, defines=PHOTONS, made=made_for(material))


MATERIALS = [
    plain_material("grey", (0.5, 0.5, 0.5)),
    plain_material("red", (0.8, 0.2, 0.05)),
    plain_material("white", (1.0, 1.0, 1.0)),
    plain_material("mirror", (0.0, 0.0, 0.0), (0.9, 0.6, 0.3)),
    plain_material("both", (0.3, 0.1, 0.5), (0.2, 0.6, 0.1)),
    plain_material("lobe", (0.2, 0.2, 0.2), (0.5, 0.4, 0.3), 200.0),
]


def lobe_of(material: Material) -> tuple[Any, float]:
    """The paper's k_s, and the exponent."""
    for lobe in material.lobes:
        return lobe.colour, lobe.parameters.get("exponent", MIRROR)
    return (0.0, 0.0, 0.0), MIRROR


@pytest.mark.parametrize("material", MATERIALS, ids=lambda m: m.name)
def test_energy_in_expectation(bench: Bench, material: Material) -> None:
    """Mean outgoing flux = albedo x incoming flux, in each channel."""
    result = reflect(bench, material)
    flux = result["next_flux"][:, :3].astype(np.float64)
    specular, exponent = lobe_of(material)
    albedo = np.add(material.diffuse, specular)
    hits = COUNT * 0.9
    mean = flux.sum(axis=0) / hits
    error = np.sqrt(np.maximum((flux**2).sum(axis=0) / hits - mean**2, 0) / hits)
    expected = albedo * FLUX
    if np.isfinite(exponent):  # the lobe's weight (n + 2) / (n + 1) cos: nearly k_s here
        assert (mean <= expected + 4 * error).all()
        below = np.array(specular) * FLUX * 0.21  # 1 - cos 37 deg = 0.2
        assert (mean >= expected - below - 4 * error).all()
    else:
        assert (np.abs(mean - expected) <= 4 * error + 1e-6).all()
    survivors = result["alive"] / hits
    chance = expected.sum() / FLUX.sum()
    assert abs(survivors - chance) <= 4 * math.sqrt(chance * (1 - chance) / hits) + 1e-3 * (
        material.name == "lobe"
    )


def test_lobe_at_normal_incidence_reflects_k_s(bench: Bench) -> None:
    """There nothing of the lobe is lost below the surface: exactly k_s."""
    material = plain_material("lobe", (0.0, 0.0, 0.0), (0.6, 0.4, 0.2), 20.0)
    flux = reflect(bench, material, direction=(0, 0, -1))["next_flux"][:, :3].astype(np.float64)
    hits = COUNT * 0.9
    mean = flux.sum(axis=0) / hits
    error = flux.std(axis=0) / math.sqrt(hits)
    assert (np.abs(mean - np.multiply(lobe_of(material)[0], FLUX)) <= 4 * error).all()


SEVERAL = [
    Material("three", (0.1, 0.2, 0.0), (phong((0.1, 0.2, 0.3), 5.0), MIRRORS, phong(GOLD, 90.0))),
    Material("covered", (0.0,) * 3, (replace(MIRRORS, covered=(0.6, 0.4, 0.2)),)),
    Material("covered, and bare", (0.2, 0.0, 0.1), (replace(MIRRORS, covered=(0.3, 0.4, 0.2)),)),
    Material(
        "two layers",
        (0.05,) * 3,
        (
            replace(MIRRORS, covered=(0.3, 0.1, 0.2)),
            Lobe("phong", GOLD, {"exponent": 9.0}, 0.5, GOLD),
        ),
    ),
    Material("weighed", (0.1,) * 3, (replace(MIRRORS, weight=0.25), phong(GOLD, 50.0))),
]


def head_on(material: Material) -> Any:
    """What it reflects of what comes from straight above."""
    albedo = np.array(material.diffuse)
    for lobe in material.lobes:
        albedo = albedo + np.multiply(lobe.weight, lobe.colour)
        albedo += np.multiply(lobe.covered, 1 - max(lobe.colour))
    return albedo


@pytest.mark.parametrize("material", SEVERAL, ids=lambda m: m.name)
def test_lobes_and_layers_by_chance(bench: Bench, material: Material) -> None:
    """Of a material of several each photon meets one: on average all, each channel for itself."""
    result = reflect(bench, material, direction=(0, 0, -1))
    flux = result["next_flux"][:, :3].astype(np.float64)
    hits = COUNT * 0.9
    mean = flux.sum(axis=0) / hits
    error = np.sqrt(((flux**2).sum(axis=0) / hits - mean**2) / hits)
    expected = head_on(material) * FLUX
    assert (error < 0.01 * expected.max()).all()
    assert (np.abs(mean - expected) <= 4 * error).all()


@pytest.mark.parametrize("material", SEVERAL, ids=lambda m: m.name)
def test_what_the_eye_meets_of_several(bench: Bench, material: Material) -> None:
    """The albedo through what covers it, exactly; of the lobes two, on average all."""
    streams = incoming(direction=(0, 0, -1))
    points = shade(bench, material, streams, {"seed": 1, "pass_index": 2}, EYE)
    there = points["place"][:, 3] != 0
    covered = sum(
        (np.multiply(lobe.covered, 1 - max(lobe.colour)) for lobe in material.lobes), np.zeros(3)
    )
    expected = np.add(material.diffuse, covered)
    assert np.allclose(points["diffuse"][there, :3], expected, rtol=1e-5)
    assert (points["diffuse"][there, 3] == 1.0).all()
    total = np.zeros(3)
    for n in "01":
        total += (
            points[f"lobe{n}"][there, :3].astype(float) * points[f"shape{n}"][there, 3:]
        ).mean(axis=0)
    expected = sum((np.multiply(lobe.weight, lobe.colour) for lobe in material.lobes), np.zeros(3))
    assert np.allclose(total, expected, rtol=1e-5 if len(material.lobes) < 3 else 0.02)


def test_colour_bleeds(bench: Bench) -> None:
    """A photon takes the surface's colour, and keeps the mean of its channels, and its number."""
    red = MATERIALS[1]
    result = reflect(bench, red)
    alive = result["next_flux"].any(axis=1)
    expected = FLUX * red.diffuse
    expected *= FLUX.sum() / expected.sum()
    assert alive.any() and np.allclose(result["next_flux"][alive, :3], expected, rtol=1e-5)
    assert np.array_equal(result["next_flux"][alive, 3], np.flatnonzero(alive))


def test_black_kills_all(bench: Bench) -> None:
    result = reflect(bench, plain_material("black", (0.0, 0.0, 0.0)))
    assert result["alive"] == 0
    assert not any(result[name].any() for name in result if name != "alive")


def test_misses_are_dead(bench: Bench) -> None:
    result = reflect(bench, MATERIALS[2])  # albedo 1: all others live
    alive = result["next_flux"].any(axis=1)
    assert not alive[::10].any() and alive.sum() == result["alive"] == COUNT * 0.9
    assert np.array_equal(result["next_direction"].any(axis=1), alive)


def test_diffuse_directions(bench: Bench) -> None:
    """Cosine-distributed about the normal on the side the photon came from, whatever its way."""
    for direction in (INCOMING, -INCOMING):
        result = reflect(bench, MATERIALS[2], direction=direction)
        alive = result["next_flux"].any(axis=1)
        outgoing = result["next_direction"][alive, :3].astype(np.float64)
        cosine = outgoing[:, 2] * -np.sign(direction[2])
        assert cosine.min() > 0
        counts = np.histogram(cosine**2, 50, (0, 1 + 1e-6))[0]
        assert excess(counts, np.full(50, alive.sum() / 50)) < 1
        azimuth = np.histogram(np.arctan2(outgoing[:, 1], outgoing[:, 0]), 50, (-np.pi, np.pi))[0]
        assert excess(azimuth, np.full(50, alive.sum() / 50)) < 1
        origin = result["next_origin"][alive]
        assert (origin[:, 2] * -np.sign(direction[2]) > 0).all()  # lifted to that side
        assert np.abs(origin[:, :3] - [0, -1 / 6, 0]).max() < 3e-6
        assert (origin[:, 3] == 0).all()


def test_mirror_directions(bench: Bench) -> None:
    result = reflect(bench, plain_material("mirror", (0.0,) * 3, (1.0,) * 3, MIRROR))
    alive = result["next_flux"].any(axis=1)
    outgoing = result["next_direction"][alive]
    assert np.allclose(outgoing[:, :3], INCOMING * [1, 1, -1], atol=1e-6)
    assert (outgoing[:, 3] > 1e38).all()


def test_bounces_draw_other_numbers(bench: Bench) -> None:
    first, second = (reflect(bench, MATERIALS[0], bounce)["next_direction"] for bounce in (0, 1))
    both = first.any(axis=1) & second.any(axis=1)
    assert abs(both.sum() / (COUNT * 0.9) - 0.25) < 0.01  # 0.5 x 0.5
    assert (first[both] == second[both]).all(axis=1).mean() < 1e-3


# Projector.


def project(bench: Bench, material: Material) -> dict[str, Any]:
    values = {"seed": 1, "pass_index": 2, "bounce": 0}
    points = shade(bench, material, incoming(), values, PHOTONS)
    return bench.run(Projector, points, {"numbered": False, "bounce": 1})


@pytest.mark.parametrize("diffuse", [(0.5, 0.5, 0.5), (0.0, 0.0, 1e-3)])
def test_deposits_on_diffuse_surfaces(bench: Bench, diffuse: Any) -> None:
    result = project(bench, plain_material("some", diffuse, (0.3, 0.3, 0.3)))
    there = result["landed"][:, 3] != 0
    assert not there[::10].any() and there.sum() == result["alive"] == COUNT * 0.9
    assert np.allclose(result["landed"][there, :3], [0, -1 / 6, 0], atol=1e-6)
    assert (result["landed"][there, 3] == SURFACE + 1).all()
    assert np.array_equal(result["deposit"][there, :3], np.tile(np.float32(FLUX), (there.sum(), 1)))
    assert not result["landed"][~there].any() and not result["deposit"][~there].any()


@pytest.mark.parametrize("specular", [0.0, 0.9])
def test_no_deposit_elsewhere(bench: Bench, specular: float) -> None:
    result = project(bench, plain_material("chrome", (0.0, 0.0, 0.0), (specular,) * 3))
    assert result["alive"] == 0 and not result["landed"].any() and not result["deposit"].any()
