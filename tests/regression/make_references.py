# SPDX-License-Identifier: GPL-3.0-or-later
"""Render the reference pictures of blend_scenes with Cycles into blend_scenes/references.

    .venv/bin/python -m tests.regression.make_references [scene ...] [--samples N]

Takes half an hour on two cores; studio was made with 512 samples, daylight with 1024,
kitchen with 400. Each reference is the mean of RUNS renders with seeds of their own; how far these
differ is the noise that is printed and written in the file.
"""

from __future__ import annotations

import argparse

import bpy
import numpy as np

from .blocks import block_means
from .cycles import BOUNCES, REFERENCES, SCENES, SIZES, open_blend, render_cycles, write_exr

RUNS = 4


def main() -> None:
    """Render the scenes named on the command line, or all."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene", nargs="*", choices=[[], *SCENES], help="default: all")
    parser.add_argument("--samples", type=int, default=4096, help="a run and pixel")
    args = parser.parse_args()
    REFERENCES.mkdir(exist_ok=True)
    for name in args.scene or SCENES:
        runs = []
        for seed in range(1, RUNS + 1):
            exported = open_blend(name)
            runs.append(render_cycles(exported, args.samples, seed))
        image = np.mean(runs, axis=0, dtype=np.float64)
        blocks = np.array([block_means(run) for run in runs])
        with np.errstate(invalid="ignore"):
            noise = blocks.std(axis=0, ddof=1) / np.sqrt(RUNS) / blocks.mean(axis=0)
        size = SIZES[name]
        notes = (
            f"{name}.blend, Cycles of Blender {bpy.app.version_string}, {size}x{size}, "
            f"{RUNS} runs of {args.samples} samples, {BOUNCES} bounces, box filter; standard "
            f"error of 8x8 block means: {np.nanmedian(noise):.3%} median, "
            f"{np.nanpercentile(noise, 95):.3%} 95th percentile"
        )
        path = REFERENCES / f"{name}.exr"
        write_exr(path, image, notes)
        print(f"{path} ({path.stat().st_size // 1000} kB): {notes}")


if __name__ == "__main__":
    main()
