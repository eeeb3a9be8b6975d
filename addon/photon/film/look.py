# SPDX-License-Identifier: GPL-3.0-or-later
"""Picture and error of what a film holds, made on the host."""

from __future__ import annotations

from collections.abc import Collection
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from .error import Error, error_of
from .picture import picture_of
from .strips import StripFilm

Picture = dict[str, NDArray[np.float32]]


class Look(Protocol):
    """Makes pictures of the passes that a film has by now."""

    def take(self, wanted: Collection[str]) -> tuple[Picture, Error]:
        """The wanted images (`picture_of`), and how far Combined is from the converged one; with
        its image if "Error" is wanted, too."""

    def release(self) -> None:
        """Free what is its own."""


class HostLook:
    """By numpy, of what is read of the film."""

    def __init__(self, film: StripFilm) -> None:
        self._film = film

    def take(self, wanted: Collection[str]) -> tuple[Picture, Error]:
        """As Look's."""
        film = self._film
        # Strip after strip, and each read twice: what is made of them takes more than they do.
        few = [*film.exposures()] if len(film.strips) == 1 else None
        images: Picture = {}
        for strip, exposure in zip(film.strips, few or film.exposures(), strict=True):
            for name, image in picture_of(exposure.means, {*wanted, "Combined"}).items():
                if name not in images:
                    images[name] = np.empty((*film.shape, image.shape[2]), np.float32)
                images[name][strip.rows] = image
        error = error_of(few or film.exposures(), images["Combined"], "Error" in wanted)
        return {name: image for name, image in images.items() if name in wanted}, error

    def release(self) -> None:
        """As Look's."""
