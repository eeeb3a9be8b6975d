# SPDX-License-Identifier: GPL-3.0-or-later
"""The streams of photons under way."""

from __future__ import annotations

from typing import Generic, TypeVar

from ...streams import Device, PingPong, Stream
from ..kernels.records import FLUX, MEDIUM, RAY_DIRECTION, RAY_ORIGIN

STREAM_WIDTH = 1024  # photons a row
NARROWEST = 32  # elements of a row: fewer take as long


class Paths:
    """The streams of photons under way, which a bounce renews."""

    def __init__(self, device: Device, size: tuple[int, int], media: bool) -> None:
        """`media`: photons carry what they are in."""
        self.device, self.rows, self.size = device, size[1], size
        records = {"origin": RAY_ORIGIN, "direction": RAY_DIRECTION, "flux": FLUX}
        records |= {"medium": MEDIUM} if media else {}
        self.pairs = {name: PingPong(device, of, self.size) for name, of in records.items()}

    def fronts(self) -> dict[str, Stream]:
        """What the next bounce reads."""
        return {name: pair.front for name, pair in self.pairs.items()}

    def backs(self) -> dict[str, Stream]:
        """What it writes."""
        return {name: pair.back for name, pair in self.pairs.items()}

    def swap(self) -> None:
        """End a bounce."""
        for pair in self.pairs.values():
            pair.swap()

    def release(self) -> None:
        """Put them back."""
        for pair in self.pairs.values():
            pair.release()


AnyPaths = TypeVar("AnyPaths", bound=Paths)


class PathsBySize(Generic[AnyPaths]):
    """The streams of a pass's photons, and smaller ones for those that are left of them."""

    def __init__(
        self,
        device: Device,
        kind: type[AnyPaths],
        media: bool,
        narrowest: int = STREAM_WIDTH,
    ) -> None:
        """`media`: as Paths; `narrowest`: what a row is made shorter to, for the last photons."""
        self._device, self._kind, self._media = device, kind, media
        self._narrowest = narrowest
        self._paths: dict[tuple[int, int], AnyPaths] = {}  # by size

    def of(self, photons: int) -> AnyPaths:
        """Those of a pass to begin."""
        size = STREAM_WIDTH, -(-photons // STREAM_WIDTH)
        if size not in self._paths:
            self.release()  # of passes of another size
        return self._of_size(size)

    def halved(self, paths: AnyPaths, alive: int) -> AnyPaths:
        """Half the size or less, if as many photons fit there."""
        return self._of_size(halved(paths.size, alive, self._narrowest))

    def _of_size(self, size: tuple[int, int]) -> AnyPaths:
        if size not in self._paths:
            self._paths[size] = self._kind(self._device, size, self._media)
        return self._paths[size]

    def release(self) -> None:
        """Put them back."""
        for paths in self._paths.values():
            paths.release()
        self._paths.clear()


def halved(size: tuple[int, int], elements: int, narrowest: int) -> tuple[int, int]:
    """A stream's size with half the rows as often as so many elements fit, and then with rows a
    quarter as wide, down to the narrowest: by halves there would be twice as many streams. Of rows
    that are no power of two there never is one: llvmpipe compiles programs for such sizes, and once
    more for others."""
    width, rows = size
    least = 1 if _is_power_of_two(rows) else 3
    while rows > least:
        fewer = rows // 2 + (least > 1 and _is_power_of_two(rows // 2))
        if elements > width * fewer:
            break
        rows = fewer
    while rows == least and width // 4 >= narrowest and elements <= width // 4 * rows:
        width //= 4
    return width, rows


def _is_power_of_two(number: int) -> bool:
    return number & (number - 1) == 0
