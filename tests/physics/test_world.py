# SPDX-License-Identifier: GPL-3.0-or-later
"""A world of one radiance lights by closed forms: by shadow rays, by photons and by lobes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from addon.photon.scene import Lobe, Material, world_light
from addon.streams import Device
from tests.measure import fallen, render, rendered
from tests.scenes import Builder, orthographic, plain_material

SKY = (1.0, 0.5, 0.25)
WHITE = (1.0, 1.0, 1.0)
SETTINGS: dict[str, Any] = {"width": 24, "height": 24}


def ball(material: Material) -> Any:
    """A ball that fills the picture's middle, before nothing."""
    view = orthographic((0, 0, 3), (1, 0, 0), (0, 1, 0), 0.8)
    built = Builder().sphere((0, 0, 0), 1.0, subdivisions=5)
    return built.scene(view, [world_light("sky", SKY)], [material])


def on_ball(image: Any) -> Any:
    return image[6:18, 6:18, :3].mean(axis=(0, 1))


def test_furnace(device: Device) -> None:
    """A convex body of albedo rho shows rho times the sky, by shadow rays."""
    scene = ball(plain_material("grey", (0.6, 0.4, 0.2)))
    images = render(device, scene, **SETTINGS, passes=16, photons=0)
    np.testing.assert_allclose(on_ball(images["Combined"]), np.multiply(SKY, (0.6, 0.4, 0.2)), 5e-3)
    np.testing.assert_array_equal(images["Combined"][6:18, 6:18, :3], images["Direct"][6:18, 6:18])


@pytest.mark.usefixtures("not_aimed")
def test_furnace_by_photons(device: Device) -> None:
    """What falls on it is pi times the sky on all of its area."""
    scene = ball(plain_material("grey", (0.6, 0.4, 0.2)))
    corners = scene.vertices[scene.triangles]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(across, axis=1).sum() / 2
    settings: dict[str, Any] = SETTINGS | {"photons": 1_000_000, "radius": 0.2}
    with rendered(device, scene, **settings, direct_by_photons=True) as renderer:
        assert not renderer.images()["Direct"].any()
        np.testing.assert_allclose(fallen(renderer)[0], np.multiply(SKY, np.pi * area), 5e-3)


@pytest.mark.parametrize("alpha", [0.0, 0.01, 0.09, 0.36, 1.0])
@pytest.mark.parametrize("found_by", ["both", "lobes", "shadow rays"])
def test_white_furnace(device: Device, alpha: float, found_by: str) -> None:
    """Whatever its roughness, what absorbs nothing shows the sky: by rays of lobes, by shadow rays,
    and by both, each in its share."""
    if alpha == 0.0:
        lobe = Lobe("mirror", WHITE)
    else:
        parameters = {"alpha_x": alpha, "alpha_y": alpha, "turn": 0.0, "compensated": 1.0}
        lobe = Lobe("ggx", WHITE, parameters)
    scene = ball(Material("white", (0.0,) * 3, (lobe,)))
    found = {"lobes": ("chains",), "shadow rays": ("glossy",), "both": ("glossy", "chains")}
    if found_by == "shadow rays" and alpha < 0.3:
        pytest.skip("a sharp lobe by shadow rays to all of the sky is noise")
    light = world_light("sky", SKY, found[found_by])
    scene = type(scene)(**{**vars(scene), "lights": (light,)})
    images = render(device, scene, **SETTINGS, passes=80, photons=0)
    np.testing.assert_allclose(on_ball(images["Combined"]), SKY, 8e-3)
