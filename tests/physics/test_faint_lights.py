# SPDX-License-Identifier: GPL-3.0-or-later
"""A faint emissive mesh of many triangles beside a sun that brings a million times its flux."""

from __future__ import annotations

import numpy as np
import pytest

from addon.photon.scene import BLACK, Material, sun_light
from addon.streams import Device
from tests.measure import render
from tests.scenes import Builder, camera, icosphere


def test_its_light_stays(device: Device) -> None:
    """As much as without the sun, which shines from below: by shadow rays, and by photons between a
    floor and a wall."""
    built = Builder()
    vertices, faces = icosphere(4)
    built.add(0.1 * np.asarray(vertices) + (0.0, 0.0, 0.5), faces, 1)
    built.quad((-60, -60, 0), (60, -60, 0), (60, 60, 0), (-60, 60, 0))
    built.quad((-1, 0.6, 0), (1, 0.6, 0), (1, 0.6, 1.5), (-1, 0.6, 1.5))
    glow = Material("glow", BLACK, (), (0.5, 0.5, 0.5))
    materials = [Material("white", (0.7, 0.7, 0.7)), glow]
    eye = camera((0.3, -1.5, 0.8), (0.0, 0.3, 0.2), 30)
    sun = sun_light("Sun", (3.0, 3.0, 3.0), (0.0, 0.0, 1.0))
    settings = {"width": 24, "height": 24, "passes": 8, "photons": 20000}
    alone, beside = (
        render(device, built.scene(eye, lights, materials), **settings) for lights in ([], [sun])
    )
    for name, off in (("Direct", 0.03), ("Indirect", 0.06)):
        assert beside[name].mean() == pytest.approx(alone[name].mean(), rel=off)
