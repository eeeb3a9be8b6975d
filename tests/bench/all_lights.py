# SPDX-License-Identifier: GPL-3.0-or-later
"""A pass of an HDRI, a sun and ten area lights over a pass of one spotlight, in turns.

Run as `python -m tests.bench.all_lights`. Processor seconds, which other work hardly lengthens;
on a GPU the clock's.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace

import numpy as np

from addon.photon.backends.backend import open_device
from addon.photon.prepare import prepare
from addon.photon.renderer import Renderer
from addon.photon.scene import Image, Light, Scene, area_light, environment_light, sun_light
from addon.photon.settings import Settings
from tests.scenes import Builder, camera, plain_light, plain_material

VIEW = camera((4.5, -5.0, 3.0), (0, 0, 0.8), 45)
GREY, RED = plain_material("grey", (0.6,) * 3), plain_material("red", (0.7, 0.2, 0.2))


def courtyard(lights: list[Light], images: tuple[Image, ...] = ()) -> Scene:
    """A floor with two walls, a box and a ball, under the sky."""
    built = Builder().quad((-3, -3, 0), (3, -3, 0), (3, 3, 0), (-3, 3, 0), 0, "floor")
    built.quad((-3, 3, 0), (3, 3, 0), (3, 3, 3), (-3, 3, 3), 0, "wall")
    built.quad((-3, -3, 0), (-3, 3, 0), (-3, 3, 3), (-3, -3, 3), 1, "side")
    built.box((-1.6, 0.2, 0.0), (-0.4, 1.4, 1.6), 0, "box").sphere((0.9, 0.3, 0.7), 0.7, 1, "ball")
    return replace(built.scene(VIEW, lights, [GREY, RED]), images=images)


def one_spot() -> Scene:
    spot = plain_light("spot", "SPOT", (0.5, -1.0, 5.0), (2000.0,) * 3, spot_size=1.6)
    return courtyard([spot])


def all_kinds() -> Scene:
    """Both skies and ten lamps, about as bright."""
    rng = np.random.default_rng(1)
    sky = Image("sky", rng.gamma(0.3, 1.0, (512, 1024, 3)).astype(np.float32))
    lights = [environment_light("sky", 0), sun_light("sun", (3.0,) * 3, (0.4, 0.3, -1.0), 0.01)]
    for number in range(10):
        x, y = 4.0 * (number % 5) / 4 - 2.0, 2.0 * (number // 5) - 1.5
        lights.append(area_light("lamp", (x, y, 3.5), (60.0,) * 3, size=(0.6, 0.3)))
    return courtyard(lights, (sky,))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--size", type=int, default=256)
    parser.add_argument("--photons", type=int, default=65536)
    parser.add_argument("--passes", type=int, default=8, help="in each of three turns")
    args = parser.parse_args()
    passes = 3 * args.passes + 2
    settings = Settings(width=args.size, height=args.size, photons=args.photons, passes=passes)
    device = open_device(settings)
    clock = time.process_time if device.is_software else time.perf_counter
    scenes = {"one spot": one_spot(), "HDRI, sun, ten areas": all_kinds()}
    made: dict[str, Renderer] = {n: prepare(s, settings, device) for n, s in scenes.items()}
    spent: dict[str, list[float]] = {name: [] for name in made}
    for turn in range(4):
        for name, renderer in made.items():
            start = clock()
            for _ in range(args.passes if turn else 2):  # the first turn learns and compiles
                renderer.render_pass()
            device.ctx.finish()
            spent[name].append((clock() - start) / args.passes)
    best = {name: min(turns[1:]) for name, turns in spent.items()}
    for name, seconds in best.items():
        share = {x: round(s / passes * 1e3) for x, s in made[name].seconds.items() if s > 0.001}
        print(f"{name}: {1e3 * seconds:.0f} ms a pass; by phase [ms, by the clock] {share}")
    print(f"times one spotlight: {best['HDRI, sun, ten areas'] / best['one spot']:.2f}")
    for renderer in made.values():
        renderer.release()


if __name__ == "__main__":
    main()
