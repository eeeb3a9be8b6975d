# SPDX-License-Identifier: GPL-3.0-or-later
"""Seconds to equal error at any size: `python -m tests.bench.race SCENE.npz [--size N]
[--photons N ...]`.

Photon Stream against one path tracer on one machine: Mitsuba (cuda_ad_rgb, or MITSUBA_VARIANT), or
Cycles, for which the scene is one of blend_scenes. The reference is the other's own, in two halves
of many samples and other seeds. Errors are strict relMSE, the lenient one in brackets. Each runs in
a process of its own, one after the other, as chart/worker.py has it: short times are medians of
several climbs. Neither's scene and programs are in them.
"""

from __future__ import annotations

import argparse
import math
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from .chart.measure import Point, lenient_errors, mean_of, squared_errors
from .chart.results import seconds_by_slope, seconds_to
from .chart.scenes import Reference, blend_file
from .chart.worker import Worker

TARGETS = (1e-2, 1e-3)
REFERENCE_SEEDS = (1001, 2001)


@contextmanager
def contender(module: str, scene: Path, size: int) -> Iterator[Worker]:
    """An engine with the scene loaded."""
    worker = Worker(module)
    try:
        print(worker.load(scene.resolve(), blend_file(scene.stem), size)["about"], flush=True)
        yield worker
    finally:
        worker.close()


def pictures(worker: Worker, method: str, seed: int, seconds: float) -> list[dict[str, Any]]:
    """A climb's answers, and their images."""
    with tempfile.TemporaryDirectory() as folder:
        *steps, _ = worker.climb(method, seed, seconds, Path(folder))
        return [step | {"image": np.load(step["file"])} for step in steps]


def climbed(worker: Worker, method: str, seconds: float, reference: Reference) -> list[Point]:
    """A curve of whole pictures."""
    nan, points = float("nan"), []
    for step in pictures(worker, method, 1, seconds):
        effort, wall = step["effort"], step["wall"]
        error = mean_of(squared_errors(step["image"], reference))
        lenient = mean_of(lenient_errors(step["image"], reference))
        points.append(Point(effort, wall, error, error, error, lenient, nan, nan, nan))
        print(f"    {effort:6} {wall:9.4f} s  {error.value:.3e} ({lenient.value:.3e})", flush=True)
    return points


def reference_of(worker: Worker, name: str, seconds: float) -> Reference:
    """Two halves of so many seconds each."""
    halves = []
    for seed in REFERENCE_SEEDS:
        *_, last = pictures(worker, "path", seed, seconds)
        halves.append(last["image"].astype(np.float64))
        print(f"reference: {last['effort']} samples a pixel in {last['wall']:.1f} s", flush=True)
    return Reference(halves[0], halves[1], f"{name} path")


def main() -> None:
    """Print both curves and the ratios."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("scene", type=Path, help=".npz; with Cycles it is written")
    parser.add_argument("--peer", choices=("mitsuba", "cycles"), default="mitsuba")
    parser.add_argument("--size", type=int, default=512, help="[px] a side")
    parser.add_argument(
        "--photons", type=int, nargs="*", default=[], help="a pass, tried besides the default"
    )
    parser.add_argument("--seconds", type=float, default=20.0, help="of each half and contender")
    arguments = parser.parse_args()
    os.environ.setdefault("MITSUBA_VARIANT", "cuda_ad_rgb")
    name, seconds = arguments.peer.title(), arguments.seconds
    with contender(arguments.peer, arguments.scene, arguments.size) as worker:
        reference = reference_of(worker, name, seconds)
        path = climbed(worker, "path", seconds, reference)
    methods = {"as it is set": "photons"}
    methods |= {f"{count} photons a pass": f"photons {count}" for count in arguments.photons}
    with contender("photon_stream", arguments.scene, arguments.size) as worker:
        ours = {how: climbed(worker, method, seconds, reference) for how, method in methods.items()}
    for how, photons in ours.items():
        print(f"Photon Stream, {how}:")
        for target in TARGETS:
            print(f"  {compared(name, path, photons, target)}")


def compared(name: str, path: list[Point], photons: list[Point], target: float) -> str:
    """Both's seconds to an error, and their ratio."""
    told, reached = [], [seconds_to(points, target) for points in (path, photons)]
    for points, least in zip((path, photons), reached, strict=True):
        later = seconds_by_slope(points, target)
        told.append(f"{least:.4g} s" if math.isfinite(least) else f"~{later:.4g} s by slope")
    ratio = f": {reached[0] / reached[1]:.3g} times sooner" if max(reached) < math.inf else ""
    return f"strict relMSE {target:g}: {name} {told[0]}, ours {told[1]}{ratio}"


if __name__ == "__main__":
    main()
