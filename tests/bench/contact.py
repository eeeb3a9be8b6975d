# SPDX-License-Identifier: GPL-3.0-or-later
"""Our error and what we tell of it, scene by scene: `python -m tests.bench.contact [scene ...]
[--passes N ...]`.

After so many passes of 256x256 at the default settings, against the chart's references: strict
relMSE, in brackets the lenient one; the share of it in the worst 20 of 1024 blocks, which is where
things touch; the error that the render tells of itself over the true one, root mean squares both;
and a pass's processor time, the lower quartile, for machines that others use.
"""

from __future__ import annotations

import argparse
import math
import time

import numpy as np

from addon.photon.backends.backend import open_device
from addon.photon.prepare import prepare
from addon.photon.scene import Scene
from addon.photon.settings import Settings
from addon.streams import Device

from .chart.contenders.cycles import open_scene
from .chart.measure import lenient_errors, squared_errors
from .chart.scenes import SCENES, SIZE, read_reference, reference_file

SEED = 1
WORST = 20  # blocks
BLOCK = 8  # [px]


def row(device: Device, name: str, scene: Scene, passes: list[int]) -> str:
    """A scene's row of the table."""
    reference, cells, spent, done = read_reference(name), [], [], 0
    settings = Settings(width=SIZE, height=SIZE, seed=SEED, passes=max(passes))
    renderer = prepare(scene, settings, device)
    try:
        for wanted in sorted(passes):
            while done < wanted:
                begun = time.process_time()
                renderer.render_pass()
                device.ctx.finish()
                spent.append(time.process_time() - begun)
                done += 1
            picture = renderer.images()["Combined"][..., :3]
            errors, told = squared_errors(picture, reference), renderer.error().total
            strict, lenient = errors.mean(), lenient_errors(picture, reference).mean()
            n = SIZE // BLOCK
            blocks = np.sort(errors.reshape(n, BLOCK, n, BLOCK).mean(axis=(1, 3)).ravel())
            worst = blocks[-WORST:].sum() / blocks.sum()
            ratio = f"{told / math.sqrt(max(strict, 1e-12)):.2f}" if told < math.inf else "-"
            cells.append(f"{strict:.2e} ({lenient:.1e}), {worst:.0%}, {ratio}")
    finally:
        renderer.release()
    pass_ms = 1000 * np.quantile(spent, 0.25)
    return f"| `{name}` | {' | '.join(cells)} | {pass_ms:.0f} ms |"


def main() -> None:
    """Print a Markdown table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("scene", nargs="*", choices=[[], *SCENES], help="default: all")
    parser.add_argument("--passes", type=int, nargs="+", default=[4, 16, 64])
    arguments = parser.parse_args()
    device = open_device(Settings())
    heads = [f"{n} passes" for n in sorted(arguments.passes)]
    print(f"| {device.name} | {' | '.join(heads)} | a pass |\n|{'---|' * (len(heads) + 2)}")
    for name in arguments.scene or SCENES:
        if reference_file(name).is_file():
            scene = open_scene(name, SIZE)
            device.use()
            print(row(device, name, scene, arguments.passes), flush=True)


if __name__ == "__main__":
    main()
