# SPDX-License-Identifier: GPL-3.0-or-later
"""`python build.py chart [--quick]`: error against seconds, beside Cycles on the same machine.

Renders the scenes of blend_scenes at a ladder of efforts with Photon Stream, Cycles, and Cycles
with OpenImageDenoise, one after the other in one run, and writes chart.html (self-contained),
chart.json and an SVG a scene. In the seconds: rendering. Not in them: start-up, export and scene
loading, BVH build and program compilation, saving; on either side.

The references are Cycles at 16384 samples (tests/regression/make_references.py), so Cycles is
compared with itself; tests/regression shows that Photon Stream's pictures converge to the same.
"""

from __future__ import annotations

import argparse
import html
import itertools
import json
import math
import os
import platform
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from addon.photon.renderer import Renderer, open_device
from addon.photon.scene import Scene
from addon.photon.settings import Settings
from addon.streams import Device
from tests.regression.cycles import (
    REFERENCES,
    SCENES,
    SIZE,
    open_blend,
    prepare,
    read_exr,
    replace_lobes,
)

TARGETS = (1e-1, 3e-2, 1e-2, 3e-3, 1e-3)
COLOURS = {"Photon Stream": "#d9480f", "Cycles": "#1864ab", "Cycles + OIDN": "#2b8a3e"}


@dataclass(frozen=True)
class Point:
    """A contender's picture of a scene at one effort."""

    scene: str
    contender: str
    effort: int  # passes or samples
    seconds: float  # median over the seeds
    error: float  # relMSE, mean over the seeds


def relative_mse(image: Any, reference: Any) -> float:
    """Mean squared error relative to the reference, its mean as floor."""
    floor = reference.mean()
    return float((((image - reference) / np.maximum(reference, floor)) ** 2).mean())


def photon_stream(
    scene: Scene, device: Device, efforts: Sequence[int], seed: int
) -> dict[int, tuple[float, Any]]:
    """(seconds, picture) after each number of passes, of one render."""
    renderer = Renderer(scene, Settings(width=SIZE, height=SIZE, seed=seed), device)
    found, spent = {}, 0.0
    try:
        for done in range(1, max(efforts) + 1):
            start = time.perf_counter()
            renderer.render_pass()
            device.ctx.finish()
            spent += time.perf_counter() - start
            if done in efforts:
                found[done] = spent, renderer.images()["Combined"][..., :3]
    finally:
        renderer.release()
    return found


def cycles(samples: int, seed: int, denoise: bool) -> tuple[float, Any]:
    """(seconds, picture) of the scene loaded in Blender; seconds include Cycles' scene sync."""
    scene = bpy.context.scene
    prepare(scene, samples, seed)
    scene.cycles.use_denoising = denoise
    path = Path(bpy.app.tempdir) / "cycles.exr"
    scene.render.filepath = str(path)
    start = time.perf_counter()
    bpy.ops.render.render(write_still=True)
    return time.perf_counter() - start, read_exr(path)


def measure(name: str, device: Device, quick: bool) -> list[Point]:
    """All points of a scene."""
    reference = read_exr(REFERENCES / f"{name}.exr")
    exported = open_blend(name)
    replace_lobes(exported)
    seeds = range(1, 2 if quick else 4)
    passes = [2**k for k in range(6 if quick else 9)]
    samples = [4**k for k in range(5 if quick else 7)]
    points = []
    photon_stream(exported, device, [1], 0)  # compiles what the driver caches

    def add(contender: str, effort: int, results: Sequence[tuple[float, Any]]) -> None:
        seconds = float(np.median([spent for spent, _ in results]))
        error = float(np.mean([relative_mse(image, reference) for _, image in results]))
        points.append(Point(name, contender, effort, seconds, error))
        print(f"{name:16} {contender:14} {effort:6} {seconds:9.3f} s  {error:.3e}", flush=True)

    ours = [photon_stream(exported, device, passes, seed) for seed in seeds]
    for effort in passes:
        add("Photon Stream", effort, [render[effort] for render in ours])
    for contender, denoise in (("Cycles", False), ("Cycles + OIDN", True)):
        cycles(1, 0, denoise)  # loads kernels and denoiser
        overhead = min(cycles(1, seed, denoise)[0] for seed in range(3))
        for effort in samples:
            results = [cycles(effort, seed, denoise) for seed in seeds]
            # One sample's share of the overhead is a sample: negligible from four samples on.
            results = [(max(spent - overhead, 1e-3), image) for spent, image in results]
            if effort > 1:
                add(contender, effort, results)
    return points


def seconds_to(points: Sequence[Point], target: float) -> float:
    """Seconds at which a curve reaches an error, log-log between points; inf if never."""
    ordered = sorted(points, key=lambda p: p.seconds)
    for before, after in itertools.pairwise(ordered):
        if before.error > target >= after.error:
            share = math.log(before.error / target) / math.log(before.error / after.error)
            return before.seconds * (after.seconds / before.seconds) ** share
    return ordered[0].seconds if ordered[0].error <= target else math.inf


def slope(points: Sequence[Point]) -> float:
    """Fitted exponent of error against seconds."""
    x = np.log([p.seconds for p in points])
    return float(np.polyfit(x, np.log([p.error for p in points]), 1)[0])


def svg(points: Sequence[Point]) -> str:
    """Error against seconds, both logarithmic."""
    width, height, left, bottom = 640, 420, 70, 50
    x_of = _axis([p.seconds for p in points], left, width - 20)
    y_of = _axis([p.error for p in points], height - bottom, 20)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" '
        f'width="{width}" font-family="sans-serif" font-size="12">'
        f'<rect width="{width}" height="{height}" fill="white"/>'
    ]
    for decade in range(-6, 6):
        value, x, y = 10.0**decade, x_of(10.0**decade), y_of(10.0**decade)
        if left <= x <= width - 20:
            parts.append(f'<path d="M{x:.1f} 20V{height - bottom}" stroke="#ddd"/>')
            parts.append(
                f'<text x="{x:.1f}" y="{height - 32}" text-anchor="middle">{value:g}</text>'
            )
        if 20 <= y <= height - bottom:
            parts.append(f'<path d="M{left} {y:.1f}H{width - 20}" stroke="#ddd"/>')
            parts.append(f'<text x="{left - 6}" y="{y + 4:.1f}" text-anchor="end">{value:g}</text>')
    for row, contender in enumerate(_contenders(points)):
        mine = [p for p in points if p.contender == contender]
        colour = COLOURS[contender]
        places = [(x_of(p.seconds), y_of(p.error)) for p in mine]
        line = " ".join(f"{x:.1f},{y:.1f}" for x, y in places)
        parts.append(f'<polyline points="{line}" fill="none" stroke="{colour}" stroke-width="2"/>')
        parts += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="{colour}"/>' for x, y in places]
        parts.append(
            f'<text x="{width - 150}" y="{40 + 16 * row}" fill="{colour}">{contender}</text>'
        )
    parts.append(f'<text x="{width / 2}" y="{height - 10}" text-anchor="middle">seconds</text>')
    parts.append(f'<text x="14" y="{height / 2}" transform="rotate(-90 14 {height / 2})" '
                 'text-anchor="middle">relMSE</text></svg>')  # fmt: skip
    return "".join(parts)


def _axis(values: Sequence[float], low: float, high: float) -> Callable[[float], float]:
    first, last = math.log10(min(values)) - 0.1, math.log10(max(values)) + 0.1
    return lambda value: low + (math.log10(value) - first) / (last - first) * (high - low)


def _contenders(points: Sequence[Point]) -> list[str]:
    return list(dict.fromkeys(p.contender for p in points))


def table(points: Sequence[Point]) -> list[list[str]]:
    """Rows: a contender's seconds to each target error, and its slope."""
    rows = []
    for contender in _contenders(points):
        mine = [p for p in points if p.contender == contender]
        times = [seconds_to(mine, target) for target in TARGETS]
        shown = [f"{t:.2f} s" if math.isfinite(t) else "not reached" for t in times]
        rows.append([contender, *shown, f"{slope(mine):.2f}"])
    ours = [p for p in points if p.contender == "Photon Stream"]
    theirs = [p for p in points if p.contender == "Cycles"]
    ratios = []
    for target in TARGETS:
        a, b = seconds_to(ours, target), seconds_to(theirs, target)
        ratios.append(f"{b / a:.1f}" if math.isfinite(a) and math.isfinite(b) else "")
    rows.append(["Cycles' seconds / ours", *ratios, ""])
    return rows


def page(points: Sequence[Point], machine: str) -> str:
    """The whole chart as one HTML page."""
    head = [f"{target:g}" for target in TARGETS]
    notes = html.escape(__doc__ or "")
    body = [f"<h1>Error against time</h1><p>{html.escape(machine)}</p><pre>{notes}</pre>"]
    for name in dict.fromkeys(p.scene for p in points):
        mine = [p for p in points if p.scene == name]
        rows = "".join(
            "<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in row) + "</tr>"
            for row in table(mine)
        )
        titles = "".join(f"<th>{t}</th>" for t in ["seconds to relMSE", *head, "slope"])
        body.append(f"<h2>{name}, {SIZE}x{SIZE}</h2>{svg(mine)}")
        body.append(f"<table><tr>{titles}</tr>{rows}</table>")
    style = (
        "body{font-family:sans-serif;max-width:50em;margin:auto}"
        "td,th{padding:.2em .8em;text-align:right}"
    )
    head_tags = f"<meta charset=utf-8><title>Photon Stream</title><style>{style}</style>"
    return f"<!doctype html>{head_tags}{''.join(body)}"


def main() -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="fewer efforts, one seed")
    parser.add_argument("-o", "--output", type=Path, default=Path("chart"), metavar="FOLDER")
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)
    device = open_device(Settings())
    machine = (
        f"{platform.machine()}, {os.cpu_count()} cores; {device.name}; "
        f"Blender {bpy.app.version_string}; {time.strftime('%Y-%m-%d')}"
    )
    points = [p for name in SCENES for p in measure(name, device, arguments.quick)]
    for name in SCENES:
        mine = [p for p in points if p.scene == name]
        (arguments.output / f"{name}.svg").write_text(svg(mine), encoding="utf-8")
        print(f"\n{name}: seconds to relMSE {TARGETS}, slope")
        for row in table(mine):
            print("  " + "  ".join(f"{cell:>12}" for cell in row))
    data = {"machine": machine, "points": [asdict(p) for p in points]}
    (arguments.output / "chart.json").write_text(json.dumps(data, indent=1), encoding="utf-8")
    (arguments.output / "chart.html").write_text(page(points, machine), encoding="utf-8")
    print(f"\nWrote {arguments.output / 'chart.html'}")


if __name__ == "__main__":
    main()
