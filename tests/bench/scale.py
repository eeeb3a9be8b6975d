# SPDX-License-Identifier: GPL-3.0-or-later
"""Seconds and memory over triangles, photons and pixels: `python -m tests.bench.scale [--most N]`.

One number grows fourfold a row while the others stay; each row has a process of its own. The last
columns say how many times as long the row took as if the row before it had grown with the number: 1
is linear, less is better. Processor time beside the clock's, for machines that others use; memory
as it was estimated and as it was, where /proc tells.
"""

from __future__ import annotations

import argparse
import multiprocessing
import sys
import time
from collections.abc import Callable
from dataclasses import replace

from addon.photon.backends.backend import open_device
from addon.photon.memory import Budget
from addon.photon.prepare import prepare
from addon.photon.renderer import Renderer
from addon.photon.settings import Settings
from tests.bench.host import resident
from tests.scenes import cornell, hills

BASE = Settings(width=256, height=256, photons=1 << 16, passes=3)
# Where they begin and end.
NUMBERS = {"triangles": (64, 1 << 22), "photons": (4096, 1 << 22), "pixels": (4096, 1 << 24)}


def measure(number: str, size: int, backend: str) -> tuple[int, list[float], list[float]]:
    """How large it became; [s] by (clock, processor) of the start and of the fastest pass;
    memory [bytes] estimated and taken."""
    settings, scene = replace(BASE, backend=backend), cornell()
    if number == "triangles":
        scene = hills(round((size / 2) ** 0.5))
        size = len(scene.triangles)
    elif number == "photons":
        settings = replace(settings, photons=size)
    else:
        side = round(size**0.5)
        settings = replace(settings, width=side, height=side)
    device = open_device(settings)
    before = resident("VmRSS")

    def timed(work: Callable[[], None]) -> tuple[float, float]:
        clock, processor = time.perf_counter(), time.process_time()
        work()
        device.ctx.finish()
        return time.perf_counter() - clock, time.process_time() - processor

    made: list[Renderer] = []
    start = timed(lambda: made.append(prepare(scene, settings, device)))
    (renderer,) = made
    passes = [timed(renderer.render_pass) for _ in range(1 + settings.passes)][1:]
    renderer.images()
    taken = resident("VmHWM") - before
    fastest = [min(spent) for spent in zip(*passes, strict=True)]
    return (
        size,
        [*start, *fastest],
        [Budget(scene, settings, renderer.backend).needed(), taken],
    )


def main() -> None:
    """Print a table for each number."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--most", type=int, default=1 << 24)
    parser.add_argument("--backend", default="auto")
    parser.add_argument("--only", choices=NUMBERS)
    arguments = parser.parse_args()
    print(open_device(BASE).name, BASE)
    context = multiprocessing.get_context("spawn")
    for number in [arguments.only] if arguments.only else NUMBERS:
        print(f"{number:>10}  start s    cpu s   pass s    cpu s  GB told    taken  start,   pass")
        (size, most), last = NUMBERS[number], None
        while size <= min(most, arguments.most):
            with context.Pool(1) as pool:
                grown, spent, memory = pool.apply(measure, (number, size, arguments.backend))
            cells = [*spent, *(x / 1e9 for x in memory)]
            if last:
                cells += [spent[k] / last[1][k] * last[0] / grown for k in (1, 3)]
            print(f"{grown:10}" + "".join(f"{x:9.3f}" for x in cells), flush=True)
            size, last = 4 * size, (grown, spent)


if __name__ == "__main__":
    sys.exit(main())
