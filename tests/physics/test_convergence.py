# SPDX-License-Identifier: GPL-3.0-or-later
"""Exact case 12: how fast the error falls with passes, against a closed form in each pixel."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from addon.photon.scene import Scene
from addon.streams import Device
from tests.measure import rendered
from tests.scenes import GREY, Builder, orthographic, plain_light

SIZE, HEIGHT, POWER = 16, 1.0, 100.0
PASSES = (4, 8, 16, 32, 64, 128, 256)


def floor_under_a_lamp(radius: float) -> tuple[Scene, Any]:
    """A floor under a point or sphere light, and the radiance of its pixels.

    A sphere of even radiance that is all above the horizon lights as a point in its centre does.
    """
    floor = Builder().quad((-3, -3, 0), (3, -3, 0), (3, 3, 0), (-3, 3, 0))
    light = plain_light("lamp", "POINT", (0, 0, HEIGHT), (POWER,) * 3, radius=radius)
    view = orthographic((0, 0, 0.2), (1, 0, 0), (0, 1, 0), 1.0)
    fine = 8
    at = ((np.arange(SIZE * fine) + 0.5) / (SIZE * fine) - 0.5) * 1.0
    x, y = np.meshgrid(at, at)
    radiance = 0.5 / math.pi * POWER / (4 * math.pi) * HEIGHT / (x * x + y * y + HEIGHT**2) ** 1.5
    truth = radiance.reshape(SIZE, fine, SIZE, fine).mean(axis=(1, 3))
    return floor.scene(view, [light], [GREY]), truth


def slope(device: Device, scene: Scene, truth: Any, image: str, **settings: Any) -> float:
    """Of the log of the root mean square error against the log of the number of passes."""
    squares = np.zeros(len(PASSES))
    for seed in range(8):
        with rendered(device, scene, width=SIZE, height=SIZE, seed=seed, **settings) as renderer:
            for column, passes in enumerate(PASSES):
                while renderer.film.passes < passes:
                    renderer.render_pass()
                error = renderer.images()[image][..., 0] / truth - 1
                squares[column] += (error**2).mean()
    return float(np.polyfit(np.log(PASSES), np.log(squares) / 2, 1)[0])


@pytest.mark.usefixtures("not_aimed")
def test_case_12_photons(device: Device) -> None:
    """Probabilistic progressive photon mapping: alpha = 2/3 gives N^(-1/3) (Knaus & Zwicker), of so
    few photons that their even starts don't take most of the noise."""
    scene, truth = floor_under_a_lamp(0.0)
    settings: dict[str, Any] = {
        "direct_by_photons": True,
        "radius_decay": 2 / 3,
    }
    found = slope(device, scene, truth, "Indirect", photons=250, radius=0.2, **settings)
    print(f"slope {found:.3f}")
    assert -0.40 <= found <= -0.25


def test_case_12_direct_light(device: Device) -> None:
    """Randomised quasi-Monte Carlo on a sphere light, by sixteens of a half of the passes: better
    than N^(-1/2), no better than N^(-1)."""
    scene, truth = floor_under_a_lamp(0.4)
    found = slope(device, scene, truth, "Direct", photons=0)
    print(f"slope {found:.3f}")
    assert -0.9 <= found <= -0.65
