# SPDX-License-Identifier: GPL-3.0-or-later
"""How far the picture is from the one that it converges to, as its own passes tell."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import photon_stream_native as native
from numpy.typing import NDArray

from .blocks import in_blocks
from .film import PAIR, Images, Statistics
from .picture import LEAST_COVERAGE

Floats = NDArray[np.floating[Any]]

# Of the picture's mean: what is darker counts by less than its relative error.
DARK = 0.1
INNER_AREA = 0.5  # as in density.glsl: area of the inner disc over the disc's
# What errors are relative to is a pixel's squared value, less what its own noise adds to that in
# the mean: a speck would else hide how far it is off. At least this share of it: a few batches tell
# the noise of what few rays find, such as a lamp's edge, no better.
LEAST_SQUARE = 0.25
# The bias over the change from the inner radius to the radius. If bias goes with r^p, it is
# 1 / (1 - INNER_AREA^(p / 2)): p = 2 where irradiance is smooth; p = 3/2 and 1/2, as root mean
# square, where it has creases and steps. Rooms fit p = 1.17, see tests/regression/test_error.py.
EXTRAPOLATION = 3.0
# Where less of the disc than this lies on the surface, the coverage's own noise hides the change:
# such pixels take the mean of the others, if those are at least LEAST_EVEN of all. Half discs
# count: next to what stands on a surface cuts tell the coverage without noise, and there is most of
# the bias.
EVEN = 0.4
READ = frozenset(("combined", "direct", "indirect", "mirror", "mirror_indirect", "blur"))
LEAST_EVEN = 0.1
# A pixel's own variance is known to 1 / sqrt(2 (batches - 1)): pooled over as many neighbours as
# make up for few batches.
POOLED = 16


@dataclass(frozen=True)
class Error:
    """Root mean square errors of a picture; infinite while unknown, before eight passes.

    Relative: each pixel's and channel's error over the root of x^2 + (DARK m)^2, of its value x
    without its own noise (LEAST_SQUARE) and the picture's mean m; the root of the mean of squares
    (the root of strict relMSE). Of a denoised picture x is the plain one's.
    """

    noise: float  # from the variance between passes
    bias: float  # from the radius
    # (h, w, 1) [W/(m^2 sr)], both together, of which `relative_squares` makes `total`. None: nobody
    # asked for it.
    image: Floats | None

    @property
    def total(self) -> float:
        """Noise and bias together."""
        return math.hypot(self.noise, self.bias)


def unknown_error(shape: tuple[int, int], with_image: bool) -> Error:
    """That of too few passes."""
    image = np.full((*shape, 1), np.inf, np.float32) if with_image else None
    return Error(math.inf, math.inf, image)


def dark_of(sum_of_light: float, pixels: int) -> float:
    """The light that counts as dark in a picture, of the sum of all its channels; > 0."""
    return DARK * (sum_of_light / (3 * pixels) or 1.0)


def error_of(
    strip_statistics: Iterable[Statistics],
    combined: Floats,
    with_image: bool = True,
    shown: Floats | None = None,
    left: Floats | None = None,
) -> Error:
    """The error of the picture `combined` (h, w, 3 or more) that was made of `strip_statistics`:
    those of the strips of its rows, from the bottom. If it was denoised, the error of the denoised
    picture `shown` (h, w, 3), where a share `left` (h, w) of the squared noise remains, but for
    what was not denoised: still relative to `combined`, for what is left of a speck hangs on chance
    as large as it was."""
    height, width = combined.shape[:2]
    shown = combined if shown is None else shown
    # By rows, so that it is the same for all strips.
    light = float(shown[..., :3].sum(axis=(1, 2), dtype=np.float64).sum())
    floor = dark_of(light, height * width)
    parts = ErrorParts(*(np.zeros((height, width), kind) for kind in (float, float, bool, bool)))
    row = batches = 0
    for statistics in strip_statistics:
        variance = statistics.variance_of_mean()
        if variance is None:
            return unknown_error((height, width), with_image)
        batches = statistics.squares[PAIR].batches
        strip = slice(row, row + len(variance))
        share = None if left is None else left[strip]
        _take(statistics, variance, combined, floor, strip, parts, share)
        row += len(variance)
    error = error_by(parts.totals())
    return error_with_image(error, parts, shown, floor, batches) if with_image else error


class Totals(NamedTuple):
    """Sums over a picture's pixels of what ErrorParts has of each."""

    pixels: int
    noise: float
    change: float
    even_change: float  # where the disc is even
    lit: int
    even: int

    @property
    def even_mean(self) -> float | None:
        """The change where the disc is even, if that is so of enough pixels."""
        return self.even_change / self.even if self.even > LEAST_EVEN * self.lit else None


def error_by(totals: Totals) -> Error:
    """Noise and bias, without an image."""
    change, even = totals.change, totals.even_mean
    if even is not None:
        change = totals.even_change + even * (totals.lit - totals.even)
    # Of the change's mean square, its own variance is no bias: it can leave less than nothing.
    bias = max(0.0, EXTRAPOLATION**2 * change / totals.pixels)
    return Error(math.sqrt(totals.noise / totals.pixels), math.sqrt(bias), None)


def error_with_image(
    error: Error, parts: ErrorParts, combined: Floats, floor: float, batches: int
) -> Error:
    """The error that `parts` give, with its image, which they end as; `batches` of pairs."""
    noises, changes, lit, even = parts
    relative = _pooled(noises, _reach(POOLED / max(1, batches - 1)), error.noise**2)
    filled = parts.totals().even_mean
    if filled is not None:
        changes[lit & ~even] = filled
    relative += _pooled(changes, max(1, max(changes.shape) // 64), error.bias**2)
    image = np.empty((*changes.shape, 1), np.float32)

    def scaled(rows: slice) -> None:
        # As relative_squares, the other way round.
        square = np.square(combined[rows, :, :3].astype(np.float64).mean(axis=-1))
        told = relative[rows] * (LEAST_SQUARE * square + floor**2)
        most = relative[rows] / (1.0 + relative[rows]) * (square + floor**2)
        image[rows, :, 0] = np.sqrt(np.maximum(told, most))

    in_blocks(combined.shape, scaled)
    return replace(error, image=image)


def relative_squares(image: Floats, brightness: Floats, floor: float) -> Floats:
    """The squares (h, w) of which `total` is the root of the mean, of the image of an error (h, w)
    and the picture's brightness."""
    errors, squares = np.square(image), np.square(brightness)
    found: Floats = errors / (np.maximum(squares - errors, LEAST_SQUARE * squares) + floor**2)
    return found


class ErrorParts(NamedTuple):
    """Of each pixel (h, w): what noise and blur add to the relative square, and whether light falls
    there, on a disc that is even enough."""

    noises: Floats
    changes: Floats
    lit: NDArray[np.bool_]
    even: NDArray[np.bool_]

    def totals(self) -> Totals:
        """Their sums."""
        sums = self.noises, self.changes, self.changes[self.even]
        noise, change, even = (float(part.sum(dtype=np.float64)) for part in sums)
        return Totals(self.lit.size, noise, change, even, int(self.lit.sum()), int(self.even.sum()))


def _take(
    statistics: Statistics,
    variance: Floats,
    combined: Floats,
    floor: float,
    strip: slice,
    parts: ErrorParts,
    left: Floats | None,
) -> None:
    """Write a strip's parts; `left`: of its noise, as error_of's."""

    def work(rows: slice) -> None:
        here = slice(strip.start + rows.start, strip.start + rows.stop)
        means = {name: mean[rows] for name, mean in statistics.means.items() if name in READ}
        # Float64: squares of a very dim picture's are beyond float32.
        value = combined[here, :, :3].astype(np.float64)
        # The picture divides indirect light by the coverage; so are its deviations divided.
        squares = np.square(_over(value, means["combined"][..., :3])) * variance[rows, :, :3]
        scale = np.square(value)
        scale = 1.0 / (np.maximum(scale - squares, LEAST_SQUARE * scale) + floor**2)
        noises = np.einsum("ijk,ijk->ij", squares, scale) / 3
        if left is not None:
            apart = np.minimum(_noises_apart(statistics, rows, scale), noises)
            noises = left[rows] * (noises - apart) + apart
        parts.noises[here] = noises
        if "blur" in means:
            change, colour, share = _change(means, variance[rows, :, 3])
            parts.changes[here] = change * np.einsum("ijk,ijk->ij", np.square(colour), scale) / 3
            parts.lit[here], parts.even[here] = share > 0, share >= EVEN

    in_blocks(variance.shape, work)


def _noises_apart(statistics: Statistics, rows: slice, scale: Floats) -> Any:
    """What the noise of emission adds to the relative square, where it is not denoised."""
    if "emission" not in statistics.halves:
        return 0.0
    half, mean = (x["emission"][rows, :, :3] for x in (statistics.halves, statistics.means))
    share = statistics.half_passes / statistics.passes
    return share / (1.0 - share) * np.einsum("ijk,ijk->ij", np.square(half - mean), scale) / 3


def _change(exact: Images, variance: Floats) -> tuple[Floats, Floats, Floats]:
    """The squared change of indirect light from the inner radius to the radius (h, w), less what of
    it is noise; the light's colour (h, w, 3), of mean one; the share of the disc on the surface."""
    means = {name: image.astype(np.float32) for name, image in exact.items()}
    weight, covered = means["direct"][..., 3], means["indirect"][..., 3]
    light = means["indirect"][..., :3]
    if "mirror" in means:
        weight = weight + means["mirror"][..., 3]
        covered = covered + means["mirror_indirect"][..., 3]
        light = light + means["mirror_indirect"][..., :3]
    on_surface = _over(covered, weight)
    share = np.maximum(on_surface, LEAST_COVERAGE)
    inner, inner_covered = np.moveaxis(means["blur"][..., :2], -1, 0)
    # What is nearer is no less covered, and no filter here weighs it more than twice as much.
    inner_share = np.clip(_over(inner_covered, weight), share, share / INNER_AREA)
    change = (means["combined"][..., 3] + inner) / share - inner / inner_share
    colour = _over(light, light.mean(axis=-1, keepdims=True))
    return np.square(change) - variance / np.square(share), colour, on_surface


def _over(a: Any, b: Any) -> Any:
    """a / b, or zero where b is."""
    return np.divide(a, b, where=b > 0, out=np.zeros(np.broadcast_shapes(a.shape, b.shape), "f4"))


def _mean(image: Floats) -> float:
    return float(image.mean(dtype=np.float64))


def _reach(pixels: float) -> int:
    """The smallest k with (2 k + 1)^2 >= pixels."""
    return max(0, math.ceil((math.sqrt(pixels) - 1) / 2))


def _pooled(image: Floats, reach: int, mean: float) -> Floats:
    """The mean over the square of `reach` pixels around each pixel, as much of it as there is,
    where it is positive; scaled so that its mean over the picture is `mean`."""
    if mean <= 0:
        return np.zeros(image.shape, np.float32)
    image = np.maximum(box(image, reach), np.float32(0.0))
    image *= np.float32(mean / (_mean(image) or 1.0))
    return image


def box(image: Floats, reach: int) -> Floats:
    """The mean over the square of `reach` pixels around each pixel of (h, w), as far as there
    are."""
    return native.box_mean(np.ascontiguousarray(image, np.float32), reach)
