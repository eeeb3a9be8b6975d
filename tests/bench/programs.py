# SPDX-License-Identifier: GPL-3.0-or-later
"""What programs of materials cost a point: `python -m tests.bench.programs [LAYER]`.

Processor seconds of Shade alone on the eye's rays of a room whose every wall has a program, as
straight code and by the interpreter, and those to set up the first time.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from typing import get_args

import numpy as np

from addon.photon.kernels.launch import launch
from addon.photon.prepare import prepare
from addon.photon.scene import Instruction, Result, Scene
from addon.photon.settings import BackendName, Settings
from addon.photon.stage import straight
from addon.streams import Device
from tests.scenes import cornell

SIZE, TIMES = 256, 5
LENGTHS = (0, 4, 12, 24)


def programmed(scene: Scene, length: int) -> Scene:
    """Each material's albedo by so many instructions of three kinds, from where the point is."""
    if not length:
        return scene
    program = [Instruction("geometry", ((0.0,) * 4, (0.0,) * 4))]
    while len(program) < length:
        last = Result(len(program) - 1)
        if len(program) % 3 == 2:
            program.append(Instruction("functions", (last, (1.3,) * 4, (5.0,) * 4)))
        else:
            operands = last, (0.9,) * 4, (0.1,) * 4, (4.0,) * 4
            program.append(Instruction("arithmetic", operands))
    varying = {"diffuse": Result(len(program) - 1)}
    materials = tuple(
        replace(material, program=tuple(program), varying=varying) for material in scene.materials
    )
    return replace(
        scene, materials=materials, objects=np.tile(np.eye(6, 4), (len(scene.surfaces), 1, 1))
    )


def measured(device: Device, scene: Scene, backend: str) -> tuple[float, float]:
    """Seconds to set up, and nanoseconds a point."""
    begin = time.process_time()
    renderer = prepare(scene, Settings(SIZE, SIZE, photons=256, backend=backend), device)
    renderer.render_pass()
    device.ctx.finish()
    first, eye = time.process_time() - begin, renderer.eye
    path = eye.send(1, (0, 0, SIZE, SIZE))
    eye.shade(path)
    spent = []
    for _ in range(TIMES):
        begin = time.process_time()
        launch(eye._shade, eye.of(path), eye._tables, eye._draw(path))
        device.ctx.finish()
        spent.append(time.process_time() - begin)
    renderer.release()
    return first, 1e9 * min(spent) / SIZE**2


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("backend", nargs="?", default="auto", choices=get_args(BackendName))
    backend, device = parser.parse_args().backend, Device()
    print(f"{device.name}, {backend}: ns a point, seconds to set up")
    most = straight.MOST_INSTRUCTIONS
    for length in LENGTHS:
        scene, cells = programmed(cornell(), length), []
        for limit in (most, 0)[: 1 + (length > 0)]:
            straight.MOST_INSTRUCTIONS = limit
            first, point = measured(device, scene, backend)
            cells.append(f"{'straight' if limit else 'interpreted'} {point:.0f} ({first:.2f} s)")
        print(f"{length} instructions: {', '.join(cells)}")


if __name__ == "__main__":
    main()
