# SPDX-License-Identifier: GPL-3.0-or-later
"""Few photons that have landed, as numpy has them: what is learned from them before a pass."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..film.blocks import in_blocks
from .mapper import Mapper, PhotonBatch
from .view import Doubles


@dataclass(frozen=True)
class Landed:
    """Photons of a pass, in order of bounce and photon."""

    places: Doubles  # (n, 3)
    normals: Doubles  # (n, 3) about, of their surfaces
    flux: Doubles  # (n,)
    numbers: NDArray[np.intp]  # (n,) the photons'
    first: int  # how many of these have not bounced


def trace_few(mapper: Mapper, index: int, photons: int) -> Landed:
    """Trace few photons of a pass, once for their numbers and once for normals."""
    batch = PhotonBatch(index, photons, first_hits=True)
    mapper.start(replace(batch, numbered=True))
    _, numbered = mapper.finish().arrays()
    numbers = numbered[:, 3].astype(np.intp)
    mapper.start(batch)
    place, deposit = mapper.finish().arrays()
    flux = ((deposit[:, 0] + deposit[:, 1] + deposit[:, 2]) / np.float32(3.0)).astype(np.float64)
    places, normals = place[:, :3].astype(np.float64), _unpacked(deposit[:, 3])
    falls = np.flatnonzero(np.diff(numbers) <= 0)
    first = int(falls[0]) + 1 if len(falls) else len(numbers)
    return Landed(places, normals, flux, numbers, first)


def _unpacked(codes: NDArray[np.float32]) -> Doubles:
    """(n, 3) photons' normals (glsl/lib/packing.glsl)."""
    normals = np.empty((len(codes), 3))

    def work(rows: slice) -> None:
        normals[rows] = _unpacked_few(codes[rows])

    in_blocks(codes.shape, work)
    return normals


def _unpacked_few(codes: NDArray[np.float32]) -> Doubles:
    x, y = np.divmod(codes.astype(np.float64), 4096.0)
    x, y = x / 4095.0 * 2.0 - 1.0, y / 4095.0 * 2.0 - 1.0
    z = 1.0 - np.abs(x) - np.abs(y)
    turned = (
        (1.0 - np.abs(y)) * np.where(x >= 0, 1, -1),
        (1.0 - np.abs(x)) * np.where(y >= 0, 1, -1),
    )
    normals = np.stack([np.where(z < 0, turned[0], x), np.where(z < 0, turned[1], y), z], axis=1)
    unit: Doubles = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    return unit
