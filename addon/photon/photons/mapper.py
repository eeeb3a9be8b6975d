# SPDX-License-Identifier: GPL-3.0-or-later
"""What traces photons, and which it is asked for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..settings import Settings
from .deposits import Deposits

# Photons of pass 0 that tell the radii, whichever passes are rendered. Where it has no more, they
# are its own and are not traced again, and the first picture comes sooner than by fewer.
PILOT_PHOTONS = 1 << 19


@dataclass(frozen=True)
class PhotonBatch:
    """Photons of a pass, or of several that are traced together."""

    index: int  # of the first one
    photons: int  # that start in each
    # Deposits tell no colours, but their photons' numbers, and direct light is among them.
    numbered: bool = False
    passes: int = 1

    @property
    def all_photons(self) -> int:
        """Of all its passes."""
        return self.photons * self.passes

    def first_to_deposit(self, settings: Settings) -> int:
        """The bounce from which on photons are deposited: first hits are direct light."""
        return 0 if self.numbered or settings.direct_by_photons else 1


class Mapper(Protocol):
    """A PhotonMapper, a DevicePhotonMapper or a NativePhotonMapper."""

    unfinished: int  # photons that the bounce limit cut off, over all passes

    @property
    def deposits(self) -> Deposits:
        """Where the photons of the last batch landed."""

    def start(self, batch: PhotonBatch) -> None:
        """Launch a batch."""

    def finish(self) -> Deposits:
        """Its deposits, in order of bounce and photon."""

    def rays(self, index: int, photons: int) -> NDArray[np.float32]:
        """Where a pass's photons start, and where they go, (photons or more, 6)."""

    def launches(self) -> dict[str, int]:
        """How often each kernel has run."""

    def release(self) -> None:
        """Free what is on the device."""


def pilot_photons(settings: Settings) -> int:
    """How many photons tell the radii."""
    return min(settings.photons_a_pass, PILOT_PHOTONS)


def draw_of(settings: Settings, index: int) -> dict[str, int]:
    """What random numbers of a pass depend on."""
    return {"seed": settings.seed, "pass_index": index}
