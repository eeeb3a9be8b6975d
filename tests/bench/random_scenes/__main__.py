# SPDX-License-Identifier: GPL-3.0-or-later
"""`python -m tests.bench.random_scenes [--seeds 0-20] [--keep FOLDER]`.

A line a scene: how far its blocks of 8x8 pixels are from Cycles' at worst, over what both pictures'
halves and 2 % of the block tell; which block that is, and by how much; our mean over Cycles'; and
what the report says is not exact. 1 or 2 is chance. `--keep`: the scenes, and both pictures.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

import addon

from .things import build

BLOCK = 8
LEAST = 0.02  # of a block, that is taken for chance
DARK = 0.2  # of the mean: darker blocks count by it
BRIGHT = 8.0  # times the mean: brighter pixels are cut, for few samples of either find them


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", default="0-20", help="the first, and one past the last")
    parser.add_argument("--keep", type=Path, help="a folder for scenes and pictures")
    parser.add_argument("--samples", type=int, default=128)
    parser.add_argument("--passes", type=int, default=16)
    given = parser.parse_args()
    addon.register()
    first, end = map(int, given.seeds.split("-"))
    with tempfile.TemporaryDirectory() as scratch:
        folder = given.keep or Path(scratch)
        folder.mkdir(parents=True, exist_ok=True)
        for seed in range(first, end):
            print(f"{seed}: {compared(seed, folder, given.samples, given.passes)}", flush=True)
    addon.unregister()


def compared(seed: int, folder: Path, samples: int, passes: int) -> str:
    """Render a scene by both, and say how far apart they are."""
    scene = build(seed)
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / f"{seed}.blend"))
    scene = bpy.context.scene
    report = folder / f"{seed}.json"
    scene.cycles.samples = samples
    ours = scene.photon_stream
    ours.passes, ours.report_path = passes, str(report)
    halves: dict[str, list[NDArray[Any]]] = {"CYCLES": [], "PHOTON_STREAM": []}
    try:
        for engine, found in halves.items():
            for half in (1, 2):
                scene.cycles.seed = ours.seed = half
                scene.render.engine = engine
                found.append(rendered(scene, folder / f"{seed}_{engine.lower()}.exr"))
    except RuntimeError as error:
        return f"failed: {error}"
    entries = json.loads(report.read_text())["entries"]
    known = [f"{x['object']}: {x['feature']}" for x in entries if x["status"] != "exact"]
    return f"{apart(halves['CYCLES'], halves['PHOTON_STREAM'])}; {', '.join(known) or 'exact'}"


def rendered(scene: Any, path: Path) -> NDArray[Any]:
    """(h, w, 3), the lowest row first."""
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(str(path))
    pixels = np.empty(image.size[0] * image.size[1] * image.channels, np.float32)
    image.pixels.foreach_get(pixels)
    shape = (image.size[1], image.size[0], image.channels)
    bpy.data.images.remove(image)
    return pixels.reshape(shape)[..., :3].astype(np.float64)


def apart(theirs: list[NDArray[Any]], ours: list[NDArray[Any]]) -> str:
    """In words."""
    mean = np.mean(theirs)
    if not mean > 0.0:
        return f"black by Cycles, {np.mean(ours):.3g} by ours"
    one, other = ([_blocks(half, BRIGHT * mean) for half in halves] for halves in (theirs, ours))
    scale = (one[0] + one[1]) / 2 + DARK * mean
    off = (other[0] + other[1] - one[0] - one[1]) / 2 / scale
    chance = LEAST + sum(
        np.abs(halves[0] - halves[1]) / 2 / scale
        + np.sqrt(np.mean(((halves[0] - halves[1]) / 2 / scale) ** 2)) / 2
        for halves in (one, other)
    )
    score = (np.abs(off) / chance).max(axis=-1)
    row, column = np.unravel_index(score.argmax(), score.shape)
    there = f"{np.abs(off[row, column]).max():.2f} at row {row * BLOCK}, column {column * BLOCK}"
    return f"{score.max():.1f} ({there}), mean {np.mean(ours) / mean:.3f}"


def _blocks(picture: NDArray[Any], most: float) -> NDArray[Any]:
    height, width = (length // BLOCK for length in picture.shape[:2])
    cut = np.minimum(picture, most)[: height * BLOCK, : width * BLOCK]
    found: NDArray[Any] = cut.reshape(height, BLOCK, width, BLOCK, 3).mean(axis=(1, 3))
    return found


if __name__ == "__main__":
    main()
