# SPDX-License-Identifier: GPL-3.0-or-later
"""Time of a pass by kernel, of saved scenes: the processor's, on a GPU the clock's.

Run as `python -m tests.bench.kernels SCENE.npz ...`. Each launch is waited for, so on a GPU the
sum is more than a pass takes.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

from addon.photon.backends.backend import open_device
from addon.photon.backends.native_kernels import NativeTracer
from addon.photon.prepare import prepare
from addon.photon.scene import Scene
from addon.photon.settings import Settings
from addon.streams import Device, HostKernel, Kernel

BEFORE, PASSES = 2, 4  # passes that are not counted, and that are


def timed(device: Device, clock: Callable[[], float], spent: Counter[str], launch: Any) -> Any:
    """A launch that is waited for, its time noted."""

    def run(kernel: Kernel, *args: Any, **kwargs: Any) -> Any:
        device.ctx.finish()
        begun = clock()
        result = launch(kernel, *args, **kwargs)
        device.ctx.finish()
        spent[kernel.stem] += clock() - begun
        return result

    return run


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenes", nargs="+", type=Path)
    parser.add_argument("--size", type=int, default=256)
    args = parser.parse_args()
    settings = Settings(width=args.size, height=args.size, passes=BEFORE + PASSES)
    device, spent = open_device(settings), Counter[str]()
    clock = time.process_time if device.is_software else time.perf_counter
    for kind in (Kernel, HostKernel):
        kind._launch = timed(device, clock, spent, kind._launch)  # type: ignore[method-assign]
    NativeTracer.hits = timed(device, clock, spent, NativeTracer.hits)  # type: ignore[method-assign]
    for path in args.scenes:
        renderer = prepare(Scene.load(path), settings, device)
        for _ in range(BEFORE):
            renderer.render_pass()
        spent.clear()
        begun = clock()
        for _ in range(PASSES):
            renderer.render_pass()
        whole = clock() - begun
        most = ", ".join(f"{stem} {t / PASSES * 1e3:.1f}" for stem, t in spent.most_common(10))
        print(f"{path.stem}: {whole / PASSES * 1e3:.1f} ms a pass; {most}", flush=True)
        renderer.release()


if __name__ == "__main__":
    main()
