# SPDX-License-Identifier: GPL-3.0-or-later
"""Strips of rows: as much of a picture as is rendered at a time, so that only sums grow with it."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ...streams import Device, Stream
from ..kernels.records import SUM
from ..settings import Region
from .film import Film, HostFilm, Images, Squares, Statistics


class Films(Protocol):
    """Who gives films: a backend."""

    device: Device

    @property
    def film_spares(self) -> int: ...
    def film(
        self,
        size: tuple[int, int],
        names: Sequence[str],
        spare: list[Stream],
        halved: Sequence[str],
    ) -> Film | HostFilm: ...


@dataclass(frozen=True)
class Strip:
    """Some rows of a picture, rendered together.

    All strips of a picture have one size, so that they share streams: where heights don't divide,
    a strip's upper rows are rendered with the strip above, too, and count there.
    """

    region: Region  # of the frame, as a border render's
    rows: slice  # of the picture that are this strip's own: its first ones

    @property
    def size(self) -> tuple[int, int]:
        """What is rendered of it, (width, height)."""
        x0, y0, x1, y1 = self.region
        return x1 - x0, y1 - y0

    @property
    def height(self) -> int:
        """How many rows are its own."""
        return int(self.rows.stop - self.rows.start)


def strips_of(region: Region, most: int) -> tuple[Strip, ...]:
    """The strips of a region of the frame, from the bottom, of `most` pixels, but for a row of
    more."""
    x0, y0, x1, y1 = region
    height = y1 - y0
    count = -(-height // max(1, most // (x1 - x0)))
    tall = -(-height // count)
    starts = [k * (height - tall) // max(1, count - 1) for k in range(count)]
    return tuple(
        Strip((x0, y0 + start, x1, y0 + start + tall), slice(start, end))
        for start, end in zip(starts, [*starts[1:], height], strict=True)
    )


class StripFilm:
    """A film for each strip of a region, and what they hold together."""

    def __init__(
        self,
        backend: Films,
        strips: Sequence[Strip],
        names: Sequence[str],
        halved: Sequence[str] = (),
    ) -> None:
        """`halved`: images of which half of the passes is kept apart, too."""
        self.strips, self._halved = strips, halved
        size = strips[0].size
        self._spare = [Stream(backend.device, SUM, size) for _ in range(backend.film_spares)]
        self.films: list[Film | HostFilm] = [
            backend.film(size, names, self._spare, halved) for _ in strips
        ]

    @property
    def emission_is_apart(self) -> bool:
        """Whether what lamps show is known of halves, and not denoised."""
        return "emission" in self._halved

    @property
    def has_halves(self) -> bool:
        """Whether it can be denoised."""
        return bool(self._halved)

    def prepare(self) -> None:
        """Begin with sums of nothing."""
        for film in self.films:
            film.prepare()

    @property
    def shape(self) -> tuple[int, int]:
        """The picture's rows and columns."""
        return self.strips[-1].rows.stop, self.strips[0].size[0]

    @property
    def passes(self) -> int:
        """How many passes are on all strips."""
        return self.films[-1].passes

    @property
    def half_passes(self) -> int:
        """How many of these the first half is."""
        return self.films[-1].half_passes

    def add(self, index: int, images: dict[str, Stream], passes: int = 1) -> None:
        """Add the images of strip `index` of a pass, or of passes together."""
        self.films[index].add(images, passes)

    def statistics_of(self, index: int, names: Collection[str] | None = None) -> Statistics:
        """What strip `index` holds, its own rows alone; of its images `names`, or all."""
        whole, height = self.films[index].statistics(names), self.strips[index].height
        return Statistics(
            whole.passes,
            {name: image[:height] for name, image in whole.means.items()},
            {
                length: Squares(squares.batches, squares.total[:height])
                for length, squares in whole.squares.items()
            },
            {name: image[:height] for name, image in whole.halves.items()},
            whole.half_passes,
        )

    def strip_statistics(self, names: Collection[str] | None = None) -> Iterator[Statistics]:
        """What each strip holds, from the bottom; of its images `names`, or all."""
        return (self.statistics_of(index, names) for index in range(len(self.strips)))

    def statistics(self) -> Statistics:
        """All that the films hold."""
        parts = list(self.strip_statistics())
        if len(parts) == 1:
            return parts[0]
        return Statistics(
            self.passes,
            {name: np.concatenate([part.means[name] for part in parts]) for name in parts[0].means},
            {
                length: Squares(
                    squares.batches, np.concatenate([part.squares[length].total for part in parts])
                )
                for length, squares in parts[0].squares.items()
            },
            {
                name: np.concatenate([part.halves[name] for part in parts])
                for name in parts[0].halves
            },
            parts[0].half_passes,
        )

    def means(self) -> Images:
        """The mean of each image so far, float64 (h, w, 4), row 0 at the bottom."""
        return self.statistics().means

    def release(self) -> None:
        """Free streams and kernels."""
        for film in self.films:
            film.release()
        for stream in self._spare:
            stream.release()
