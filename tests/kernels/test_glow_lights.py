# SPDX-License-Identifier: GPL-3.0-or-later
"""Balls that emit all through: what samples of them bring, and where photons start."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from addon.photon.scene import glow_light
from tests.kernels.conftest import Bench
from tests.kernels.light_probe import COUNT, EMIT, FLUX, FRAME, SAMPLE, numbers, probe
from tests.kernels.test_seen_lights import MIDDLE, POWER, SIGMAS, at_scene

RADIUS = 0.7
GLOW = glow_light("glow", at_scene(MIDDLE), POWER, RADIUS * FRAME.scale)
EMITTED = np.array(POWER) / FRAME.scale**2  # [W / scene units^2]


def brought(bench: Bench, place: Any, normal: Any) -> tuple[Any, Any]:
    """Irradiance, and its standard error."""
    many = np.broadcast_to(place, (COUNT, 3))
    found, light = probe(bench, GLOW, SAMPLE, many, numbers(31)[0], normal)
    cosine = np.maximum(found[:, :3] @ normal, 0.0)
    each = light[:, :3] * (light[:, 3:] * cosine[:, None])
    return each.mean(axis=0), each.std(axis=0) / math.sqrt(COUNT)


@pytest.mark.parametrize("distance", (0.3, 0.69, 0.75, 2.0, 40.0))
def test_samples_bring_what_it_emits(one_bench: Bench, distance: float) -> None:
    """From both sides of a plane that faces it in all P / (4 pi d^2), within P d / (4 pi r^3): as
    if what is farther in were in the middle (Newton)."""
    way = np.array((0.48, -0.6, 0.64))
    sides = [brought(one_bench, MIDDLE - distance * way, sign * way) for sign in (1.0, -1.0)]
    expected = EMITTED / (4.0 * math.pi) * min(distance / RADIUS**3, distance**-2)
    error = SIGMAS * np.hypot(sides[0][1], sides[1][1])
    assert (error < 0.05 * expected).all()
    assert (np.abs(sides[0][0] - sides[1][0] - expected) <= error + 1e-4 * expected).all()
    if distance > RADIUS:
        assert not sides[1][0].any()


@pytest.mark.parametrize("distance", (0.3, 2.0))
def test_samples_end_in_it(one_bench: Bench, distance: float) -> None:
    """Anywhere on the way through."""
    place = MIDDLE - distance * np.array((0.48, -0.6, 0.64))
    many = np.broadcast_to(place, (COUNT, 3))
    found, _ = probe(one_bench, GLOW, SAMPLE, many, numbers(32)[0], (0.0, 0.0, 1.0))
    way = place + found[:, 3:] * found[:, :3] - MIDDLE
    along = (way * found[:, :3]).sum(axis=1)
    half = np.sqrt(np.maximum(RADIUS**2 - (way**2).sum(axis=1) + along**2, 0.0))
    first = np.maximum(-half, along - found[:, 3])
    part = (along - first) / (half - first)
    assert part.min() > -1e-3 and part.max() < 1.001
    counts = np.histogram(part, 8, (0.0, 1.0))[0]
    assert np.abs(counts - COUNT / 8).max() < SIGMAS * math.sqrt(COUNT / 8) + 0.002 * COUNT


def test_photons_start_all_through(one_bench: Bench) -> None:
    """As many wherever they are, and whereto they go."""
    origin, direction = (x[:, :3] for x in probe(one_bench, GLOW, EMIT, *numbers(33)))
    inside = ((origin - MIDDLE) ** 2).sum(axis=1) ** 1.5 / RADIUS**3
    assert inside.max() < 1.0001
    for part in (inside, (1.0 + direction[:, 2]) / 2, (1.0 + (origin - MIDDLE)[:, 0] / RADIUS) / 2):
        assert part.min() >= 0.0 and part.max() <= 1.0001
    for part in (inside, (1.0 + direction[:, 2]) / 2):
        counts = np.histogram(part, 8, (0.0, 1.0001))[0]
        assert np.abs(counts - COUNT / 8).max() < SIGMAS * math.sqrt(COUNT / 8) + 0.002 * COUNT
    across = ((origin - MIDDLE) * direction).sum(axis=1) / RADIUS
    error = SIGMAS * math.sqrt(0.2 / COUNT)
    assert across.mean() == pytest.approx(0.0, abs=error)
    assert (across**2).mean() == pytest.approx(0.2, abs=error)


def test_flux(one_bench: Bench) -> None:
    flux, _ = probe(one_bench, GLOW, FLUX, np.zeros((1, 3)), np.zeros((1, 3)))
    assert flux[0, :3] == pytest.approx(EMITTED, rel=1e-5)
