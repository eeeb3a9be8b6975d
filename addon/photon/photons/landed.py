# SPDX-License-Identifier: GPL-3.0-or-later
"""Few photons that have landed, as numpy has them: what is learned from them before a pass."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import photon_stream_native as native
from numpy.typing import NDArray

from .mapper import Mapper, PhotonBatch
from .view import Doubles


@dataclass(frozen=True)
class Landed:
    """Photons of a pass, in order of bounce and photon."""

    places: NDArray[np.float32]  # (n, 4), of whose fourth numbers this does not tell
    facing: NDArray[np.float32]  # (n,) the normals of their surfaces, about, packed
    flux: Doubles  # (n,)
    numbers: NDArray[np.intp]  # (n,) the photons'
    first: int  # how many of these have not bounced

    def about(self, which: Any) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Places and normals of some, (k, 3)."""
        normals = native.unpack_directions(np.ascontiguousarray(self.facing[which]))
        return np.ascontiguousarray(self.places[which, :3]), normals


def trace_few(mapper: Mapper, index: int, photons: int) -> Landed:
    """Trace few photons of a pass, which bring direct light, too."""
    mapper.start(PhotonBatch(index, photons, numbered=True))
    places, deposits = mapper.finish().arrays()
    numbers = np.floor(deposits[:, 1])
    first = int(np.count_nonzero(numbers != deposits[:, 1]))
    flux = (deposits[:, 0] / np.float32(3.0)).astype(np.float64)
    facing = np.ascontiguousarray(deposits[:, 3])
    return Landed(places, facing, flux, numbers.astype(np.intp), first)


def mean_flux(deposits: NDArray[np.float32]) -> Doubles:
    """(n,) the mean of the channels of deposits (n, 4)."""
    total = deposits[:, 0] + deposits[:, 1] + deposits[:, 2]  # `mean` is slow for rows so short
    flux: Doubles = (total / np.float32(3.0)).astype(np.float64)
    return flux
