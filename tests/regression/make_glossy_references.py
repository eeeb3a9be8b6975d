# SPDX-License-Identifier: GPL-3.0-or-later
"""Render the references of the glossy room with Cycles.

    .venv/bin/python -m tests.regression.make_glossy_references [case ...] [--runs N] [--samples N]

Takes half an hour on two cores. The noisiest, "dielectric 0.05 up" and "metal 0.05 up", had a
second dozen of runs. Of each run, which has a seed of its own, the means of 8x8 blocks are kept:
how far they differ is the references' noise. They are float16: it resolves a twentieth of a
percent, and a mean of runs more. The file is written after every run of all cases, and further
runs are added to it.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np

from .blocks import block_means
from .cycles import render_loaded
from .glossy_room import CASES, open_room

FILE = Path(__file__).parent / "references" / "glossy_room.npz"


def noise(runs: Any) -> Any:
    """The standard error of the mean of runs (runs, ...), relative to it."""
    runs = np.asarray(runs, np.float64)
    error = runs.std(axis=0, ddof=1) / np.sqrt(len(runs))
    return error / runs.mean(axis=0)


def load(file: Path = FILE) -> dict[str, Any]:
    """The means of the blocks of every run, by case: (runs, blocks, blocks, 3)."""
    if not file.exists():
        return {}
    with np.load(file) as data:
        return {name: data[name] for name in data.files}


def add_runs(
    file: Path, cases: Iterable[str], open_case: Callable[[str], object], runs: int, samples: int
) -> None:
    """Render runs of cases that `open_case` makes, and add them to a file."""
    found = load(file)
    for _ in range(runs):
        for case in cases:
            open_case(case)
            had = found.get(case, ())
            blocks = block_means(render_loaded(samples, len(had) + 1)).astype(np.float16)
            found[case] = np.concatenate([had, blocks[None]]) if len(had) else blocks[None]
            if len(had):
                shares = np.percentile(noise(found[case]), (50, 95))
                print(f"{case}: noise {shares[0]:.2%} median, {shares[1]:.2%} 95th percentile")
        np.savez_compressed(file, **found)  # type: ignore[arg-type]


def main() -> None:
    """Render all cases, a run after the other."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("case", nargs="*", help="default: all")
    parser.add_argument("--runs", type=int, default=12)
    parser.add_argument("--samples", type=int, default=1024, help="a run and pixel")
    args = parser.parse_args()
    cases = {case.name: case for case in CASES}
    add_runs(FILE, args.case or cases, lambda name: open_room(cases[name]), args.runs, args.samples)


if __name__ == "__main__":
    main()
