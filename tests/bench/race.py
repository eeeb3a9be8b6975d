# SPDX-License-Identifier: GPL-3.0-or-later
"""Seconds to equal error at any size: `python -m tests.bench.race SCENE.npz [--size N]`.

Photon Stream against one path tracer on one machine: Mitsuba (cuda_ad_rgb, or MITSUBA_VARIANT), or
Cycles, for which the scene is one of blend_scenes. The reference is the other's own, in two halves
of many samples and other seeds. Each has rendered for half a second before, and errors are told
after the whole curve: a GPU that idles lowers its clock.
"""

from __future__ import annotations

import argparse
import importlib
import math
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from .chart.contenders.steps import Budget, Step
from .chart.measure import Point, mean_of, squared_errors
from .chart.results import seconds_by_slope, seconds_to
from .chart.scenes import Reference, blend_file

TARGETS = (1e-2, 1e-3)
REFERENCE_SEEDS = (1001, 2001)
WARM = 0.5  # [s]


def climbed(steps: Iterator[Step], reference: Reference) -> list[Point]:
    """A curve of whole pictures."""
    nan = float("nan")
    points = []
    for step in list(steps):
        error = mean_of(squared_errors(step.image, reference))
        points.append(Point(step.effort, step.seconds.wall, error, error, error, nan, nan, nan))
        print(f"    {step.effort:6} {step.seconds.wall:9.4f} s  {error.value:.3e}", flush=True)
    return points


def raced(engine: Any, method: str, seconds: float, reference: Reference) -> list[Point]:
    """A contender's curve, its clock up."""
    for _ in engine.climb(method, 2, Budget(WARM)):
        pass
    return climbed(engine.climb(method, 1, Budget(seconds)), reference)


def main() -> None:
    """Print both curves and the ratios."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("scene", type=Path, help=".npz; with Cycles it is written")
    parser.add_argument("--peer", choices=("mitsuba", "cycles"), default="mitsuba")
    parser.add_argument("--size", type=int, default=512, help="[px] a side")
    parser.add_argument("--seconds", type=float, default=20.0, help="of each half and contender")
    arguments = parser.parse_args()
    os.environ.setdefault("MITSUBA_VARIANT", "cuda_ad_rgb")
    peer = importlib.import_module(f".chart.contenders.{arguments.peer}", __package__)
    from .chart.contenders import photon_stream

    name = arguments.peer.title()
    theirs, ours = peer.Engine(), photon_stream.Engine()
    for engine in (theirs, ours):
        engine.load(arguments.scene, blend_file(arguments.scene.stem), arguments.size)
        print(engine.about)
    halves = []
    for seed in REFERENCE_SEEDS:
        *_, last = theirs.climb("path", seed, Budget(arguments.seconds))
        halves.append(np.asarray(last.image, np.float64))
        print(f"reference: {last.effort} samples a pixel in {last.seconds.wall:.1f} s", flush=True)
    reference = Reference(halves[0], halves[1], f"{name} path")
    print(f"  {name} path")
    path = raced(theirs, "path", arguments.seconds, reference)
    print("  Photon Stream")
    photons = raced(ours, "photons", arguments.seconds, reference)
    for target in TARGETS:
        told, reached = [], [seconds_to(points, target) for points in (path, photons)]
        for points, seconds in zip((path, photons), reached, strict=True):
            later = seconds_by_slope(points, target)
            told.append(
                f"{seconds:.4g} s" if math.isfinite(seconds) else f"~{later:.4g} s by slope"
            )
        ratio = f": {reached[0] / reached[1]:.3g} times sooner" if max(reached) < math.inf else ""
        print(f"relMSE {target:g}: {name} {told[0]}, ours {told[1]}{ratio}")


if __name__ == "__main__":
    main()
