# SPDX-License-Identifier: GPL-3.0-or-later
"""More lights than a point asks: what the tree draws is right, and better than by power alone."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.photon.scene import Light, Scene, point_light, world_light
from addon.photon.stage import light_tables, light_tree
from addon.streams import Device
from tests.measure import render
from tests.scenes import Builder, orthographic, plain_material

COUNT, SIZE, FINE = 1000, 24, 4
ALBEDO = 0.5
SETTINGS: dict[str, Any] = {"width": SIZE, "height": SIZE, "photons": 0, "passes": 8}


def bulbs() -> list[Light]:
    """Of all powers above a plate, and some below it, which light none of it."""
    rng = np.random.default_rng(3)
    made = []
    for i in range(COUNT):
        x, y = rng.uniform(-1, 1, 2)
        z = -0.5 if i % 4 == 0 else rng.uniform(0.15, 0.6)
        power = (float(10 ** rng.uniform(-1, 1)),) * 3
        made.append(point_light("bulb", (float(x), float(y), float(z)), power))
    return made


def plate(lights: list[Light]) -> Scene:
    built = Builder().quad((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0))
    view = orthographic((0, 0, 0.1), (1, 0, 0), (0, 1, 0), 1.6)
    return built.scene(view, lights, [plain_material("grey", (ALBEDO,) * 3)])


def expected(lights: list[Light]) -> NDArray[Any]:
    x = ((np.arange(SIZE * FINE) + 0.5) / (SIZE * FINE) - 0.5) * 1.6
    places = np.stack([*np.meshgrid(x, x), np.zeros((len(x), len(x)))], -1)
    total = np.zeros(places.shape[:2])
    for light in lights:
        to = np.array(light.position) - places
        if light.position[2] > 0:
            total += light.power[0] / (4 * np.pi) * to[..., 2] / np.linalg.norm(to, axis=-1) ** 3
    radiance: NDArray[Any] = total * ALBEDO / np.pi
    return radiance.reshape(SIZE, FINE, SIZE, FINE).mean(axis=(1, 3))


def by_power_alone(*arguments: Any) -> Any:
    nodes, places = light_tree.light_tree(*arguments)
    nodes["low"], nodes["high"] = -1e3, 1e3  # every place is among all of them
    return nodes, places


def test_a_thousand_bulbs(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    lights = bulbs()
    truth, scene = expected(lights), plate(lights)

    def error() -> float:
        found = np.array(
            [render(device, scene, **SETTINGS, seed=seed)["Direct"][..., 0] for seed in range(4)]
        )
        assert found.mean() == pytest.approx(truth.mean(), rel=5e-3)
        return float(np.sqrt(((found / truth - 1) ** 2).mean()))

    by_tree = error()
    monkeypatch.setattr(light_tables, "light_tree", by_power_alone)
    by_power = error()
    assert by_tree < 0.05 and 2.5 * by_tree < by_power, (by_tree, by_power)


def test_a_strong_bulb_beside_weak_ones(device: Device) -> None:
    """It is asked by every point, and few rays go to the others: as much light of either."""
    weak = [replace(light, power=(light.power[0] * 1e-3,) * 3) for light in bulbs()]
    strong = point_light("strong", (0.3, 0.2, 0.4), (20.0,) * 3)
    alone = render(device, plate([strong]), **SETTINGS)["Direct"][..., 0]
    both = render(device, plate([*weak, strong]), **SETTINGS)["Direct"][..., 0]
    more, truth = both - alone, expected(weak)
    assert more.mean() == pytest.approx(truth.mean(), rel=0.01)
    assert np.abs(more / truth - 1).mean() < 0.1


def test_with_a_sky(device: Device) -> None:
    """What is far away has its share besides."""
    lights = bulbs()
    scene = plate([*lights, world_light("sky", (30.0, 30.0, 30.0))])
    found = render(device, scene, **SETTINGS)["Direct"][..., 0]
    truth = expected(lights) + 30.0 * ALBEDO
    assert found.mean() == pytest.approx(truth.mean(), rel=5e-3)
