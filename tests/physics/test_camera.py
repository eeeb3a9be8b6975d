# SPDX-License-Identifier: GPL-3.0-or-later
"""What the camera makes of edges, discs and directions, against closed forms."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from addon.photon.scene import Scene
from addon.streams import Device
from tests.measure import render
from tests.scenes import Builder, closed_sphere, orthographic


def half_plane() -> Scene:
    """One metre a pixel of 16 x 4; what is left of x = 0 is covered."""
    plate = Builder().quad((-90, -90, 0), (0, -90, 0), (0, 90, 0), (-90, 90, 0))
    view = orthographic((0, 0, 1), (1, 0, 0), (0, 1, 0), 16.0)
    window = (-8.0, 8.0, -2.0, 2.0)
    return plate.scene(type(view)(view.kind, view.matrix, window))


def below(name: str, width: float, x: float) -> float:
    """The share of a filter below an offset [px]."""
    if name == "box":
        return min(max(x + 0.5, 0.0), 1.0)
    if name == "gauss":
        return 0.5 * (1.0 + math.erf(x / (width / 4.0) / math.sqrt(2.0)))
    u = min(max(x / (2.0 * width) + 0.5, 0.0), 1.0)
    sines = (-0.48829, 0.14128 / 2, -0.01168 / 3)
    turn = 2.0 * math.pi
    return u + sum(b * math.sin(turn * k * u) for k, b in enumerate(sines, 1)) / (turn * 0.35875)


@pytest.mark.parametrize(
    ("name", "width"),
    [
        *(("box", width) for width in (1.0, 3.0)),
        *(("gauss", width) for width in (0.01, 1.5)),
        *(("blackman_harris", width) for width in (0.0, 1.5, 4.0)),
    ],
)
def test_an_edge_has_the_filters_spread(device: Device, name: str, width: float) -> None:
    film = {"pixel_filter": name, "pixel_width": width, "transparent": True}
    images = render(device, half_plane(), width=16, height=4, photons=0, passes=512, **film)
    alpha = images["Combined"][..., 3]
    centres = np.arange(16) - 7.5
    if width == 0.0:
        expected = [1.0 if x < 0 else 0.0 for x in centres]
    else:
        expected = [1.0 - below(name, width, x) for x in centres]
    np.testing.assert_allclose(alpha, np.tile(expected, (4, 1)), atol=0.005)


def test_exposure_multiplies_light_alone(device: Device) -> None:
    settings: dict[str, Any] = {"photons": 5000, "passes": 8, "radius": 0.2}
    plain = render(device, closed_sphere(0.5), **settings)
    brighter = render(device, closed_sphere(0.5), exposure=2.5, **settings)
    for name, image in plain.items():
        factor = (
            np.ones(image.shape[2]) if name in ("Depth", "Normal") else np.full(image.shape[2], 2.5)
        )
        if name == "Combined":
            factor[3] = 1.0
        np.testing.assert_allclose(brighter[name], image * factor, rtol=1e-6)
