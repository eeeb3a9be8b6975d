# SPDX-License-Identifier: GPL-3.0-or-later
"""Render a saved scene without Blender: `python -m addon.photon.jobs.command SCENE.npz`."""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

from ..backends.backend import open_device
from ..errors import PhotonStreamError
from ..film.picture_file import check_writable, write_picture
from ..prepare import prepare
from ..scene import Scene
from ..settings import BackendName, Estimator, Settings
from .console import ProgressLine, error_text
from .interrupts import HUNG_UP, INTERRUPTED, Hangup, raising, say_last
from .process import Progress, last_error
from .stops import Stops

# Command line options that set a field of Settings, with its type.
SETTING_OPTIONS: dict[str, Any] = {
    "width": int,
    "height": int,
    "seed": int,
    "passes": int,
    "noise-threshold": float,
    "photons": int,
    "radius": float,
    "estimator": get_args(Estimator),
    "backend": get_args(BackendName),
    "caustics": bool,
    "illuminance": bool,
    "denoise": bool,
    "denoising-data": bool,
}


def add_setting_options(parser: argparse.ArgumentParser) -> None:
    """Add one option a setting; those not given stay None."""
    for name, kind in SETTING_OPTIONS.items():
        if kind is bool:
            parser.add_argument(f"--{name}", action="store_true", default=None)
        elif isinstance(kind, tuple):
            parser.add_argument(f"--{name}", choices=kind)
        else:
            parser.add_argument(f"--{name}", type=kind, metavar="N")


def given_settings(arguments: argparse.Namespace) -> dict[str, Any]:
    """The settings that the command line gave."""
    fields = [name.replace("-", "_") for name in SETTING_OPTIONS]
    values = {name: getattr(arguments, name) for name in fields}
    return {name: value for name, value in values.items() if value is not None}


def main(argv: list[str] | None = None) -> int:
    """Exit status: 0 with a picture; without one 1 after an error, 130 after Ctrl-C, and 129 when
    the terminal was closed."""
    parser = argparse.ArgumentParser(prog="build.py render", description=__doc__)
    parser.add_argument("scene", type=Path)
    parser.add_argument("-o", "--output", type=Path)
    add_setting_options(parser)
    arguments = parser.parse_args(argv)
    output = arguments.output or Path(arguments.scene.stem + ".png")
    try:
        with raising() as check:
            said = _render(arguments.scene, output, given_settings(arguments), check)
    except PhotonStreamError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt as interrupt:
        say_last("interrupted: no picture written")
        return HUNG_UP if isinstance(interrupt, Hangup) else INTERRUPTED
    print(said)
    return 0


def _proportioned(scene: Scene, given: dict[str, Any]) -> dict[str, Any]:
    """The settings with the side that was not given after the camera's window."""
    left, right, bottom, top = scene.camera.window
    aspect = (right - left) / (top - bottom)
    size = dict(given)
    if "width" not in given:
        size["width"] = max(1, round(given.get("height", Settings.height) * aspect))
    if "height" not in given:
        size["height"] = max(1, round(size["width"] / aspect))
    return size


def _render(path: Path, output: Path, given: dict[str, Any], check: Callable[[], None]) -> str:
    """What took how long, and how good the picture is; `check` raises when it was interrupted."""
    check_writable(output)
    Settings(**given).check()
    start = time.perf_counter()
    scene = Scene.load(path)
    settings = Settings(**_proportioned(scene, given))
    settings.check()
    loaded = time.perf_counter()
    device = open_device(settings)
    opened = time.perf_counter()
    renderer = prepare(scene, settings, device)
    for warning in renderer.warnings:
        print(f"warning: {warning}", file=sys.stderr)
    line = ProgressLine() if sys.stderr.isatty() else None
    progress = Progress("Rendering", 0, settings.passes, 0, 0.0, math.inf)
    try:
        stops, reached = Stops(settings), ""
        while not reached:
            check()
            renderer.render_passes(stops.most_together())
            done = renderer.film.passes
            elapsed = time.perf_counter() - start
            reached = stops.reached(done, elapsed, lambda: renderer.error().total)
            info = renderer.info()
            progress = replace(
                progress,
                passes_done=done,
                photons=info["photons"],
                elapsed=elapsed,
                remaining=(time.perf_counter() - opened) / done * max(0, stops.expected - done),
                info=info,
            )
            if line:
                line.show(progress)
    finally:
        if line:
            line.clear()
    rendered, said = time.perf_counter(), len(renderer.warnings)
    images, info = renderer.images(), renderer.info()
    for warning in renderer.warnings[said:]:
        print(f"warning: {warning}", file=sys.stderr)
    renderer.release()  # makes room
    check()
    write_picture(output, images, info)
    end = time.perf_counter()
    phases = {"load": loaded - start, "device": opened - loaded} | renderer.seconds
    phases["save"] = end - rendered
    lines = [f"wrote {output} in {end - start:.2f} s"]
    if known := last_error(info):
        lines.append(f"  {info['passes']} passes, {error_text(*known)}")
    lines.append("  " + ", ".join(f"{name} {seconds:.3f} s" for name, seconds in phases.items()))
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
