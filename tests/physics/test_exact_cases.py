# SPDX-License-Identifier: GPL-3.0-or-later
"""Exact cases 1 to 9: closed forms, so nobody's renderer is the reference."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from addon.photon.scene import Scene
from addon.streams import Device
from tests.measure import MIDDLES, over_seeds, relative_bound, render
from tests.scenes import (
    DIM,
    UNIT_INTENSITY,
    Builder,
    closed_sphere,
    lit_plate,
    orthographic,
    plain_light,
    plain_material,
)
from tests.stability.table import Measured


@pytest.mark.stability(1)
def test_case_1_closed_sphere(device: Device, measured: Measured) -> None:
    """L = rho / pi (E_direct + E_indirect) everywhere, 0.5 %."""
    values = over_seeds(
        device,
        closed_sphere(0.5),
        lambda im: [im["Direct"].mean(), im["Indirect"].mean()],
        radius=0.1,
        photons=150000,
    )
    expected = 0.5 / math.pi  # E_direct = 1; E_indirect = rho / (1 - rho) = 1
    assert measured("bias", relative_bound(values, [expected, expected]), "%") <= 0.005


def test_case_2_mirror_and_diffuse_ledger(device: Device) -> None:
    """k_d = 0.25 and k_s = 0.5: E = 1 / (1 - 0.75), L = k_d E / pi / (1 - k_s), 0.5 %."""
    values = over_seeds(
        device,
        closed_sphere(0.25, 0.5),
        lambda im: im["Combined"][..., :3].mean(),
        radius=0.1,
        mirror_depth=40,
        photons=60000,
    )
    assert relative_bound(values, 0.25 / math.pi * 4.0 / 0.5) <= 0.005


@pytest.mark.thorough("0.1-", "0.02-", "0.5-8000")
@pytest.mark.parametrize(
    ("radius", "photons", "passes"),
    [(0.02, 250000, 1), (0.1, 150000, 1), (0.5, 100000, 1), (0.5, 8000, 64)],
)
@pytest.mark.stability(9)
def test_case_3_any_radius_on_a_sphere(
    device: Device, measured: Measured, radius: float, photons: int, passes: int
) -> None:
    """A cap of chord r has area pi r^2: a constant kernel is unbiased at every r, 0.5 %.

    So is the corrected one, to the number of its probes: over passes, its share tends to one.
    """
    values = over_seeds(
        device,
        closed_sphere(0.5),
        lambda im: im["Indirect"].mean(),
        radius=radius,
        filter="constant",
        boundary_correction=passes > 1,
        photons=photons,
        passes=passes,
        width=64,
        height=64,
    )
    bound = relative_bound(values, 0.5 / math.pi)
    assert measured("bias at radii of 0.02 to 0.5 of the sphere's", bound, "%") <= 0.005


def disc_share(x: Any, y: Any, radius: float) -> Any:
    """Share of a disc about (x, y) that lies in the quadrant x' > 0, y' > 0; by integration."""
    t = (np.arange(400) + 0.5) / 400 * 2 - 1
    u, v = np.meshgrid(t, t)
    inside = u**2 + v**2 < 1
    u, v = u[inside] * radius, v[inside] * radius
    return ((x[..., None] + u > 0) & (y[..., None] + v > 0)).mean(axis=-1)


def mean_side(image: Any) -> Any:
    """Each side and corner the mean of the plate's four, which are alike: few photons tell."""
    return np.mean([np.rot90(image, turns) for turns in range(4)], axis=0)


def test_case_4_uncorrected_edge_bias(device: Device) -> None:
    """At an edge and in a corner the plain estimator loses exactly the disc's missing part."""
    scene, irradiance = lit_plate()
    radius, n = 0.25, 64
    radiance = 0.5 / math.pi * irradiance

    def measure(images: dict[str, Any]) -> Any:
        image = mean_side(images["Indirect"][..., 0] / radiance)
        columns = image[n // 4 : -n // 4, : n // 4].mean(axis=0)
        corner = image[:2, :2].mean()
        return np.concatenate([columns, [corner]])

    values = over_seeds(
        device,
        scene,
        measure,
        direct_by_photons=True,
        boundary_correction=False,
        filter="constant",
        radius=radius,
        photons=25000,
        passes=9,
        width=n,
        height=n,
    )
    # The columns' pixels cover [i, i + 1] * 2 / n from the edge; the mean of the closed form there.
    d = (np.arange(n // 4)[:, None] + (np.arange(8) + 0.5) / 8) * 2 / n
    x = np.clip(d / radius, 0, 1)
    edge = (1 - (np.arccos(x) - x * np.sqrt(1 - x * x)) / math.pi).mean(axis=1)
    fine = (np.arange(16) + 0.5) / 8 * 2 / n
    corner = disc_share(*np.meshgrid(fine, fine), radius).mean()
    assert abs(edge[0] - 0.5) < 0.05 and abs(corner - 0.25) < 0.1  # the closed form's own limits
    assert relative_bound(values, np.append(edge, corner)) <= 0.01


@pytest.mark.stability(4, 5)
@pytest.mark.thorough("epanechnikov")
@pytest.mark.parametrize("kernel", ["constant", "epanechnikov"])
def test_case_4_corrected(device: Device, measured: Measured, kernel: str, thorough: bool) -> None:
    """The corrected estimator shows the truth: 2 % in the edge's band, 3 % in the corner."""
    scene, irradiance = lit_plate()
    radius, n = 0.25, 64
    band = int(radius * n / 2)

    def measure(images: dict[str, Any]) -> Any:
        image = mean_side(images["Indirect"][..., 0] / (0.5 / math.pi * irradiance))
        edge = image[band:-band, :band]
        return [
            edge.mean(),
            edge[:, :2].mean(),
            image[:band, :band].mean(),
            image[: band // 2, : band // 2].mean(),
        ]

    values = over_seeds(
        device,
        scene,
        measure,
        direct_by_photons=True,
        filter=kernel,
        radius=radius,
        photons=50000,
        passes=32 if thorough else 10,
        width=n,
        height=n,
    )
    edge, corner = (relative_bound(part, [1.0, 1.0]) for part in (values[:, :2], values[:, 2:]))
    assert measured("edge", edge, "%", row=4) <= 0.02
    assert measured("corner", corner, "%", row=5) <= 0.03


def things_on_a_plate() -> tuple[Scene, float]:
    """An L of two boxes that stands on the plate in one piece, light falling straight down on both.

    What falls on the floor is as even next to the boxes as far from them.
    """
    scene, irradiance = lit_plate()
    things = Builder().quad((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0))
    things.box((-0.5, 0, -0.01), (0.5, 0.5, 0.3)).box((-0.5, -0.5, -0.01), (0, 0.1, 0.3))
    return things.scene(scene.camera, scene.lights, [DIM]), irradiance


@pytest.mark.stability(4, 5)
@pytest.mark.thorough("splat")
@pytest.mark.parametrize("estimator", ["gather", "splat"])
def test_case_4_next_to_what_stands_on_a_surface(
    device: Device, measured: Measured, estimator: str, thorough: bool
) -> None:
    """No fringe, though the floor runs on below: 2 % along a box, 3 % in a corner of two."""
    scene, irradiance = things_on_a_plate()
    n = 64

    def measure(images: dict[str, Any]) -> Any:
        """Means over [x, x] x [y, y], in 32nds from the middle."""
        image = images["Indirect"][..., 0] / (1e-3 / math.pi * irradiance)

        def mean(left: int, right: int, low: int, high: int) -> Any:
            return image[n // 2 + low : n // 2 + high, n // 2 + left : n // 2 + right].mean()

        along = [mean(-8, 8, 16, 24), mean(-8, 8, 16, 18), mean(16, 18, 2, 14)]
        round_corner = mean(16, 20, 16, 20)
        inside = [mean(0, 8, -8, 0), mean(0, 4, -4, 0), mean(0, 1, -1, 0)]
        return [*along, round_corner, *inside]

    values = over_seeds(
        device,
        scene,
        measure,
        direct_by_photons=True,
        photon_bounces=1,
        estimator=estimator,
        radius=0.25,
        photons=40000,
        passes=16 if thorough else 6,
        width=n,
        height=n,
    )
    edge, corner = (relative_bound(part, 1.0) for part in (values[:, :4], values[:, 4:]))
    assert measured("along a box", edge, "%", row=4) <= 0.02
    assert measured("between two", corner, "%", row=5) <= 0.03


@pytest.mark.thorough
def test_corrected_silhouettes(device: Device) -> None:
    """A pixel that the plate fills by a quarter has a quarter of its radiance."""
    scene, irradiance = lit_plate()
    view = orthographic((0, 0, 1), (1, 0, 0), (0, 1, 0), 4.0)
    scene = replace(scene, camera=view)
    values = over_seeds(
        device,
        scene,
        lambda im: im["Indirect"][3, [1, 5], 0].mean(),
        direct_by_photons=True,
        radius=0.25,
        photons=10000,
        passes=256,
        width=7,
        height=7,
    )
    assert relative_bound(values, 0.25 * 0.5 / math.pi * irradiance) <= 0.03


@pytest.mark.stability(3)
def test_case_7_closed_cube(device: Device, measured: Measured) -> None:
    """Mean indirect irradiance of a closed diffuse cube: Phi rho / (A (1 - rho)), 1 %."""
    rho = 0.6
    light = plain_light("light", "POINT", (0, 0, 0), (UNIT_INTENSITY,) * 3)
    view = orthographic((0, 0, 0), (1, 0, 0), (0, 0, 1), 2.0)  # all of the wall y = 1
    box = Builder().box((-1, -1, -1), (1, 1, 1))
    scene = box.scene(view, [light], [plain_material("wall", (rho,) * 3)])
    values = over_seeds(
        device,
        scene,
        lambda im: im["Indirect"].mean(),
        radius=0.01,
        photons=60000,
        passes=4,
        width=64,
        height=64,
    )
    expected = UNIT_INTENSITY * rho / (24 * (1 - rho))
    assert measured("bias", relative_bound(values, rho / math.pi * expected), "%") <= 0.01


@pytest.mark.stability(27)
def test_case_8_facing_mirrors(device: Device, measured: Measured) -> None:
    """Between parallel mirrors every chain adds the geometric series k_s / (1 - k_s), 1 %."""
    k_s = 0.6
    walls = Builder()
    walls.quad((-1, 1, -1), (1, 1, -1), (1, 1, 1), (-1, 1, 1))
    walls.quad((-1, -1, -1), (-1, -1, 1), (1, -1, 1), (1, -1, -1))
    light = plain_light("light", "POINT", (0, 0, 0), (100.0,) * 3)
    view = orthographic((0, 0, 0), (1, 0, 0), (0, 0, 1), 1.0)
    scene = walls.scene(view, [light], [plain_material("mirror", (0.3,) * 3, (k_s,) * 3)])
    images = render(device, scene, photons=0, mirror_depth=200, passes=64)
    ratio = images["Mirror"] / images["Direct"]
    assert measured("series", abs(ratio.mean() / (k_s / (1 - k_s)) - 1), "%") <= 0.01
    capped = render(device, scene, photons=0, mirror_depth=1)
    assert np.allclose(capped["Mirror"] / capped["Direct"], k_s, rtol=1e-4)


@pytest.mark.stability(33)
@pytest.mark.parametrize("blend", [0.0, 0.4, 1.0])
def test_case_9_spot_over_a_plane(device: Device, measured: Measured, blend: float) -> None:
    """Every pixel away from the cone's edge has the profile's radiance, 0.5 %."""
    size, power, height, n = math.radians(70), 100.0, 2.0, 64
    light = plain_light(
        "spot", "SPOT", (0, 0, height), (power,) * 3, spot_size=size, spot_blend=blend
    )
    view = orthographic((0, 0, 1), (1, 0, 0), (0, 1, 0), 4.0)
    floor = Builder().quad((-3, -3, 0), (3, -3, 0), (3, 3, 0), (-3, 3, 0))
    scene = floor.scene(view, [light], [plain_material("white", (0.8,) * 3)])
    image = render(device, scene, photons=0, width=n, height=n, **MIDDLES)["Direct"][..., 0]
    x, y = np.meshgrid(*[(np.arange(n) + 0.5) / n * 4 - 2] * 2)
    d2 = x * x + y * y + height * height
    cosine = height / np.sqrt(d2)
    edge = math.cos(size / 2)
    t = np.clip((cosine - edge) / max((1 - edge) * blend, 1e-12), 0, 1)
    expected = 0.8 / math.pi * power / (4 * math.pi) * t * t * (3 - 2 * t) * cosine / d2
    away = np.abs(cosine - edge) > 0.01
    assert np.abs(image - expected)[away].max() <= 0.005 * expected.max()
    bright = away & (t > 0.05)
    error = np.abs(image / np.where(bright, expected, 1) - 1)[bright].max()
    assert measured("worst pixel", error, "%") <= 0.005
    assert image[away & (cosine < edge)].max() == 0
