# SPDX-License-Identifier: GPL-3.0-or-later
"""A picture without noise, as far as its two halves tell that it is better.

Each half of the passes is denoised on its own. What a denoiser makes of one half is independent of
the noise of the other: so the halves tell the squared error of the plain picture, of the denoised
one and of any mixture of both, but for what both have from the photons' radius. About every pixel
the mixture is taken whose error is the least.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...denoiser import Denoiser, DenoiserError
from .blocks import in_blocks
from .error import DARK, Floats, box
from .film import Statistics
from .picture import first_half

Picture = NDArray[np.float32]
Filter = Callable[[Picture], Picture]  # what takes a picture's noise out

FEATURE_PORTS = {"albedo": "Denoising Albedo", "normal": "Denoising Normal"}
# Pixels on each side over which errors are averaged: those of fewer are too uncertain to go by, and
# what the denoiser does well and what it spoils lies apart. 4 to 16 gain much the same.
REACH = 6
# Of what is told to speak for the plain picture, so many standard errors count as chance.
SURE = 3.0


@dataclass(frozen=True)
class Denoised:
    """A denoised picture and how much of its noise is left."""

    picture: Picture  # (h, w, 3)
    left: Floats  # (h, w) of the squared noise there was, 0 to 1
    by: str = ""  # which denoiser


def denoised(plain: Picture, half: Picture, share: float, filtered: Filter) -> Denoised:
    """The mixture of a picture (h, w, 3) and of what `filtered` makes of its halves.

    `half`: the mean of the first half of its passes; `share`: of all passes, which are those;
    strictly between 0 and 1.
    """
    assert 0.0 < share < 1.0
    rest = 1.0 - share
    other = (plain - np.float32(share) * half) / np.float32(rest)
    clean, other_clean = (filtered(np.maximum(x, np.float32(0.0))) for x in (half, other))
    smooth = np.float32(share) * clean + np.float32(rest) * other_clean
    # Relative to the denoised picture: by its own value a bright speck would count for little.
    floor = DARK * (float(smooth.mean(dtype=np.float64)) or 1.0)
    noise, gained, apart = (np.empty(plain.shape[:2], np.float32) for _ in range(3))

    def work(rows: slice) -> None:
        scale = 1.0 / (np.square(smooth[rows], dtype=np.float64) + floor**2)
        between = (half[rows] - other[rows]).astype(np.float64)
        clean_between = clean[rows] - other_clean[rows]
        moved = smooth[rows].astype(np.float64) - plain[rows]
        # The variance of the plain mean; that, less its covariance with the denoised one's error.
        noise[rows] = share * rest * (between**2 * scale).mean(axis=-1)
        gained[rows] = share * rest * (between * (between - clean_between) * scale).mean(axis=-1)
        apart[rows] = (moved**2 * scale).mean(axis=-1)

    in_blocks(plain.shape, work)
    kept = apart - gained
    variance = box(kept**2, REACH) - box(kept, REACH) ** 2
    noise, gained, apart = (box(x, REACH) for x in (noise, gained, apart))
    # The plain picture moved by w towards the other has the error noise - 2 w gained + w^2 apart.
    sure = np.clip(_over(gained, noise), 0.0, 1.0) * np.clip(4.0 * _over(gained, apart), 0.0, 1.0)
    gained = apart - _shrunk(apart - gained, variance, sure)
    weight = 1.0 - box(np.clip(1.0 - _over(gained, apart), 0.0, 1.0), REACH)
    left = np.clip(_over(noise - weight * (2.0 * gained - weight * apart), noise), 0.0, 1.0)
    mixed = plain + weight[..., None] * (smooth - plain)
    return Denoised(mixed.astype(np.float32), np.where(noise > 0.0, left, 1.0))


def _shrunk(mean: Floats, variance: Floats, sure: Floats) -> Floats:
    """Means over REACH of what varies so, less the more uncertain they are (the non-negative
    garrote, Breiman 1995). Else, where noise is strong, chance alone would keep some of it.

    `sure`: 0 to 1, where noise is each pixel's own, and denoising gains.
    """
    error = SURE * sure * np.sqrt(np.maximum(variance, 0.0)) / (2 * REACH + 1)
    return np.maximum(0.0, mean - _over(error**2, np.maximum(mean, 0.0)))


def _over(a: Floats, b: Floats) -> Floats:
    """a / b, or zero where b is."""
    return np.divide(a, b, where=b > 0.0, out=np.zeros_like(a))


class Opened:
    """OpenImageDenoise, which a thread opens while others work: a GPU takes ten times as long for
    that as for a picture."""

    def __init__(self) -> None:
        self._thread = ThreadPoolExecutor(1)
        self._denoiser = self._thread.submit(Denoiser)

    def denoiser(self) -> Denoiser:
        """Open. Raises DenoiserError."""
        return self._denoiser.result()

    @property
    def has_failed(self) -> bool:
        """Whether it is known that it can't be opened."""
        return self._denoiser.done() and self._denoiser.exception() is not None

    def release(self) -> None:
        """Close it."""
        self._thread.shutdown()
        if not self._denoiser.exception():
            self._denoiser.result().close()


def picture_denoised(
    images: Mapping[str, Picture], strip_statistics: Iterable[Statistics], opened: Opened
) -> Denoised:
    """Combined of `images`, which were made of `strip_statistics`, without its noise: by
    OpenImageDenoise, which goes by the first albedo and normal that are no mirror's. Raises
    DenoiserError."""
    parts = [(first_half(one), one.half_passes / one.passes) for one in strip_statistics]
    half, share = np.concatenate([rows for rows, _ in parts]), parts[0][1]
    plain = np.ascontiguousarray(images["Combined"][..., :3])
    features = {port: images[name] for port, name in FEATURE_PORTS.items()}
    # The filter takes very dim light for none. Powers of two keep all digits.
    mean = float(plain.mean(dtype=np.float64))
    unit = np.float32(2.0 ** math.floor(math.log2(mean)) if 0.0 < mean < math.inf else 1.0)

    def by(denoiser: Denoiser) -> Denoised:
        with denoiser.filtering(plain.shape, features) as filtered:
            found = denoised(plain, half, share, lambda x: unit * filtered(x / unit))
        return replace(found, by=denoiser.name)

    try:
        return by(opened.denoiser())
    except DenoiserError:  # a GPU may have no room beside the scene
        with Denoiser(on_cpu=True) as on_cpu:
            return by(on_cpu)
