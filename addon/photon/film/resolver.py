# SPDX-License-Identifier: GPL-3.0-or-later
"""From a film to the picture and its error, on the host."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from functools import cache
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ...denoiser import Denoiser, Way
from ..settings import FEWEST_PASSES
from .denoise import FEWEST_FOR_TWO, Opened, picture_denoised
from .error import Error, error_of
from .film import Statistics
from .picture import FEATURES, OF_HALVES, first_half, images_for, picture_of
from .strips import StripFilm

Picture = dict[str, NDArray[np.float32]]
# What tells the error of a picture, as long as its film has no more passes: half of a look's time
# goes there, and who only looks need not wait for it.
Telling = Callable[[], Error]


class Resolver(Protocol):
    """Resolves a film: makes the picture, and its estimated error, of the passes so far."""

    def resolve(self, wanted: Collection[str]) -> tuple[Picture, Telling]:
        """The wanted images (`picture_of`), and what tells the error of Combined, with its image if
        "Error" is wanted, too."""

    def first_half(self) -> NDArray[np.float32]:
        """Combined (h, w, 3) of the passes of the first half, of a film that keeps it apart."""

    def release(self) -> None:
        """Free what is its own."""


class HostResolver:
    """Resolves by numpy what it reads of the film."""

    def __init__(self, film: StripFilm) -> None:
        self._film = film

    def resolve(self, wanted: Collection[str]) -> tuple[Picture, Telling]:
        """As Resolver's."""
        if not wanted:
            return {}, cache(self._error)
        strip_statistics = self._strip_statistics(wanted)
        images = self._picture(strip_statistics(), {*wanted, "Combined"})
        shown = {name: image for name, image in images.items() if name in wanted}
        if "Error" not in wanted:
            return shown, cache(self._error)
        error = error_of(strip_statistics(), images["Combined"])
        return shown, lambda: error

    def _error(self) -> Error:
        """Without an image."""
        strip_statistics = self._strip_statistics(())
        combined = self._picture(strip_statistics(), {"Combined"})["Combined"]
        return error_of(strip_statistics(), combined, with_image=False)

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

    def first_half(self) -> NDArray[np.float32]:
        """As Resolver's."""
        return np.concatenate([*map(first_half, self._film.strip_statistics(OF_HALVES))])

    def release(self) -> None:
        """As Resolver's."""


class DenoisingResolver(HostResolver):
    """The same without what is noise in Combined, of a film of a pass or more with halves."""

    by = "none"  # which denoiser made the last picture

    def __init__(
        self, film: StripFilm, plain: Resolver, opened: Opened, noisy_features: bool
    ) -> None:
        """`plain` resolves the film as it is; `noisy_features`: not at edges alone."""
        super().__init__(film)
        self._plain, self._opened, self._noisy_features = plain, opened, noisy_features

    def ways(self, denoiser: Denoiser) -> tuple[Way, ...]:
        """Of denoising now. By features that are filtered of few rays lamps in glass come out too
        wide."""
        passes = self._film.passes
        way = Way.FILTERED if self._noisy_features and passes >= FEWEST_PASSES else Way.GIVEN
        are_two = passes >= FEWEST_FOR_TWO[denoiser.is_on_gpu]
        return (way, Way.LARGEST) if are_two else (way,)

    def resolve(self, wanted: Collection[str]) -> tuple[Picture, Telling]:
        """As Resolver's. Raises DenoiserError."""
        asked = {*wanted, *FEATURES, "Combined"} - {"Error"}
        is_apart = self._film.emission_is_apart
        images, _ = self._plain.resolve(asked | ({"Emission"} if is_apart else set()))
        plain = images["Combined"]
        share = self._film.half_passes / self._film.passes
        half = self._plain.first_half()
        apart = images["Emission"] if is_apart else None
        found = picture_denoised(images, half, share, self._opened, self.ways, apart)
        images["Combined"] = np.concatenate([found.picture, plain[..., 3:]], axis=-1)
        self.by = found.by

        @cache
        def telling() -> Error:
            strip_statistics = self._film.strip_statistics(images_for(()))
            return error_of(strip_statistics, plain, "Error" in wanted, found.picture, found.left)

        return {name: image for name, image in images.items() if name in wanted}, telling
