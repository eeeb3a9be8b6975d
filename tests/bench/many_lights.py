# SPDX-License-Identifier: GPL-3.0-or-later
"""How many lights a point should ask, and by what choice: error of direct light and time a pass.

Run as `python -m tests.bench.many_lights`.
"""

from __future__ import annotations

import argparse
import time
from itertools import pairwise
from typing import Any
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray

from addon.photon.scene import BLACK, Material, Scene, point_light
from addon.photon.stage import light_tables, light_tree, tables
from addon.photon.stage.light_tree import AskedLights
from addon.streams import Device
from tests.measure import rendered
from tests.physics.test_many_lights import by_power_alone
from tests.scenes import Builder, camera, plain_material

SIZE, PASSES, REFERENCE = 64, 16, 160
VIEW = camera((-2.7, -2.7, 1.6), (1, 1, 0.3), 80)
GREY, EMISSIVE = (
    plain_material("grey", (0.6,) * 3),
    Material("emissive", BLACK, (), (5.0, 4.0, 3.0)),
)


def room() -> Builder:
    return Builder().box((-3, -3, 0), (3, 3, 2), 0, "room")


def bulbs(count: int) -> Scene:
    """Everywhere in a room."""
    rng = np.random.default_rng(0)
    places = rng.uniform((-2.9, -2.9, 0.1), (2.9, 2.9, 1.9), (count, 3))
    powers = rng.uniform(0.2, 5, count) * 60 / count
    both = zip(places.tolist(), powers.tolist(), strict=True)
    lights = [point_light("", (x, y, z), (power,) * 3) for (x, y, z), power in both]
    return room().scene(VIEW, lights, [GREY])


def strips(count: int) -> Scene:
    """Three below the ceiling, of so many triangles."""
    built, x = room(), np.linspace(-2.9, 2.9, count // 6 + 1)
    for y in (-2, 0, 2):
        for a, b in pairwise(x):
            low, high = y - 0.05, y + 0.05
            built.quad((a, low, 1.95), (b, low, 1.95), (b, high, 1.95), (a, high, 1.95), 1)
    return built.scene(VIEW, [], [GREY, EMISSIVE])


def measured(
    device: Device, scene: Scene, rays: int, passes: int, by_power: bool = False, seed: int = 1
) -> tuple[NDArray[Any], float]:
    """Direct light, and seconds a pass; `rays`: 0 for all lights."""
    choice = by_power_alone if by_power else light_tree.light_tree

    def asked(flux: NDArray[Any], *_: Any) -> AskedLights:
        return AskedLights(np.arange(0 if rays else len(flux)), rays)

    with (
        patch.object(tables, "asked_lights", asked),
        patch.object(light_tables, "light_tree", choice),
        rendered(device, scene, width=SIZE, height=SIZE, photons=0, seed=seed) as renderer,
    ):
        begin = time.perf_counter()
        for _ in range(passes - 1):
            renderer.render_pass()
        seconds = (time.perf_counter() - begin) / (passes - 1)
        return renderer.images()["Direct"].astype(float).mean(axis=-1), seconds


def main() -> None:
    argparse.ArgumentParser(description=__doc__).parse_args()
    device = Device()
    cases = [(f"{count} bulbs", bulbs(count), count <= 64) for count in (16, 64, 2000)]
    for name, scene, few in (*cases, ("3000 triangles", strips(3000), False)):
        truth, _ = measured(device, scene, 0 if few else 64, REFERENCE, seed=99)
        ways = [(f"tree {rays}", rays, False) for rays in (8, 16, 32, 64)]
        ways += [("all", 0, False)] if few else [("power 64", 64, True)]
        for way, rays, by_power in ways:
            found, seconds = measured(device, scene, rays, PASSES, by_power)
            relative = (found - truth) / (truth + 0.01 * truth.mean())
            error = float(np.sqrt((relative**2).mean()))
            print(f"{name}, {way}: {error:.2%}, {1e3 * seconds:.0f} ms", flush=True)


if __name__ == "__main__":
    main()
