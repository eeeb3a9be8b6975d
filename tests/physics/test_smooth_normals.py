# SPDX-License-Identifier: GPL-3.0-or-later
"""Photons on triangles that stand for a bent surface: what leaves is what the eye sees there."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from addon.photon.scene import Lobe, Material, Scene, sun_light
from addon.streams import Device
from tests.measure import fallen, rendered
from tests.scenes import BLACK, Builder, camera, plain_material

WHITE = (1.0, 1.0, 1.0)
SETTINGS: dict[str, Any] = {
    "width": 8,
    "height": 8,
    "photons": 1_000_000,
    "radius": 0.3,
    "photon_bounces": 1,
    "passes": 1,
}


def tilted(lobe: Lobe, tilt: float, down: float = 0.0) -> Scene:
    """A flat square of one square metre, under a beam that falls at an angle, whose corners all
    have a normal that is tilted towards +x; and a box about it that is nearly black."""
    built = Builder().box((-3, -3, -3), (3, 3, 16), 1, "box", skip="+z -x")
    normal = (math.sin(tilt), 0.0, math.cos(tilt))
    square = [(-0.5, -0.5, 0.0), (0.5, -0.5, 0.0), (0.5, 0.5, 0.0), (-0.5, 0.5, 0.0)]
    built.add(square, [[0, 1, 2], [0, 2, 3]], 0, "square", np.tile(normal, (4, 1)))
    beam = sun_light("beam", WHITE, (math.sin(down), 0.0, -math.cos(down)), 0.0)
    lobes = Material("lobes", BLACK, (lobe,))
    return built.scene(
        camera((0, -2.5, 1), (0, 0, 0), 60), (beam,), [lobes, plain_material("box", (1e-4,) * 3)]
    )


def reflected(device: Device, scene: Scene, backend: str) -> float:
    """The flux [W] that falls on the box by way of the square, of a beam of 1 W/m^2."""
    with rendered(device, scene, **SETTINGS, backend=backend) as renderer:
        return float(fallen(renderer)[0, 0])


@pytest.mark.usefixtures("not_aimed")
@pytest.mark.thorough("20.0")
@pytest.mark.parametrize("backend", ["native", "compute"])
@pytest.mark.parametrize("tilt", [10.0, 20.0, 30.0])
def test_a_mirror(device: Device, backend: str, tilt: float) -> None:
    """A mirror whose normal is tilted shows the sun to places in the beam of its mirror direction,
    which is as wide as the square is from there."""
    out = math.cos(math.radians(2.0 * tilt))
    found = reflected(device, tilted(Lobe("mirror", WHITE), math.radians(tilt)), backend)
    assert found == pytest.approx(out, rel=0.01)


@pytest.mark.usefixtures("not_aimed")
@pytest.mark.parametrize("backend", ["native", "compute"])
def test_a_mirror_aslant(device: Device, backend: str) -> None:
    """A beam that comes from the side: by both cosines."""
    tilt, down = math.radians(-12.0), math.radians(40.0)
    found = reflected(device, tilted(Lobe("mirror", WHITE), tilt, down), backend)
    assert found == pytest.approx(math.cos(down + 2.0 * tilt), rel=0.01)


@pytest.mark.usefixtures("not_aimed")
@pytest.mark.parametrize("tilt", [20.0, 40.0])
def test_glass(device: Device, tilt: float) -> None:
    """Light that is refracted into a body keeps its flux about the tilted normal."""
    parameters = {"ior": 1.5, "tint": WHITE, "reflects": 0.0, "open": 0.0}
    met = math.radians(tilt)
    inside = math.asin(math.sin(met) / 1.5)
    expected = math.cos(met) / math.cos(inside) * math.cos(met - inside)
    found = reflected(device, tilted(Lobe("glass", WHITE, parameters), met), "compute")
    assert found == pytest.approx(expected, rel=0.01)
