# SPDX-License-Identifier: GPL-3.0-or-later
"""What Denoise gains, scene by scene: `python -m tests.bench.denoise [scene ...] [--passes N ...]`.

Strict relMSE without and with it after so many passes at the default settings; the error that the
render tells of itself over the true one, without and with; and the seconds that it takes. Against
the chart's references at 256x256, or, where there is none, two renders of TRUTH passes each of ours
at 128x128, which tell noise alone. `--seconds` times it on pictures of 256x256 and 1920x1080.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from addon.denoiser import Way
from addon.photon.backends.backend import open_device
from addon.photon.film.denoise import FEATURE_PORTS, Opened, picture_denoised
from addon.photon.prepare import prepare
from addon.photon.scene import Lens, Scene
from addon.photon.settings import Settings
from addon.streams import Device
from tests.regression.cycles import open_blend

from .chart.contenders.cycles import open_scene
from .chart.measure import squared_errors
from .chart.scenes import SCENES, SIZE, Reference, read_reference, reference_file

SEED = 1
TRUTH, SMALL = 512, 128  # passes and [px] of our own references
ROUGH = {"alpha": 0.16, "compensated": 1.0}  # frosted glass's


def through_a_lens(scene: Scene) -> Scene:
    """With `studio` out of focus before and behind its teapot."""
    return replace(scene, camera=replace(scene.camera, lens=Lens(0.12, 4.35)))


def frosted(scene: Scene) -> Scene:
    """With rough glass for smooth."""
    materials = [
        replace(
            material,
            lobes=tuple(
                replace(lobe, kind="ggx_glass", parameters={**lobe.parameters, **ROUGH})
                if lobe.kind == "glass"
                else lobe
                for lobe in material.lobes
            ),
        )
        for material in scene.materials
    ]
    return replace(scene, materials=tuple(materials))


# Scenes of blend_scenes besides the chart's, some changed.
MORE_SCENES: dict[str, tuple[str, Callable[[Scene], Scene] | None]] = {
    "studio_lens": ("studio", through_a_lens),
    "wine_glass_frosted": ("wine_glass", frosted),
}


def reference_of(device: Device, name: str) -> tuple[Scene, Reference]:
    """A scene at the size of its reference, and that."""
    if reference_file(name).is_file():
        return open_scene(name, SIZE), read_reference(name)
    blend, change = MORE_SCENES.get(name, (name, None))
    scene, halves = open_blend(blend, SMALL), []
    scene = change(scene) if change else scene
    for seed in (SEED + 1, SEED + 2):
        settings = Settings(width=SMALL, height=SMALL, seed=seed, passes=TRUTH)
        device.use()
        renderer = prepare(scene, settings, device)
        for _ in range(TRUTH):
            renderer.render_pass()
        halves.append(renderer.images()["Combined"][..., :3].astype(np.float64))
        renderer.release()
    return scene, Reference(*halves, "our own")


def row(device: Device, name: str, passes: list[int]) -> str:
    """A scene's row of the table."""
    scene, reference = reference_of(device, name)
    size, cells = len(reference.a), []
    settings = Settings(width=size, height=size, seed=SEED, passes=max(passes))
    device.use()
    renderer = prepare(scene, replace(settings, denoise=True), device)
    try:
        for done in range(1, max(passes) + 1):
            renderer.render_pass()
            if done not in passes:
                continue
            found = []
            for is_preview in (True, False):
                picture = renderer.images(["Combined"], is_preview)["Combined"][..., :3]
                true, told = squared_errors(picture, reference).mean(), renderer.error().total
                found.append((true, told / math.sqrt(max(true, 1e-12))))
            (before, told), (after, told_then) = found
            ratios = f" ({told:.2f}, {told_then:.2f})" if math.isfinite(told) else ""
            cells.append(f"{before:.2e} -> {after:.2e}{ratios}")
        seconds = renderer.seconds["denoise"] / len(passes)
    finally:
        renderer.release()
    return f"| `{name}` | {' | '.join(cells)} | {seconds:.2f} s |"


def time_it(sizes: tuple[tuple[int, int], ...] = ((256, 256), (1920, 1080))) -> None:
    """Print seconds of denoising a picture by its halves, and of processors, the least of three:
    the latter for machines that others use."""
    rng = np.random.default_rng(1)
    for width, height in sizes:
        plain, half = rng.random((2, height, width, 3), np.float32)
        images = {"Combined": plain, **dict.fromkeys(FEATURE_PORTS.values(), half)}
        for ways in ((Way.GIVEN,), (Way.GIVEN, Way.LARGEST)):
            found = []
            for _ in range(3):
                start, spent = time.perf_counter(), time.process_time()
                opened = Opened()
                made = picture_denoised(images, half, 0.5, opened, lambda _, ways=ways: ways)
                opened.release()
                found.append((time.perf_counter() - start, time.process_time() - spent))
            least, spent = np.min(found, axis=0)
            size = f"{width}x{height} in {len(ways)}"
            print(f"{size}: {least:.2f} s, of processors {spent:.2f} s, {made.by}")


def main() -> None:
    """Print a Markdown table, or seconds."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    names = [*SCENES, *MORE_SCENES]
    parser.add_argument("scene", nargs="*", choices=[[], *names], help="default: all")
    parser.add_argument("--passes", type=int, nargs="+", default=[4, 16, 64])
    parser.add_argument("--seconds", action="store_true", help="of denoising alone")
    arguments = parser.parse_args()
    if arguments.seconds:
        return time_it()
    device = open_device(Settings())
    heads = [f"{n} passes" for n in sorted(arguments.passes)]
    print(f"| {device.name} | {' | '.join(heads)} | denoising |\n|{'---|' * (len(heads) + 2)}")
    for name in arguments.scene or names:
        print(row(device, name, arguments.passes), flush=True)
    return None


if __name__ == "__main__":
    main()
