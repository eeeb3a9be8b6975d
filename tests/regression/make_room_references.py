# SPDX-License-Identifier: GPL-3.0-or-later
"""Render the references of the random rooms: `python -m tests.regression.make_room_references`.

Two halves a room of independent noise, by this renderer with a hundred times the photons of the
test and a quarter of its radius. Takes ten minutes on two cores.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from addon.photon.backends.backend import open_device
from addon.photon.settings import Settings
from tests.measure import render
from tests.scenes import random_room

FILE = Path(__file__).parent / "references" / "random_rooms.npz"
ROOMS, SIZE = 10, 48
HALVES = (1001, 1002)  # seeds


def main() -> None:
    """Render and save, float16: it resolves a twentieth of a percent."""
    device = open_device(Settings())
    rooms = {}
    for room in range(ROOMS):
        halves = [
            render(
                device,
                random_room(room),
                width=SIZE,
                height=SIZE,
                passes=256,
                photons=32768,
                radius=0.2,
                radius_decay=0.8,
                seed=seed,
            )["Combined"][..., :3]
            for seed in HALVES
        ]
        rooms[f"room{room}"] = np.array(halves, np.float16)
        print(f"room {room}", file=sys.stderr, flush=True)
    FILE.parent.mkdir(exist_ok=True)
    np.savez_compressed(FILE, **rooms)  # type: ignore[arg-type]


if __name__ == "__main__":
    main()
