# SPDX-License-Identifier: GPL-3.0-or-later
"""Render the references of moving_room.py with Cycles.

    .venv/bin/python -m tests.regression.make_moving_references [case ...] [--runs N] [--samples N]

Takes about five minutes on two cores. What is kept of each run, and how runs add up, is as in
make_glossy_references.py.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from .make_glossy_references import add_runs
from .moving_room import CASES, open_case

FILE = Path(__file__).parent / "references" / "moving_room.npz"


def main() -> None:
    """Render all cases, a run after the other."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("case", nargs="*", help="default: all")
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--samples", type=int, default=1024, help="a run and pixel")
    args = parser.parse_args()
    add_runs(FILE, args.case or CASES, open_case, args.runs, args.samples)


if __name__ == "__main__":
    main()
