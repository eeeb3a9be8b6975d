# SPDX-License-Identifier: GPL-3.0-or-later
"""From a film to the picture and its error, on the host."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from .denoise import Opened, picture_denoised
from .error import Error, error_of
from .film import Statistics
from .picture import FEATURES, images_for, picture_of
from .strips import StripFilm

Picture = dict[str, NDArray[np.float32]]


class Resolver(Protocol):
    """Resolves a film: makes the picture, and its estimated error, of the passes so far."""

    def resolve(self, wanted: Collection[str]) -> tuple[Picture, Error]:
        """The wanted images (`picture_of`), and the error of Combined, with its image if "Error" is
        wanted, too."""

    def release(self) -> None:
        """Free what is its own."""


class HostResolver:
    """Resolves by numpy what it reads of the film."""

    def __init__(self, film: StripFilm) -> None:
        self._film = film

    def resolve(self, wanted: Collection[str]) -> tuple[Picture, Error]:
        """As Resolver's."""
        strip_statistics = self._strip_statistics(wanted)
        images = self._picture(strip_statistics(), {*wanted, "Combined"})
        error = error_of(strip_statistics(), images["Combined"], "Error" in wanted)
        return {name: image for name, image in images.items() if name in wanted}, error

    def _strip_statistics(self, wanted: Collection[str]) -> Callable[[], Iterable[Statistics]]:
        """What gives those of the strips, with the means that `wanted` are made of. Of several each
        is read whenever it is asked for: what is made of them takes more than they do."""
        names = images_for(wanted)
        if len(self._film.strips) > 1:
            return lambda: self._film.strip_statistics(names)
        few = [*self._film.strip_statistics(names)]
        return lambda: few

    def _picture(self, strip_statistics: Iterable[Statistics], wanted: Collection[str]) -> Picture:
        images: Picture = {}
        for strip, statistics in zip(self._film.strips, strip_statistics, strict=True):
            for name, image in picture_of(statistics.means, wanted).items():
                if name not in images:
                    images[name] = np.empty((*self._film.shape, image.shape[2]), np.float32)
                images[name][strip.rows] = image
        return images

    def release(self) -> None:
        """As Resolver's."""


class DenoisingResolver(HostResolver):
    """The same without what is noise in Combined, of a film of two passes or more with halves."""

    by = "none"  # which denoiser made the last picture

    def __init__(self, film: StripFilm, opened: Opened) -> None:
        super().__init__(film)
        self._opened = opened

    def resolve(self, wanted: Collection[str]) -> tuple[Picture, Error]:
        """As Resolver's. Raises DenoiserError."""
        strip_statistics = self._strip_statistics({*wanted, *FEATURES})
        with_image = "Error" in wanted
        images = self._picture(strip_statistics(), {*wanted, *FEATURES, "Combined"})
        plain, found = (
            images["Combined"],
            picture_denoised(images, strip_statistics(), self._opened),
        )
        images["Combined"] = np.concatenate([found.picture, plain[..., 3:]], axis=-1)
        error = error_of(strip_statistics(), plain, with_image, found.picture, found.left)
        self.by = found.by
        return {name: image for name, image in images.items() if name in wanted}, error
