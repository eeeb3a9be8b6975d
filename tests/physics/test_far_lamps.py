# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps far from small things: their photons are aimed before any of them tells."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import photon_stream_native as native
import pytest

from addon.photon.photons import aim, toward
from addon.photon.scene import Light, Scene, point_light, spot_light, sun_light, world_light
from addon.streams import Device
from tests.physics.test_aim import WALL, images_of
from tests.scenes import Builder, camera


@pytest.fixture(autouse=True)
def soon(monkeypatch: pytest.MonkeyPatch) -> None:
    """A single light is asked for before pass 1, as several are."""
    monkeypatch.setattr(aim, "PASSES_OF_ONE", 1)


def small_things(*lights: Light) -> Scene:
    """On a plate of 0.4 m."""
    built = Builder().quad((-0.2, -0.2, 0), (0.2, -0.2, 0), (0.2, 0.2, 0), (-0.2, 0.2, 0))
    built.sphere((0, 0, 0.06), 0.06).box((0.08, -0.05, 0), (0.14, 0.05, 0.09))
    return built.scene(camera((0.3, -0.5, 0.5), (0.0, 0.0, 0.03), 35), lights, [WALL])


@pytest.mark.thorough("fragment", "300")
@pytest.mark.parametrize("distance", (7.0, 300.0))
@pytest.mark.parametrize("kind", (point_light, spot_light), ids=("point", "spot"))
@pytest.mark.parametrize("backend", ("native", "fragment", "compute"))
def test_a_lamp_far_from_small_things(
    device: Device, backend: str, kind: Any, distance: float
) -> None:
    """Alone, and beside a world that lights them, too: it brings what a sun does, with more noise
    the farther it is. Median of three seeds: one of a dozen has a photon that is a fifth of all."""
    way = np.array((0.5, 0.1, 0.86)) * distance
    more = {"direction": tuple(-way), "size": 1.0, "blend": 0.0} if kind is spot_light else {}
    lamp = kind("lamp", tuple(way), (20.0 * distance**2,) * 3, **more)
    sun = sun_light("sun", (5.0 / math.pi,) * 3, tuple(-way))
    world = world_light("world", (0.02,) * 3)
    means = []
    for lights in ((sun,), (lamp,), (sun, world), (lamp, world)):
        settings = {"photons": 20000, "passes": 16, "backend": backend}
        of_seeds = [
            images_of(device, small_things(*lights), seed=seed, **settings)["Indirect"]
            for seed in range(3)
        ]
        means.append(np.median([indirect.mean(dtype=float) for indirect in of_seeds]))
    noise = 0.05 if distance < 100.0 else 0.12
    assert means[1] == pytest.approx(means[0], rel=noise)
    assert means[3] == pytest.approx(means[2], rel=noise)


def test_where_far_photons_go() -> None:
    """Trees hold boxes that a turn's beginning cuts in two, with half of all numbers."""
    turn = np.linspace(0.995, 1.005, 101) % 1.0
    numbers = np.full((101, 4), 0.5)
    numbers[:, 0], numbers[:, 1] = np.linspace(0.2, 0.203, 101), turn
    numbers[:, 2:] = np.random.default_rng(1).random((101, 2))
    boxes = toward.boxes_of(numbers.astype(np.float32))
    assert len(boxes) == 2
    tree = toward.tree_about(boxes)
    density = native.aim_pdf(tree, numbers.astype(np.float32))
    area = sum(np.prod(high - low) for low, high in boxes)
    assert (density > 0.2 * 0.5 / area).all()
    anywhere = np.random.default_rng(2).random((4096, 4)).astype(np.float32)
    assert np.median(native.aim_pdf(tree, anywhere)) == pytest.approx(0.5, abs=0.05)


def test_rays_that_pass_by() -> None:
    """Of a box of 2 m: one meets it, two do not, and one goes the other way; and there is none."""
    low, high = np.full(3, -1.0), np.full(3, 1.0)
    rays = np.zeros((5, 6))
    rays[:, 0] = -10.0
    rays[:4, 3], rays[1, 1], rays[2, 2] = 1.0, 3.0, 4.0
    rays[3, 3] = -1.0
    found = toward.missed_by(rays, low, high)
    assert found == pytest.approx([0.0, 3.0, 4.0, math.hypot(10.0, 10.0), np.inf])
