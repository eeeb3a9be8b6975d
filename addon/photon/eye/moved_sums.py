# SPDX-License-Identifier: GPL-3.0-or-later
"""What rays that have moved to smaller streams add to their pixels' images: on the host, as
AddChain does it for all pixels at once. Software OpenGL would take as long for those that no ray is
of as for the others, after each bounce."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ...streams import PingPong, Stream

Array = NDArray[np.float32]


class MovedSums:
    """A pass's, of images by the names of AddChain's sums."""

    def __init__(self) -> None:
        self._sums: dict[str, Array] = {}  # (n, 4) of all pixels

    def begin(self) -> None:
        """Forget those of a pass that failed."""
        self._sums = {}

    def add(
        self,
        pixels: NDArray[np.int64],
        sums: Mapping[str, PingPong],
        seen: Mapping[str, Stream],
    ) -> None:
        """Add what the first elements of streams have seen, each of one of the pixels (k,); `sums`
        are what there is before the first time."""
        if not self._sums:
            self._sums = {name: pair.front.elements() for name, pair in sums.items()}
        more = {name: stream.elements()[: len(pixels)] for name, stream in seen.items()}
        features = [name for name in ("albedo_sum", "normal_sum") if name in more]
        if features:
            first = self._sums["normal_sum"][pixels, 3] == 0.0  # only mirrors so far
            for port in features:
                self._sums[port][pixels[first]] = more.pop(port)[first]
        if "background_sum" in more:
            self._sums["background_sum"][pixels, 3] -= more.pop("background_sum")[:, 0]
        if "caustics_sum" in more:
            self._sums["caustics_sum"][pixels, :3] += more.pop("caustics_sum")[:, :3]
        for name, own in more.items():
            self._sums[name][pixels] += own

    def finish(self, sums: Mapping[str, PingPong]) -> None:
        """End a pass: the images are whole again."""
        for name, own in self._sums.items():
            pair = sums[name]
            width, height = pair.back.size
            pair.back.upload(own.reshape(height, width, 4))
            pair.swap()
        self._sums = {}
