# SPDX-License-Identifier: GPL-3.0-or-later
"""Photons that have landed, as streams of a bounce."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from addon.photon.kernels.records import DEPOSIT, PLACE
from addon.photon.photons.deposits import DeviceDeposits
from addon.streams import Device, Stream

SIZE = (64, 48)


def landed(seed: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """A bounce's streams: about a third of the elements holds a deposit."""
    rng = np.random.default_rng(seed)
    place, deposit = rng.uniform(-1, 1, (2, SIZE[1], SIZE[0], 4)).astype(np.float32)
    place[..., 3] = np.where(rng.random(place.shape[:2]) < 0.3, 2.0, 0.0)
    for array in (place, deposit):
        array[place[..., 3] == 0] = 0.0
    return place, deposit


def streams(device: Device, *arrays: NDArray[np.float32]) -> list[Stream]:
    made = [Stream(device, record, SIZE) for record in (PLACE, DEPOSIT)]
    for stream, array in zip(made, arrays, strict=True):
        stream.upload(array)
    return made


def expected(*bounces: tuple[NDArray[np.float32], NDArray[np.float32]]) -> NDArray[np.float32]:
    rows = np.concatenate([np.concatenate(b, axis=2).reshape(-1, 8) for b in bounces])
    return rows[rows[:, 3] != 0]


def make_room(deposits: Any, *bounces: tuple[NDArray[np.float32], NDArray[np.float32]]) -> None:
    """A list on the device does not grow by itself."""
    if isinstance(deposits, DeviceDeposits):
        deposits.make_room(len(expected(*bounces)))
