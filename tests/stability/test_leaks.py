# SPDX-License-Identifier: GPL-3.0-or-later
"""A thousand renders in one process leave no more behind than ten."""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import threading
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from addon.photon.errors import SceneError
from addon.photon.jobs.process import RendererProcess
from addon.photon.settings import Settings
from tests.scenes import cornell
from tests.stability.table import Measured

ROOT = Path(__file__).resolve().parents[2]
WARM = 4  # rounds in which programs are made, and caches of driver and C library fill
MOST_GROWTH = 12e6  # [bytes] of pages that the C library keeps, now more, now fewer
linux = pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")

IN_ONE_PROCESS = """
import json, sys
from addon.photon.photons.kept import Kept
from addon.photon.prepare import prepare
from addon.photon.settings import Settings
from addon.streams import Device
from tests.bench.host import resident
from tests.scenes import cornell
from tests.stability.gl_objects import living_objects
WAYS = [("native", "gather"), ("native", "splat"), ("fragment", "gather"), ("fragment", "splat")]
device = Device()
kept = Kept(device)
ways = WAYS + [("compute", "gather")] * device.has_compute
for _ in range(int(sys.argv[1])):
    for number, (backend, estimator) in enumerate(ways):
        settings = Settings(12 + number, 8, photons=300, backend=backend, estimator=estimator)
        scene = cornell(mirror=number % 3 == 0)
        renderer = prepare(scene, settings, device, kept if number % 2 else None)
        renderer.render_pass()
        if number:  # one is left in the middle
            renderer.render_pass()
            renderer.images()
        renderer.release()
    device.check()
    found = {"objects": living_objects(), "resident": resident("VmRSS")}
    print(json.dumps(found | {"free": device.free_memory(), "renders": len(ways)}), flush=True)
"""


@linux
@pytest.mark.stability(49)
def test_renders_on_one_device(measured: Measured, thorough: bool) -> None:
    """Every backend and estimator in turn, with and without what a render may keep."""
    command = [sys.executable, "-c", IN_ONE_PROCESS, str(200 if thorough else 12)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    rounds: list[dict[str, Any]] = [json.loads(line) for line in done.stdout.splitlines()]
    warm, last = rounds[WARM], rounds[-1]
    renders = sum(one["renders"] for one in rounds)
    changed = sum(abs(last["objects"][kind] - count) for kind, count in warm["objects"].items())
    print(f"{renders} renders, in the end {last['objects']}")
    assert measured(f"OpenGL objects more after {renders} renders", changed) == 0
    growth = last["resident"] - warm["resident"]
    assert measured("memory more, in MB", growth / 1e6) <= MOST_GROWTH / 1e6
    if warm["free"] is not None:  # others may use the GPU, too
        taken = warm["free"] - last["free"]
        assert measured("GPU memory more, in MB", taken / 1e6) <= 64


def held_by(pid: int) -> tuple[int, int]:
    """A process's resident memory [bytes], and its open files and threads."""
    status = Path(f"/proc/{pid}/status").read_text().splitlines()
    pages = next(line for line in status if line.startswith("VmRSS:"))
    handles = len(os.listdir(f"/proc/{pid}/fd")) + len(os.listdir(f"/proc/{pid}/task"))
    return 1024 * int(pages.split()[1]), handles


@linux
@pytest.mark.stability(49)
def test_renders_of_one_renderer_process(measured: Measured, thorough: bool) -> None:
    """With a cancelled and a failed one in every round; after that one the device is another."""
    process, counts = RendererProcess(), []
    settings = Settings(24, 16, photons=300, passes=2)
    broken = cornell().triangles.copy()
    broken[0, 0] = -1
    rounds, renders = (125, 8) if thorough else (8, 8)
    for _ in range(rounds):
        for number in range(renders - 2):
            backend = ("native", "fragment")[number % 2]
            scene = cornell(mirror=number % 3 == 0)
            *_, last = process.render(scene, replace(settings, backend=backend))
            assert last.done
        for event in process.render(cornell(), replace(settings, passes=1 << 20)):
            if event.passes_done:
                break
        with pytest.raises(SceneError, match="is outside"):
            list(process.render(replace(cornell(), triangles=broken), settings))
        assert process.pid
        ours = len(os.listdir("/proc/self/fd")) + threading.active_count()
        counts.append((process.pid, ours, *held_by(process.pid)))
    process.close()
    pids, ours, resident, handles = zip(*counts, strict=True)
    print([round(x / 1e6) for x in resident], handles, ours, pids)
    more = abs(ours[-1] - ours[WARM]) + abs(handles[-1] - handles[WARM])
    assert measured(f"files and threads more after {renders * rounds}", more) == 0
    # What the cancelled render leaves is given back a little later: now and then it is seen.
    growth = (statistics.median(resident[-5:]) - resident[WARM]) / 1e6
    assert measured("renderer's memory more, in MB", growth) <= MOST_GROWTH / 1e6
