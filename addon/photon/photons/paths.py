# SPDX-License-Identifier: GPL-3.0-or-later
"""The streams of photons under way."""

from __future__ import annotations

from typing import Generic, TypeVar

from ...streams import Device, PingPong, Stream
from ..kernels.records import FLUX, MEDIUM, RAY_DIRECTION, RAY_ORIGIN

STREAM_WIDTH = 1024  # photons a row


class Paths:
    """The streams of photons under way, which a bounce renews."""

    def __init__(self, device: Device, rows: int, media: bool) -> None:
        """`media`: photons carry what they are in."""
        self.device, self.rows, self.size = device, rows, (STREAM_WIDTH, rows)
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

    def __init__(self, device: Device, kind: type[AnyPaths], media: bool) -> None:
        """`media`: as Paths."""
        self._device, self._kind, self._media = device, kind, media
        self._paths: dict[int, AnyPaths] = {}  # by rows

    def of(self, photons: int) -> AnyPaths:
        """Those of a pass to begin."""
        rows = -(-photons // STREAM_WIDTH)
        if rows not in self._paths:
            self.release()  # of passes of another size
        return self._of_rows(rows)

    def halved(self, paths: AnyPaths, alive: int) -> AnyPaths:
        """Half the size or less, if as many photons fit there."""
        rows = paths.rows
        while rows > 1 and alive <= STREAM_WIDTH * (rows // 2):
            rows //= 2
        return self._of_rows(rows)

    def _of_rows(self, rows: int) -> AnyPaths:
        if rows not in self._paths:
            self._paths[rows] = self._kind(self._device, rows, self._media)
        return self._paths[rows]

    def release(self) -> None:
        """Put them back."""
        for paths in self._paths.values():
            paths.release()
        self._paths.clear()
