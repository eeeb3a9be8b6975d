# SPDX-License-Identifier: GPL-3.0-or-later
"""Picture and error of what a film holds, made on the host."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from .denoise import picture_denoised
from .error import Error, error_of
from .film import Exposure
from .picture import FEATURES, picture_of
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
        exposures = self._exposures()
        images = self._picture(exposures(), {*wanted, "Combined"})
        error = error_of(exposures(), images["Combined"], "Error" in wanted)
        return {name: image for name, image in images.items() if name in wanted}, error

    def _exposures(self) -> Callable[[], Iterable[Exposure]]:
        """What gives those of the strips. Of several each is read whenever it is asked for: what is
        made of them takes more than they do."""
        if len(self._film.strips) > 1:
            return self._film.exposures
        few = [*self._film.exposures()]
        return lambda: few

    def _picture(self, exposures: Iterable[Exposure], wanted: Collection[str]) -> Picture:
        images: Picture = {}
        for strip, exposure in zip(self._film.strips, exposures, strict=True):
            for name, image in picture_of(exposure.means, wanted).items():
                if name not in images:
                    images[name] = np.empty((*self._film.shape, image.shape[2]), np.float32)
                images[name][strip.rows] = image
        return images

    def release(self) -> None:
        """As Look's."""


class DenoisedLook(HostLook):
    """The same without what is noise in Combined, of a film of two passes or more with halves."""

    by = "none"  # which denoiser made the last picture

    def take(self, wanted: Collection[str]) -> tuple[Picture, Error]:
        """As Look's. Raises DenoiserError."""
        exposures, with_image = self._exposures(), "Error" in wanted
        images = self._picture(exposures(), {*wanted, *FEATURES, "Combined"})
        plain, found = images["Combined"], picture_denoised(images, exposures())
        images["Combined"] = np.concatenate([found.picture, plain[..., 3:]], axis=-1)
        error = error_of(exposures(), plain, with_image, found.picture, found.left)
        self.by = found.by
        return {name: image for name, image in images.items() if name in wanted}, error
