# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays that are alive, moved to the front of smaller streams.

Where OpenGL is software a kernel takes as long for an element that is skipped as for any other, and
of the rays that lobes send on few are alive after a bounce or two.
"""

from __future__ import annotations

import numpy as np

from ..photons.paths import NARROWEST, halved
from .path import Path, PathStreams


class Compaction:
    """Halves the streams of paths as often as what is alive fits."""

    def __init__(self, whole: PathStreams) -> None:
        """`whole`: of a region's size."""
        self._whole = whole
        self._smaller: dict[tuple[int, int], PathStreams] = {}  # by size

    def compact(self, path: Path, alive: int) -> None:
        """Let a path, of whose rays so many are alive, be in streams of half the size or less."""
        size = halved(path.at.size, alive, NARROWEST)
        if size == path.at.size or not alive:
            return
        if size not in self._smaller:
            self._smaller[size] = self._whole.of_size(size)
        to = self._smaller[size]
        found = {name: pair.front.elements() for name, pair in path.at.rays().items()}
        there = np.flatnonzero(found["direction"].any(axis=1))
        for name, pair in to.rays().items():
            pair.front.take(found[name][there])
        to.ones["pixel"].take(path.at.ones["pixel"].elements()[there])
        path.pixels = there if path.pixels is None else path.pixels[there]
        path.at = to

    def release(self) -> None:
        """Put the streams back."""
        for streams in self._smaller.values():
            streams.release()
