# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures of a picture's error, and of a curve of error against seconds."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from addon.photon.film.error import DARK

from .scenes import Reference

BLOCK = 16  # [px]: errors farther apart than this count as independent
STALLED = -0.4  # slope: noise alone would give -1
RESOLVED = 2.0  # standard errors above zero from which on an error counts as measured


@dataclass(frozen=True)
class Error:
    """A mean and its standard error."""

    value: float
    deviation: float

    @property
    def resolved(self) -> bool:
        """Whether the references' noise leaves anything of it."""
        return self.value > RESOLVED * self.deviation


@dataclass(frozen=True)
class Point:
    """A contender's picture at one effort."""

    effort: float  # passes, or samples a pixel
    seconds: float  # of rendering
    error: Error  # strict relMSE of the whole picture
    interior: Error  # away from discontinuities
    band: Error  # near them
    lenient: Error  # relMSE of the whole picture that hides what is darker than its mean
    flip: float  # mean HDR-FLIP; NaN where it was not measured
    flip_interior: float
    flip_band: float


def squared_errors(image: Any, reference: Reference) -> Any:
    """(h, w): squared errors over r^2 + (DARK mean r)^2 of the reference r; mean of channels. Their
    mean is strict relMSE.

    (x - A)(x - B) has the mean (x - truth)^2 as the halves' noise is independent: the references'
    noise adds scatter and no bias, and single pixels may be negative.
    """
    truth = reference.mean
    return _missed(image, reference, truth**2 + (DARK * truth.mean()) ** 2)


def lenient_errors(image: Any, reference: Reference) -> Any:
    """The same over the square of r or, where that is more, of its mean: what was measured up to
    2026-11-22. It hides the dark."""
    truth = reference.mean
    return _missed(image, reference, np.maximum(truth, truth.mean()) ** 2)


def _missed(image: Any, reference: Reference, scale: Any) -> Any:
    x = np.asarray(image, np.float64)
    return ((x - reference.a) * (x - reference.b) / scale).mean(axis=2)


def mean_of(errors: Any, mask: Any = None) -> Error:
    """The mean over the mask, and its standard error from the scatter of blocks."""
    h, w = errors.shape
    mask = np.ones((h, w), bool) if mask is None else mask
    count = mask.sum()
    if not count:
        return Error(math.nan, math.nan)
    value = errors[mask].mean()
    excess = np.where(mask, errors - value, 0.0)
    pad = ((0, -h % BLOCK), (0, -w % BLOCK))
    blocks = np.pad(excess, pad).reshape(-(-h // BLOCK), BLOCK, -(-w // BLOCK), BLOCK)
    return Error(float(value), float(np.sqrt((blocks.sum(axis=(1, 3)) ** 2).sum()) / count))


def flip_map(image: Any, reference: Any) -> Any:
    """(h, w): HDR-FLIP; NaN without the package flip-evaluator."""
    try:
        import flip_evaluator
    except ImportError:
        return np.full(np.shape(image)[:2], np.nan)
    # FLIP wants no negative values; row 0 at the top or the bottom is the same to it.
    pictures = [np.ascontiguousarray(np.maximum(p, 0), np.float32) for p in (reference, image)]
    found, _, _ = flip_evaluator.evaluate(
        *pictures, "HDR", applyMagma=False, computeMeanError=False
    )
    return np.asarray(found)[..., 0]


def seconds_to(points: Sequence[Point], target: float) -> float:
    """Seconds at which a curve reaches an error, log-log between points; inf if never."""
    ordered = _measured(points)
    for before, after in itertools.pairwise(ordered):
        a, b = before.error.value, after.error.value
        if a > target >= b:
            share = math.log(a / target) / math.log(a / b)
            return before.seconds * (after.seconds / before.seconds) ** share
    if ordered and ordered[0].error.value <= target:
        return ordered[0].seconds
    return math.inf


def seconds_by_slope(points: Sequence[Point], target: float) -> float:
    """Seconds at which a curve would reach an error it has not, by its last three points' slope;
    inf where it has levelled off, which is what STALLED calls it."""
    ordered = _measured(points)
    exponent = slope(ordered[-3:])
    if not ordered or not exponent < STALLED or ordered[-1].error.value <= target:
        return math.inf
    return float(ordered[-1].seconds * (target / ordered[-1].error.value) ** (1 / exponent))


def error_at(points: Sequence[Point], seconds: float) -> float:
    """Error after some seconds, log-log between points, of the last point after it; NaN before
    the first."""
    ordered = _measured(points)
    for before, after in itertools.pairwise(ordered):
        if before.seconds <= seconds < after.seconds:
            share = math.log(seconds / before.seconds) / math.log(after.seconds / before.seconds)
            return before.error.value * (after.error.value / before.error.value) ** share
    if ordered and ordered[-1].seconds <= seconds:
        return ordered[-1].error.value
    return math.nan


def slope(points: Sequence[Point]) -> float:
    """Fitted exponent of error against seconds; NaN of fewer than three points."""
    ordered = _measured(points)
    if len(ordered) < 3:
        return math.nan
    x = np.log([p.seconds for p in ordered])
    return float(np.polyfit(x, np.log([p.error.value for p in ordered]), 1)[0])


def efficiency(points: Sequence[Point]) -> float:
    """1 / (MSE t) of the last point [1/s]; NaN of none."""
    ordered = _measured(points)
    return 1 / (ordered[-1].error.value * ordered[-1].seconds) if ordered else math.nan


def _measured(points: Sequence[Point]) -> list[Point]:
    return [p for p in sorted(points, key=lambda p: p.seconds) if p.error.resolved]
