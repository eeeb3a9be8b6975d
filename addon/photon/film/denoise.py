# SPDX-License-Identifier: GPL-3.0-or-later
"""A picture without noise, as far as its two halves tell that it is better: each half of the passes
is denoised on its own, and native/src/mixture.rs mixes what comes of it with the plain picture."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
import photon_stream_native as native
from numpy.typing import NDArray

from ...denoiser import Denoiser, DenoiserError, Way
from ..settings import FEWEST_PASSES
from .error import DARK, Floats, dark_of

Picture = NDArray[np.float32]
Result = TypeVar("Result")
Filter = Callable[[Picture], Picture]  # what takes a picture's noise out
Ways = Callable[[Denoiser], Sequence[Way]]  # that a picture is denoised in: one or two

FEATURE_PORTS = {"albedo": "Denoising Albedo", "normal": "Denoising Normal"}
ROWS = 64  # of a picture, that are compared at once
# Passes from which on there are two ways of denoising, by whether a GPU denoises: they take two to
# five times as long as one, on a processor as long as a pass or two.
FEWEST_FOR_TWO = {True: FEWEST_PASSES, False: 4 * FEWEST_PASSES}
# Pixels on each side over which errors are averaged: those of fewer are too uncertain to go by, and
# what the denoiser does well and what it spoils lies apart. 4 to 16 gain much the same.
REACH = 6
DIMMEST = -126  # exponent of what float32 has all digits of


@dataclass(frozen=True)
class Denoised:
    """A denoised picture and how much of its noise is left."""

    picture: Picture  # (h, w, 3)
    left: Floats  # (h, w) of the squared noise there was, 0 to 1
    by: str = ""  # which denoiser


def denoised(
    plain: Picture, half: Picture, share: float, filters: Iterable[Filter], unit: float = 1.0
) -> Denoised:
    """The mixture of a picture (h, w, 3) and of what one or two filters make of its halves: the
    first, or the mean of both if the halves tell that all of it is closer to the truth then.

    `half`: the mean of the first half of its passes; `share`: of all passes, which are those. Of
    one pass, with a share of 1, nothing tells that the picture is better as it is. `unit`: the
    light that is 1 to the filters, of which the first is done with when the second is asked for.
    """
    assert 0.0 < share <= 1.0
    if share == 1.0:
        whole = next(iter(filters))(np.maximum(plain, np.float32(0.0)) / np.float32(unit))
        return Denoised(whole * np.float32(unit), np.ones(plain.shape[:2], np.float32))
    halves = native.split_halves(plain, half, share, unit)
    dark = dark_of(float(plain.sum(dtype=np.float64)) / unit, plain.size // 3)
    clean: list[Picture] = []
    for filtered in filters:
        other = [np.ascontiguousarray(filtered(one)) for one in halves]
        if clean:
            other = [(one + two) / np.float32(2.0) for one, two in zip(clean, other, strict=True)]
        if not clean or is_better(other, clean, halves, dark):
            clean = other
    del other, halves
    of_halves = plain, half, share, clean[0], clean[1]
    return Denoised(*native.mix_halves(*of_halves, unit=unit, reach=REACH, dark=DARK))


def is_better(
    clean: Sequence[Picture], other: Sequence[Picture], halves: Sequence[Picture], dark: float
) -> bool:
    """Whether what is made of both halves is closer to the truth than what else is made of them:
    each by the other half, whose noise it does not know (glsl/kernels/filters_compared.glsl).
    `dark`: the light that counts as dark. False where anything is not finite."""
    worse = 0.0
    for first in range(0, len(halves[0]), ROWS):
        rows = slice(first, first + ROWS)
        (a, b), (c, d), (half, rest) = ([x[rows] for x in pair] for pair in (clean, other, halves))
        smooth = (a + b + c + d) / np.float32(4.0)
        apart = (a - c) * (a + c - 2.0 * rest) + (b - d) * (b + d - 2.0 * half)
        worse += float((apart / (smooth**2 + np.float32(dark**2))).sum(dtype=np.float64))
    return worse < 0.0


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


def unit_of(mean: float) -> float:
    """The light that is 1 to the filter, for a picture of this mean: it takes very dim light for
    none. Powers of two keep all digits."""
    return 2.0 ** max(math.floor(math.log2(mean)), DIMMEST) if 0.0 < mean < math.inf else 1.0


def picture_denoised(
    images: Mapping[str, Picture],
    half: Picture,
    share: float,
    opened: Opened,
    ways: Ways,
    apart: Picture | None = None,
) -> Denoised:
    """Combined of `images` without its noise, as `denoised`: by OpenImageDenoise, which goes by the
    first albedo and normal that are no mirror's, in one or two ways. What is `apart` (h, w, 3),
    and not in the half, it does not see. Raises DenoiserError."""
    plain = np.ascontiguousarray(images["Combined"][..., :3])
    if apart is not None:
        plain = plain - apart
    features = {port: images[name] for port, name in FEATURE_PORTS.items()}
    unit = unit_of(float(plain.mean(dtype=np.float64)))

    def filters_of(denoiser: Denoiser) -> Generator[Filter, None, None]:
        for way in ways(denoiser):
            with denoiser.filtering(plain.shape, features, way) as filtered:
                yield filtered

    def by(denoiser: Denoiser) -> Denoised:
        with closing(filters_of(denoiser)) as filters:
            found = denoised(plain, half, share, filters, unit)
        picture = found.picture if apart is None else found.picture + apart
        return replace(found, picture=picture, by=denoiser.name)

    return by_any(opened, by)


def by_any(opened: Opened, by: Callable[[Denoiser], Result]) -> Result:
    """What a denoiser makes: the one that is opened, or else the processor. Raises
    DenoiserError."""
    try:
        return by(opened.denoiser())
    except DenoiserError:  # a GPU may have no room beside the scene
        with Denoiser(on_cpu=True) as on_cpu:
            return by(on_cpu)
