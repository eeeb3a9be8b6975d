# SPDX-License-Identifier: GPL-3.0-or-later
"""`python build.py bench SCENE ...`: how fast a pass is, beside the machine, the paper and `auto`.

Measures the machine's own ceiling, every backend and estimator on the first scene kernel by kernel,
the renderer's own choice on all scenes, the paper's tables on cornell_box, and a grid of
combinations that shows whether `auto` chooses the fastest way. Prints tables, and writes bench.md,
bench.json and bench.svg. `--machine`, `--ways`, `--scenes`, `--paper`, `--choices` measure these
alone. Needs no Blender for snapshots (.npz), and takes a folder of them.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
import traceback
from collections.abc import Callable
from pathlib import Path

from addon.photon.backends.backend import open_device
from addon.photon.settings import Settings

from ..host import processor
from .backends import measure_machine, measure_scenes, measure_ways
from .choices import ALL_SHAPES, COMBINATIONS, measure_choices
from .launches import Timer
from .machine import describe
from .paper import measure_paper
from .passes import Clock
from .report import Report, duration
from .snapshots import load_scenes

MINUTES = 5.5
# (px a side, photons) unless the user says; on software OpenGL
SIZES = {False: (512, 262144), True: (256, 65536)}
# Of what is left of the time when a part begins, if another follows
SHARES = {"machine": 0.2, "ways": 0.3, "scenes": 0.15, "paper": 0.35, "choices": 1.0}
PAPER_SCENE = "cornell_box"


def parse() -> argparse.Namespace:
    """The options."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("scene", nargs="+", type=Path, help=".npz, folder of them, or .blend")
    parser.add_argument("-o", "--output", type=Path, default=Path("bench"), metavar="FOLDER")
    parser.add_argument("--minutes", type=float, default=MINUTES, help="of the whole run")
    parser.add_argument("--photons", type=int, help="a pass")
    parser.add_argument("--width", type=int)
    parser.add_argument("--height", type=int)
    parser.add_argument("--radius", type=float, default=0.0, help="0: automatic")
    parser.add_argument("--machine", action="store_true", help="its ceiling")
    parser.add_argument("--ways", action="store_true", help="each backend, estimator and kernel")
    parser.add_argument("--scenes", action="store_true", help="every scene, chosen by itself")
    parser.add_argument("--paper", action="store_true", help="the paper's tables")
    parser.add_argument("--choices", action="store_true", help="is `auto` the fastest?")
    parser.add_argument("--combinations", type=int, default=COMBINATIONS, help="of --choices")
    parser.add_argument("--shapes", action="store_true", help="every splat shape in --choices")
    return parser.parse_args()


def main() -> int:
    """Measure, print and write; 1 if a part failed."""
    arguments = parse()
    begun, clock = time.monotonic(), Clock(60 * arguments.minutes)
    scenes, exports, refused = load_scenes(arguments.scene)
    device = open_device(Settings())
    timer, report = Timer(device), Report(arguments.output)
    report.say(f"{processor()}; {describe(device)}; {time.strftime('%Y-%m-%d')}")
    report.say(f"load average at the start, by other work: {os.getloadavg()[0]:.1f}")
    for line in refused:
        report.say(line)
    for name, seconds in exports.items():
        report.say(f"{name}: exported from Blender in {duration(seconds)}")
    report.data["export [s]"] = exports
    if not scenes:
        raise SystemExit("no scene to render")
    first = PAPER_SCENE if PAPER_SCENE in scenes else next(iter(scenes))
    side, photons = SIZES[device.is_software]
    settings = Settings(
        width=arguments.width or side,
        height=arguments.height or arguments.width or side,
        photons=arguments.photons or photons,
        radius=arguments.radius,
    )
    shapes = ALL_SHAPES if arguments.shapes else ("quad",)
    measures: dict[str, Callable[[Clock], None]] = {
        "machine": lambda _: measure_machine(report, timer, scenes[first], settings),
        "ways": lambda own: measure_ways(report, timer, first, scenes[first], settings, own),
        "scenes": lambda own: measure_scenes(report, timer, scenes, settings, own),
        "paper": lambda own: measure_paper(report, timer, scenes[PAPER_SCENE], own),
        "choices": lambda own: measure_choices(
            report, device, scenes, own, arguments.combinations, shapes
        ),
    }
    wanted = [part for part in measures if getattr(arguments, part)] or [*measures]
    if "paper" in wanted and PAPER_SCENE not in scenes:
        report.say(f"the paper's tables need {PAPER_SCENE}")
        wanted.remove("paper")
    failed = False
    for part in wanted:
        try:
            measures[part](clock if part == wanted[-1] else clock.part(SHARES[part]))
        except Exception as error:  # the other parts are worth their time all the same
            traceback.print_exc()
            report.say(f"{part} FAILED: {type(error).__name__}: {error}")
            failed = True
        report.write()
    print("\n" + "\n\n".join(table.text() for table in report.tables) + "\n")
    report.say(f"{time.monotonic() - begun:.0f} s in all")
    report.write()
    device.release()
    print(f"Wrote {arguments.output / 'bench.md'}, bench.json, bench.svg")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
