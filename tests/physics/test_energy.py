# SPDX-License-Identifier: GPL-3.0-or-later
"""Exact cases 5 and 6: where emitted energy ends up, and how much of it plates exchange."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from addon.photon.scene import Scene
from addon.streams import Device
from tests.measure import SEEDS, fallen, over_seeds, relative_bound, rendered
from tests.scenes import (
    DIM,
    UNIT_INTENSITY,
    Builder,
    camera,
    orthographic,
    plain_light,
    plain_material,
)


def open_sphere(albedo: float) -> tuple[Scene, float]:
    """A unit sphere with a hole, in a box that catches what leaves; the hole's share of it."""
    ball = Builder().sphere((0, 0, 0), 1.0, subdivisions=5)
    triangles = ball.triangles[0]
    kept = ball.vertices[0][triangles].mean(axis=1)[:, 2] < 0.6
    # The solid angle of the triangles that are left out (Van Oosterom & Strackee 1983).
    a, b, c = ball.vertices[0][triangles[~kept]].transpose(1, 0, 2)
    volume = np.abs(np.einsum("ij,ij->i", a, np.cross(b, c)))
    sums = (
        1 + np.einsum("ij,ij->i", a, b) + np.einsum("ij,ij->i", b, c) + np.einsum("ij,ij->i", c, a)
    )
    hole = float((2 * np.arctan2(volume, sums)).sum() / (4 * math.pi))
    ball.triangles[0], ball.normals[0] = triangles[kept], ball.normals[0][kept]
    ball.material[0], ball.surface[0] = ball.material[0][kept], ball.surface[0][kept]
    ball.box((-2, -2, -2), (2, 2, 2), 1)
    light = plain_light("light", "POINT", (0, 0, 0), (UNIT_INTENSITY,) * 3)
    wall = plain_material("wall", (albedo,) * 3)
    return ball.scene(camera((0, 0, 0), (1, 0, 0)), [light], [wall, DIM]), hole


@pytest.mark.parametrize(("albedo", "bounces"), [(0.7, 64), (1.0, 5)])
def test_case_5_energy_ledger(device: Device, albedo: float, bounces: int) -> None:
    """Emitted = absorbed + escaped + cut off, each by its closed form, 0.5 % of what is emitted.

    Wherever light leaves a sphere's wall, it falls evenly on the whole: each bounce loses the
    hole's share.
    """
    scene, hole = open_sphere(albedo)
    photons, ledgers = 20000, []
    for seed in range(SEEDS):
        settings: dict[str, Any] = {"photon_bounces": bounces, "photons": photons, "seed": seed}
        with rendered(device, scene, direct_by_photons=True, width=1, height=1, **settings) as made:
            wall, catcher = fallen(made)[:, 0]
            cut_off = made.info()["unfinished_photons"] / photons * UNIT_INTENSITY
        ledgers.append([(1 - albedo) * wall, catcher / (1 + DIM.diffuse[0]), cut_off])
    kept = albedo * (1 - hole)
    arrivals = (1 - kept ** (bounces + 1)) / (1 - kept)
    expected = np.array([(1 - albedo) * (1 - hole), hole]) * arrivals
    expected = np.append(expected, kept ** (bounces + 1)) * UNIT_INTENSITY
    assert expected.sum() == pytest.approx(UNIT_INTENSITY)
    ledgers = np.array(ledgers)
    assert relative_bound(ledgers.sum(axis=1), UNIT_INTENSITY) <= 0.005
    assert relative_bound(ledgers - expected + UNIT_INTENSITY, [UNIT_INTENSITY] * 3) <= 0.005


def parallel_squares(distance: float) -> float:
    """Form factor of unit squares that face each other (Howell, configuration C-11)."""
    x2 = 1 + 1 / distance**2
    x = 1 / distance
    root = math.sqrt(x2)
    terms = math.log(math.sqrt(x2 * x2 / (1 + 2 * x * x)))
    terms += 2 * x * root * math.atan(x / root) - 2 * x * math.atan(x)
    return 2 / (math.pi * x * x) * terms


def perpendicular_squares() -> float:
    """Form factor of unit squares with a common edge (Howell, configuration C-14)."""
    angles = 2 * math.pi / 4 - math.sqrt(2) * math.atan(1 / math.sqrt(2))
    return (angles + 0.25 * math.log(4 / 3 * (3 / 4) * (3 / 4))) / math.pi


def plates(kind: str) -> tuple[Scene, float]:
    """A lit square, one that receives from it, seen by the camera; and their form factor."""
    b = Builder().quad((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), 0)
    if kind == "parallel":
        b.quad((0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1), 1)
        view = orthographic((0.5, 0.5, 0.5), (1, 0, 0), (0, -1, 0), 1.0)
        aside, factor = math.radians(60), parallel_squares(1.0)
    else:
        b.quad((0, 0, 0), (0, 1, 0), (0, 1, 1), (0, 0, 1), 1)
        view = orthographic((0.5, 0.5, 0.5), (0, 1, 0), (0, 0, 1), 1.0)
        aside, factor = math.radians(20), perpendicular_squares()
    # From far away and aside, so that the receiver casts no shadow on the lit square.
    towards = np.array([math.sin(aside), 0.0, math.cos(aside)])
    distance = 1000.0
    place = np.array([0.5, 0.5, 0.0]) + distance * towards
    power = UNIT_INTENSITY * distance**2 / math.cos(aside)  # one watt on the square
    light = plain_light(
        "far",
        "SPOT",
        tuple(place),
        (power,) * 3,
        tuple(-towards),
        spot_size=2 * math.atan(0.75 / distance),
        spot_blend=0.0,
    )
    return b.scene(view, [light], [plain_material("white", (0.8,) * 3), DIM]), factor


@pytest.mark.thorough("parallel")
@pytest.mark.parametrize("kind", ["parallel", "perpendicular"])
def test_case_6_form_factors(device: Device, kind: str) -> None:
    """What one square receives of the other's light: albedo x form factor, 1 %."""
    scene, factor = plates(kind)
    values = over_seeds(
        device,
        scene,
        lambda im: im["Indirect"].mean(),
        radius=0.05,
        photons=100000,
        passes=4,
        photon_bounces=1,
    )
    assert factor == pytest.approx(0.1998 if kind == "parallel" else 0.2000, abs=1e-4)
    assert relative_bound(values, DIM.diffuse[0] / math.pi * 0.8 * factor) <= 0.01
