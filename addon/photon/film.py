# SPDX-License-Identifier: GPL-3.0-or-later
"""The film: the only state that passes share."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..streams import Device, Kernel, PingPong, Stream, Uniform
from ..streams.device import Layer
from .records import RADIANCE, SUM

Images = dict[str, NDArray[np.float64]]


class Accumulate(Kernel):
    """Add a pass to an image's compensated sum."""

    stem = "film"
    inputs = {"value": RADIANCE, "sum": SUM, "low": SUM}
    outputs = {"next_sum": SUM, "next_low": SUM}


class AccumulateVariance(Kernel):
    """Add a pass to an image's sum of squared differences."""

    stem = "film_variance"
    inputs = {"value": RADIANCE, "sum": SUM, "squares": SUM}
    outputs = {"next_squares": SUM}
    uniforms = {"passes_before": Uniform("int")}


class Film:
    """Running means of the images of a region, and the variance of the combined one.

    Films of separate pass ranges merge: see `merged`.
    """

    def __init__(
        self, device: Device, layer: Layer, size: tuple[int, int], names: tuple[str, ...]
    ) -> None:
        self.passes = 0
        self._kernel = Accumulate(device, layer)
        self._variance_kernel = AccumulateVariance(device, layer)
        self._sums = {name: PingPong(device, SUM, size) for name in names}
        self._lows = {name: PingPong(device, SUM, size) for name in names}
        self._squares = PingPong(device, SUM, size)
        for pair in (*self._sums.values(), *self._lows.values(), self._squares):
            pair.front.clear()

    def add(self, images: dict[str, Stream]) -> None:
        """Add one pass's images (RADIANCE streams by name; "combined" has its variance kept)."""
        squares = self._squares
        self._variance_kernel.run(
            {
                "value": images["combined"],
                "sum": self._sums["combined"].front,
                "squares": squares.front,
                "next_squares": squares.back,
            },
            uniforms={"passes_before": self.passes},
        )
        squares.swap()
        for name, sums in self._sums.items():
            lows = self._lows[name]
            self._kernel.run(
                {
                    "value": images[name],
                    "sum": sums.front,
                    "low": lows.front,
                    "next_sum": sums.back,
                    "next_low": lows.back,
                }
            )
            sums.swap()
            lows.swap()
        self.passes += 1

    def means(self) -> Images:
        """The mean of each image so far, float64 (h, w, 4), row 0 at the bottom."""
        count = max(self.passes, 1)
        return {
            name: (sums.front.download().astype(np.float64) + self._lows[name].front.download())
            / count
            for name, sums in self._sums.items()
        }

    def variance_of_mean(self) -> NDArray[np.float64]:
        """Variance of the combined image's mean, float64 (h, w, 4); inf before two passes."""
        if self.passes < 2:
            return np.full(self._squares.front.download().shape, np.inf)
        squares = self._squares.front.download().astype(np.float64)
        return squares / (self.passes - 1) / self.passes

    def release(self) -> None:
        """Free the streams and programs."""
        for pair in (*self._sums.values(), *self._lows.values(), self._squares):
            pair.release()
        self._kernel.release()
        self._variance_kernel.release()


def merged(parts: Sequence[tuple[int, Images]]) -> Images:
    """The means of all passes from (passes, Film.means()) of separate ranges.

    Merge means, then make the picture: `picture_of` divides by the coverage, and quotients of
    parts do not average to the quotient of the whole.
    """
    passes = sum(count for count, _ in parts)
    names = parts[0][1]
    weights = [count / passes for count, _ in parts]
    return {
        name: np.tensordot(weights, [means[name] for _, means in parts], axes=1) for name in names
    }
