# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadow rays to a light's sphere: spread evenly over the cone that it fills, and ending on it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from addon.photon.kernels.direct import ShadowRays
from addon.photon.stage.geometry import Frame
from addon.photon.stage.light_tables import light_table
from addon.photon.stage.switches import made_bsdf, made_lights
from tests.kernels.conftest import Bench
from tests.kernels.statistics import excess
from tests.scenes import plain_light

WIDTH, HEIGHT = Bench.WIDTH, 64
COUNT = WIDTH * HEIGHT
HERE = Frame(np.zeros(3), 1.0)
RINGS, SECTORS = 32, 16


@pytest.mark.parametrize("radius", [1e-3, 0.3, 0.9, 0.99])
def test_directions_to_a_sphere(bench: Bench, radius: float) -> None:
    """At distance 1, from the centre of a floor that faces the light."""
    axis = np.array([0.36, 0.48, 0.8])
    lamp = plain_light("lamp", "POINT", tuple(axis), (1.0, 1.0, 1.0), radius=radius)
    point = np.zeros((COUNT, 4), np.float32)
    facing = np.tile(np.float32([*axis, 0.0]), (COUNT, 1))
    there = point + np.float32([0, 0, 0, 1])
    diffuse = np.tile(np.float32([0.5, 0.5, 0.5, 1.0]), (COUNT, 1))
    points = {"place": there, "facing": facing, "shading": facing, "diffuse": diffuse}
    result = bench.run(
        ShadowRays,
        points | {"direction": -facing},
        {"seed": 7, "pass_index": 2, "depth": 0, "number": 0} | {"frame_size": (WIDTH, HEIGHT)},
        {"lights": light_table((lamp,), HERE)},
        {"SHADOW_RAYS": 1},
        made={**made_bsdf(()), **made_lights({"point"})},
    )
    shadow = result["shadow_direction"].astype(np.float64)
    direction, far = shadow[:, :3], shadow[:, 3]
    assert np.abs(np.linalg.norm(direction, axis=1) - 1).max() < 1e-6
    # Uniform in solid angle: in 1 - cos, and in azimuth about the axis, independently.
    away = direction - axis
    versine = (away**2).sum(axis=1) / 2
    widest = 2 * math.sin(math.asin(radius) / 2) ** 2
    side = np.cross(axis, [0.0, 0.0, 1.0])
    side /= np.linalg.norm(side)
    azimuth = np.arctan2(away @ np.cross(axis, side), away @ side)
    assert versine.max() < widest * (1 + 1e-3)
    share = np.minimum(versine / widest, 1.0)
    bins = [np.linspace(0, 1, RINGS + 1), np.linspace(-np.pi, np.pi, SECTORS + 1)]
    counts = np.histogram2d(share, azimuth, bins)[0]
    assert excess(counts, np.full(counts.shape, COUNT / counts.size)) < 1
    assert excess(counts.sum(axis=1), np.full(RINGS, COUNT / RINGS)) < 1
    assert excess(counts.sum(axis=0), np.full(SECTORS, COUNT / SECTORS)) < 1
    # The ray ends where it first meets the sphere, but for what it was lifted.
    met = direction * far[:, None]
    off = np.linalg.norm(met - axis, axis=1) - radius
    assert np.abs(off).max() < 5e-4 * radius + 1e-5
    assert (met @ axis).max() < 1 + 1e-5  # on the near side
