# SPDX-License-Identifier: GPL-3.0-or-later
"""Time one pass of a scene snapshot: `python -m tests.bench.frame SCENE.npz [--photons N] ...`.

Prints the median seconds of a pass for each layer and estimator, and of each kernel. No picture,
no Blender; nothing is asserted.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections import defaultdict
from typing import Any, get_args

from addon.photon.renderer import Renderer, open_device
from addon.photon.scene import Scene
from addon.photon.settings import Settings, SplatShape
from addon.streams import Device, HostKernel, Kernel


def time_passes(scene: Scene, settings: Settings, device: Device) -> tuple[float, Renderer]:
    """Median seconds of `settings.passes` passes after one to warm up."""
    renderer = Renderer(scene, settings, device)
    renderer.render_pass()
    device.ctx.finish()
    renderer.seconds.clear()
    seconds = []
    for _ in range(settings.passes):
        start = time.perf_counter()
        renderer.render_pass()
        device.ctx.finish()
        seconds.append(time.perf_counter() - start)
    return statistics.median(seconds), renderer


def time_kernels(renderer: Renderer) -> dict[str, tuple[float, int]]:
    """(seconds, launches) of each kernel in one pass, the device waited for after each."""
    spent: dict[str, list[float]] = defaultdict(list)
    runs = {kind: kind.run for kind in (Kernel, HostKernel)}

    def timed(kernel: Kernel, *args: Any, **kwargs: Any) -> int:
        kernel.device.ctx.finish()
        start = time.perf_counter()
        result = runs[HostKernel if isinstance(kernel, HostKernel) else Kernel](
            kernel, *args, **kwargs
        )
        kernel.device.ctx.finish()
        spent[kernel.stem].append(time.perf_counter() - start)
        return result

    try:
        for kind in runs:
            kind.run = timed  # type: ignore[method-assign]
        renderer.render_pass()
    finally:
        for kind, run in runs.items():
            kind.run = run  # type: ignore[method-assign]
    return {stem: (sum(times), len(times)) for stem, times in spent.items()}


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene")
    parser.add_argument("--photons", type=int, default=262144)
    parser.add_argument("--width", type=int, default=512)
    parser.add_argument("--height", type=int, default=512)
    parser.add_argument("--radius", type=float, default=0.0)
    parser.add_argument("--passes", type=int, default=7)
    parser.add_argument("--kernels", action="store_true", help="time each kernel, too")
    parser.add_argument("--splats", action="store_true", help="time splatting, too")
    arguments = parser.parse_args()
    scene = Scene.load(arguments.scene)
    base = {
        name: getattr(arguments, name)
        for name in ("photons", "width", "height", "radius", "passes")
    }
    device = open_device(Settings())
    print(f"{device.name}, OpenGL {device.version}; {arguments.scene}, {base}")
    layers = ["fragment", *["compute"] * device.has_compute, *["native"] * device.is_software]
    for layer in layers:
        ways: list[tuple[str, str]] = [("gather", "quad")]
        if arguments.splats:
            ways += [("splat", shape) for shape in get_args(SplatShape)]
        for estimator, shape in ways:
            settings = Settings(
                **base,
                layer=layer,
                estimator=estimator,
                splat_shape=shape,
                radius_shrink=1.0,  # type: ignore[arg-type]
            )
            median, renderer = time_passes(scene, settings, device)
            parts = ", ".join(
                f"{name} {1e3 * s / settings.passes:.1f}" for name, s in renderer.seconds.items()
            )
            how = estimator if estimator == "gather" else f"splat {shape}"
            print(f"{layer:9} {how:14} {1e3 * median:9.2f} ms a pass ({parts})", flush=True)
            if arguments.kernels:
                times = time_kernels(renderer)
                for stem, (spent, launches) in sorted(times.items(), key=lambda kv: -kv[1][0]):
                    print(f"    {stem:16} {1e3 * spent:9.3f} ms in {launches} launches")
            renderer.release()


if __name__ == "__main__":
    main()
