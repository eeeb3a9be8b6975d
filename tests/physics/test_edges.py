# SPDX-License-Identifier: GPL-3.0-or-later
"""Pixels that show an edge and what is behind it: each place counts as much as is seen of it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from addon.photon.scene import Scene
from addon.streams import Device
from tests.measure import render, render_clean
from tests.scenes import GREY, Builder, orthographic, plain_light

SIDE, PIXELS = 0.5, 8
BORDER = SIDE / PIXELS / 2  # the plate's: half of a pixel's column
RADIUS = 0.06
SETTINGS: dict[str, Any] = {"width": PIXELS, "height": PIXELS, "passes": 64, "photon_bounces": 1}


def plate_over_floor(strips: int) -> Scene:
    """A plate of that many strips near a lamp, and past its border a floor of a fifteenth of its
    light."""
    built = Builder().quad((-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0))
    ends = np.linspace(-1, 1, strips + 1)
    vertices = [(x, y, 1.5) for y in ends for x in (-1.0, BORDER)]
    corners = np.array([(0, 1, 3), (0, 3, 2)])
    triangles = (corners + 2 * np.arange(strips)[:, None, None]).reshape(-1, 3)
    built.add(vertices, triangles)
    lamp = plain_light("lamp", "POINT", (0.1, 0.0, 2.0), (10.0,) * 3)
    view = orthographic((0, 0, 2.5), (1, 0, 0), (0, 1, 0), SIDE)
    return built.scene(view, [lamp], [GREY])


@pytest.mark.thorough("compute", "fragment")  # which compile for longer
@pytest.mark.parametrize(
    ("backend", "strips"), [("native", 1), ("native", 60), ("compute", 1), ("fragment", 1)]
)
def test_an_edge_before_a_floor(device: Device, backend: str, strips: int) -> None:
    """Of discs near the border 0.7 lie on the plate. By a quotient of means alone it would count so
    much less in the pixels that show it and the floor, and they would be 15 % too dark."""
    scene = plate_over_floor(strips)
    photons = {"direct_by_photons": True, "radius": RADIUS, "photons": 60000, "backend": backend}
    found = render_clean(device, scene, **photons, **SETTINGS)["Indirect"][..., 0]
    right = render(device, scene, **SETTINGS)["Direct"][..., 0]
    ratio = found.mean(axis=0) / right.mean(axis=0)
    np.testing.assert_allclose(np.delete(ratio, PIXELS // 2), 1.0, atol=0.02)
    assert 0.94 < ratio[PIXELS // 2] < 1.02
