# SPDX-License-Identifier: GPL-3.0-or-later
"""`python build.py chart [--quick]`: error against seconds, beside other renderers.

Renders the scenes of blend_scenes at a ladder of efforts with Photon Stream and Cycles, each with
OpenImageDenoise and without, Mitsuba's path and particle tracer, LuxCore's path tracer, its
PhotonGI and its bidirectional one with vertex merging, and POV-Ray where `povray` is on PATH, one
after the other in one run, each engine in a process of its own with all cores. Writes
chart.html (self-contained, with what is and what is not in the seconds), chart.json, chart.md (a
table for the ledger, tests/bench/README.md) and an SVG a scene.

A contender climbs until its next rung would exceed its share of the time that is left of MINUTES.
On a machine that others use, `--busy` takes processor time divided by cores for seconds: about
right, as every contender here keeps all cores at work.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import asdict
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from addon.photon.scene import Scene
from tests.regression.blocks import discontinuities, grown

from ..host import CORES, processor
from .measure import DARK, Point, flip_map, lenient_errors, mean_of, squared_errors
from .page import curves_figure, page
from .results import (
    OURS,
    SceneResult,
    Table,
    equal_error,
    equal_time,
    summary,
    verdicts,
    where_time_goes,
)
from .scenes import SCENES, SIZE, Reference, blend_file, read_reference, reference_file
from .worker import EngineError, Worker

MINUTES = {True: 9.3, False: 40.0}  # of the whole run, quick or not; quick promises ten
# Cycles is first: it exports the scene for the others.
CONTENDERS = {
    "Cycles": "cycles",
    "Cycles + OIDN": "cycles",
    "Photon Stream": "photon_stream",
    "Photon Stream + Denoise": "photon_stream",
    "Mitsuba path": "mitsuba",
    "Mitsuba ptracer": "mitsuba",
    "LuxCore path": "luxcore",
    "LuxCore PhotonGI": "luxcore",
    "LuxCore BiDirVM": "luxcore",
    "POV-Ray": "povray",
}
SHARES = {"Cycles": 3.0, "Photon Stream": 2.0}  # of the time; whoever is not here has 1
BAND = 3  # [px] around discontinuities
FLIPS = {True: 3, False: 8}  # a curve's last points, at which FLIP is measured
SEED = 1


class Run:
    """The engines' processes and the clock of one run."""

    def __init__(self, quick: bool, busy: bool, minutes: float, scenes: int, folder: Path) -> None:
        self.quick, self.busy, self._folder = quick, busy, folder
        self.about: dict[str, str] = {}  # what the engines say they are
        self.absent: dict[str, str] = {}  # engines that do not start here, and why
        self._workers: dict[str, Worker] = {}
        self._end = time.monotonic() + 60 * minutes
        self._shares = scenes * sum(SHARES.get(name, 1.0) for name in CONTENDERS)

    def close(self) -> None:
        for worker in self._workers.values():
            worker.close()

    def scene(self, name: str) -> SceneResult:
        """Measure one scene with every contender."""
        reference = read_reference(name)
        result = SceneResult(name, reference.notes, reference.mean)
        scale = reference.mean**2 + (DARK * reference.mean.mean()) ** 2
        result.half_noise = float(((reference.a - reference.b) ** 2 / scale).mean() / 2)
        # Cycles exports the scene, and Photon Stream says where its edges are.
        loaded = {module: self._load(module, name) for module in ("cycles", "photon_stream")}
        for module, methods in loaded.items():
            if isinstance(methods, str):
                raise SystemExit(f"{module}: {methods}")
        band = self._band(name)
        for contender, module in CONTENDERS.items():
            share = SHARES.get(contender, 1.0)
            budget = max(1.0, self._end - time.monotonic()) * share / self._shares
            self._shares -= share
            if module not in loaded:
                loaded[module] = self._load(module, name)
            methods = loaded[module]
            if isinstance(methods, str):
                result.refused[contender] = methods
                continue
            points, pictures = self._climb(contender, methods[contender], budget, reference, band)
            result.curves[contender], result.pictures[contender] = points, pictures
            if contender == OURS:
                result.where = self._where
            if not points:
                result.refused[contender] = self._why or f"no picture within {budget:.0f} s"
            if module not in self._workers:  # it fell silent: its next contender starts anew
                del loaded[module]
        return result

    def _load(self, module: str, name: str) -> dict[str, str] | str:
        """Load a scene into an engine: its methods, or why it does not take the scene."""
        if module in self.absent:
            return self.absent[module]
        known = module in self.about
        for last in (not known, True):  # one that has worked before gets a second process
            try:
                if module not in self._workers:
                    self._workers[module] = Worker(module)
                answer = self._workers[module].load(self._snapshot(name), blend_file(name), SIZE)
                self.about[module] = answer["about"]
                return dict(answer["methods"])
            except EngineError as error:
                why = str(error)
                if why.startswith("ValueError: "):
                    return why.removeprefix("ValueError: ")
                print(f"{module}: {why}", flush=True)
                self._drop(module)
                if last:
                    break
        if not known:
            self.absent[module] = f"it does not start here: {why}"
        return why

    def _climb(
        self, contender: str, method: str, budget: float, reference: Reference, band: Any
    ) -> tuple[list[Point], list[Any]]:
        """The points and pictures of one contender within a budget [s]."""
        module = CONTENDERS[contender]
        begun, steps, pictures = time.monotonic(), [], []
        self._where, self._why = {}, ""
        try:
            for answer in self._workers[module].climb(method, SEED, budget, self._folder):
                if "done" in answer:
                    self._where = answer["done"]
                else:
                    steps.append(answer)
                    pictures.append(np.load(answer["file"]))
        except EngineError as error:
            self._why = str(error)
            self._drop(module)
        spent, points = time.monotonic() - begun, []
        for rung, (step, picture) in enumerate(zip(steps, pictures, strict=True)):
            flip = rung >= len(steps) - FLIPS[self.quick]
            seconds = step["cpu"] / CORES if self.busy else step["wall"]
            points.append(_point(step["effort"], seconds, picture, reference, band, flip))
        last = points[-1] if points else None
        told = (
            f"{last.seconds:9.2f} s  {last.error.value:.2e}" if last else self._why or "no picture"
        )
        print(f"{contender:18} {len(points):3} points in {spent:5.1f} s; {told}", flush=True)
        return points, pictures

    def _band(self, name: str) -> Any:
        images = self._workers["photon_stream"].features(self._folder / "features.npz")
        camera = Scene.load(self._snapshot(name)).camera
        return grown(discontinuities(images, camera), BAND)

    def _snapshot(self, name: str) -> Path:
        return self._folder / f"{name}.npz"

    def _drop(self, module: str) -> None:
        if worker := self._workers.pop(module, None):
            worker.close()


def _point(
    effort: float, seconds: float, picture: Any, reference: Reference, band: Any, flip: bool
) -> Point:
    errors = squared_errors(picture, reference)
    flips = flip_map(picture, reference.mean) if flip else np.full(band.shape, np.nan)
    return Point(
        effort, seconds,
        mean_of(errors), mean_of(errors, ~band), mean_of(errors, band),
        mean_of(lenient_errors(picture, reference)),
        float(flips.mean()), float(flips[~band].mean()), float(flips[band].mean()),
    )  # fmt: skip


class Load:
    """How much of the machine's processor time others took."""

    def __init__(self) -> None:
        self._begun = self._read()

    def others(self) -> float:
        """Share of all cores' time since construction that neither this run used nor idled; NaN
        where the system does not say."""
        total, busy, own = (b - a for a, b in zip(self._begun, self._read(), strict=True))
        return max(0.0, busy - own) / total if total > 0 else float("nan")

    def _read(self) -> tuple[float, float, float]:
        try:
            fields = Path("/proc/stat").read_text().split("\n", 1)[0].split()[1:9]
        except OSError:
            return 0.0, 0.0, 0.0
        ticks = [float(field) for field in fields]
        idle = ticks[3] + ticks[4]
        own = os.times()
        used = own.user + own.system + own.children_user + own.children_system
        return sum(ticks) / _TICKS, (sum(ticks) - idle) / _TICKS, used


_TICKS = os.sysconf("SC_CLK_TCK") if hasattr(os, "sysconf") else 100


def write(folder: Path, head: Sequence[str], scenes: Sequence[SceneResult]) -> None:
    """chart.html, chart.json, chart.md and the SVGs."""
    promises = verdicts(list(scenes))
    (folder / "chart.html").write_text(page(head, promises, scenes), encoding="utf-8")
    lines = "\n".join(f"- {line}" for line in [*head, *promises])
    table = summary(list(scenes), sorted(CONTENDERS, key=lambda name: name != OURS))
    (folder / "chart.md").write_text(f"{table}\n{lines}\n", encoding="utf-8")
    data: dict[str, Any] = {"run": list(head), "promises": promises, "scenes": {}}
    for scene in scenes:
        (folder / f"{scene.name}.svg").write_text(curves_figure(scene), encoding="utf-8")
        data["scenes"][scene.name] = {
            "reference": scene.notes,
            "variance of a half": scene.half_noise,
            "refused": scene.refused,
            "where our seconds go": scene.where,
            "curves": {n: [asdict(p) for p in points] for n, points in scene.curves.items()},
        }
    text = json.dumps(data, indent=1).replace("NaN", "null")
    (folder / "chart.json").write_text(text, encoding="utf-8")


def show(table: Table) -> None:
    titles, rows = table
    widths = [max(map(len, column)) for column in zip(titles, *rows, strict=True)]
    for row in (titles, *rows):
        cells = (cell.ljust(width) for cell, width in zip(row, widths, strict=True))
        print("  " + "  ".join(cells))


def main() -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("scene", nargs="*", choices=[[], *SCENES], help="default: all")
    parser.add_argument("--quick", action="store_true", help="in ten minutes")
    parser.add_argument("--minutes", type=float, help="of the whole run")
    parser.add_argument("--busy", action="store_true", help="count processor time over cores")
    parser.add_argument("-o", "--output", type=Path, default=Path("chart"), metavar="FOLDER")
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)
    names = [n for n in arguments.scene or SCENES if reference_file(n).exists()]
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # so that the engines' processes end
    begun, load = time.monotonic(), Load()
    results: list[SceneResult] = []
    with tempfile.TemporaryDirectory() as folder:
        minutes = arguments.minutes or MINUTES[arguments.quick]
        run = Run(arguments.quick, arguments.busy, minutes, len(names), Path(folder))
        try:
            for name in names:
                print(f"\n{name}", flush=True)
                results.append(run.scene(name))
                show(equal_error(results[-1]))
                show(equal_time(results[-1]))
                print(f"  where our time goes: {where_time_goes(results[-1])}", flush=True)
        finally:
            run.close()
    spent = (time.monotonic() - begun) / 60
    others = load.others()
    head = [
        f"{processor()}, {time.strftime('%Y-%m-%d')}",
        *run.about.values(),
        *(f"{module} is not here: {why}" for module, why in run.absent.items()),
        *["flip-evaluator is not here: no HDR-FLIP"] * (find_spec("flip_evaluator") is None),
        f"{SIZE}x{SIZE}; {spent:.1f} minutes; {'quick' if arguments.quick else 'full'} run",
        f"others on this machine took {others:.0%} of its processor time meanwhile"
        + ("; SECONDS ARE PROCESSOR TIME DIVIDED BY CORES" if arguments.busy else "")
        + ("; wall times are too long by that" if others > 0.05 and not arguments.busy else ""),
    ]
    write(arguments.output, head, results)
    print("\n" + "\n".join([*head, "", *verdicts(results)]))
    print(f"\nWrote {arguments.output / 'chart.html'}")


if __name__ == "__main__":
    main()
