# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a pass's photons landed: a dense list, gathered bounce by bounce.

On the host for devices whose compute programs are software; else it never leaves the device.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Protocol

import moderngl
import numpy as np
from numpy.typing import NDArray

from ..streams import TABLE_WIDTH, Compaction, Device, Reading, Stream
from .geometry import upload_table

DEPOSIT_BYTES = 32  # two texels
MOST_APPENDS = 1025  # a pass: one a bounce, and the first hits


@dataclass(frozen=True)
class Copy:
    """A pass's deposits, to be pasted later: where they were, on the host or on the device."""

    count: int
    parts: tuple[Any, ...]  # place and deposit: arrays (count, 4), or buffers of whole table rows

    @property
    def bytes(self) -> int:
        """What it takes."""
        return sum(x.size if isinstance(x, moderngl.Buffer) else x.nbytes for x in self.parts)

    def release(self) -> None:
        """Free what is on the device."""
        for part in self.parts:
            if isinstance(part, moderngl.Buffer):
                part.release()


class Deposits(Protocol):
    """A list of deposits: place (position, surface + 1) and deposit (flux, packed normal)."""

    dropped: int  # deposits that were not finite, over all passes
    held: Any  # what they are of, as their user says; None since they last changed

    @property
    def count(self) -> int:
        """How many there are."""

    @property
    def room(self) -> int:
        """How many there may be before it grows."""

    def clear(self) -> None:
        """Begin a pass."""

    def make_room(self, count: int) -> None:
        """For so many in all."""

    def append(self, place: Stream, deposit: Stream, at_most: int | None) -> None:
        """Add the elements of the streams that are not zero, in order: `at_most` so many, or as
        many as there is room for."""

    def ask(self) -> None:
        """Ask the device how many there are; who needs to know then waits for what was before."""

    def tables(self) -> tuple[int, moderngl.Texture, moderngl.Texture]:
        """How many there are, and their textures (tables)."""

    def arrays(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """All of them as (P, 4) arrays on the host."""

    def copy(self) -> Copy:
        """All of them, beyond the pass; the caller releases them."""

    def paste(self, copy: Copy) -> None:
        """Begin a pass with copied ones, of this device and kind of list."""

    def release(self) -> None:
        """Free what is on the device."""


class HostDeposits:
    """Deposits in numpy arrays."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self._parts: list[tuple[NDArray[np.float32], NDArray[np.float32]]] = []
        self._uploaded: tuple[moderngl.Texture, ...] = ()
        self.dropped = 0
        self.held: Any = None

    @property
    def count(self) -> int:
        """How many there are."""
        return sum(len(place) for place, _ in self._parts)

    @property
    def room(self) -> int:
        """As many as there are."""
        return self.count

    def clear(self) -> None:
        """Begin a pass."""
        self._parts, self.held = [], None
        self.release()

    def make_room(self, count: int) -> None:
        """There is."""

    def append(self, place: Stream, deposit: Stream, at_most: int | None) -> None:
        """Download the streams and keep what landed."""
        places, deposits = (x.download().reshape(-1, 4) for x in (place, deposit))
        there = np.flatnonzero(places[:, 3])
        self.extend(places[there], deposits[there])

    def extend(self, places: NDArray[np.float32], deposits: NDArray[np.float32]) -> None:
        """Add (P, 4) places and deposits."""
        # One that is not finite would poison its neighbours, and does so to their sum.
        with np.errstate(invalid="ignore", over="ignore"):
            total = float(places.sum()) + float(deposits.sum())
        if not math.isfinite(total):
            finite = np.isfinite(places).all(axis=1) & np.isfinite(deposits).all(axis=1)
            self.dropped += int(np.count_nonzero(~finite))
            places, deposits = places[finite], deposits[finite]
        self._parts.append((places, deposits))

    def ask(self) -> None:
        """They are known."""

    def arrays(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """All deposits as (P, 4) arrays."""
        if not self._parts:
            none = np.zeros((0, 4), np.float32)
            return none, none
        if len(self._parts) > 1:
            places, deposits = zip(*self._parts, strict=True)
            self._parts = [(np.concatenate(places), np.concatenate(deposits))]
        return self._parts[0]

    def copy(self) -> Copy:
        """The arrays themselves: nobody writes to them."""
        return Copy(self.count, self.arrays())

    def paste(self, copy: Copy) -> None:
        """Take the arrays."""
        self.clear()
        place, deposit = copy.parts
        self._parts = [(place, deposit)]

    def tables(self) -> tuple[int, moderngl.Texture, moderngl.Texture]:
        """Upload the deposits, once a pass."""
        place, deposit = self.arrays()
        if not self._uploaded:
            self._uploaded = tuple(upload_table(self._device, x) for x in (place, deposit))
        return len(place), self._uploaded[0], self._uploaded[1]

    def release(self) -> None:
        """Free the uploaded tables."""
        for texture in self._uploaded:
            texture.release()
        self._uploaded = ()


class DeviceDeposits:
    """Deposits in textures that grow; compute programs append to them.

    How many there are is on the device too, and asked for when it must be known: waiting for it at
    each bounce left an H200 idle for a third of the time that a pass's photons took.
    """

    def __init__(self, device: Device) -> None:
        self._device = device
        self._compaction = Compaction(device, "compact")
        self._textures = self._allocate(1)
        # How many were dropped, which only grows (modulo 2^32), and where each append ends.
        self._counts = device.ctx.buffer(bytes(4 + 4 * MOST_APPENDS))
        self._counted = self._dropped = 0
        self._appends = 0  # of this pass
        self._at_most = 0  # as many deposits may there be
        self._known = True  # whether there are exactly so many
        self._reading: Reading | None = None  # since the last append
        self.held: Any = None

    @property
    def count(self) -> int:
        """How many there are (waits for the device)."""
        self._ask()
        return self._at_most

    @property
    def dropped(self) -> int:
        """Deposits that were not finite, over all passes (waits for the device)."""
        self._ask()
        return self._dropped

    @dropped.setter
    def dropped(self, number: int) -> None:
        self._ask()
        self._dropped = number

    def clear(self) -> None:
        """Begin a pass."""
        self._appends, self._at_most, self._known, self.held = 0, 0, True, None

    @property
    def room(self) -> int:
        """How many there may be."""
        return self._textures[0].height * TABLE_WIDTH

    def ask(self) -> None:
        """Ask how many there are, for later."""
        if not self._known:
            self._reading = self._device.ask(self._counts, 1 + self._appends)

    def make_room(self, count: int) -> None:
        """Grow, if need be."""
        if count <= self.room:
            return
        device, old, rows = self._device, self._textures, self._textures[0].height
        needed, limit = -(-count // TABLE_WIDTH), device.texture_limit
        self._textures = self._allocate(max(needed, min(2 * rows, limit)))
        if self._at_most:
            for source, target in zip(old, self._textures, strict=True):
                device.ctx.copy_framebuffer(
                    device.framebuffer([target]), device.framebuffer([source])
                )
        for texture in old:
            device.forget(texture)
            texture.release()

    def append(self, place: Stream, deposit: Stream, at_most: int | None) -> None:
        """Compact the streams onto the end of the list; what finds no room is counted, too."""
        elements = place.size[0] * place.size[1]
        if at_most is not None and self._at_most + at_most > self.room:
            self.make_room(self.count + at_most)
        streams = {"place": place.texture, "deposit": deposit.texture}
        self._compaction.count(elements, streams, [self._counts])
        number = {"append": self._appends}
        self._compaction.move(elements, streams, self._textures, [self._counts], number)
        self._appends += 1
        self._at_most += at_most or 0
        self._known, self._reading = False, None

    def tables(self) -> tuple[int, moderngl.Texture, moderngl.Texture]:
        """The list as it is on the device."""
        return self.count, *self._textures

    def arrays(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Download the list."""
        place, deposit = (self._device.texels(texture, self.count) for texture in self._textures)
        return place, deposit

    def copy(self) -> Copy:
        """The used rows of the textures, by a copy within the device."""
        size = 16 * TABLE_WIDTH * -(-self.count // TABLE_WIDTH)
        parts = []
        for texture in self._textures if size else ():
            whole, used = self._device.copy(texture), self._device.ctx.buffer(reserve=size)
            self._device.ctx.copy_buffer(used, whole, size)
            whole.release()
            parts.append(used)
        return Copy(self.count, tuple(parts))

    def paste(self, copy: Copy) -> None:
        """The same copy the other way."""
        self.clear()
        self.make_room(copy.count)
        rows = -(-copy.count // TABLE_WIDTH)
        for texture, buffer in zip(self._textures, copy.parts, strict=False):
            texture.write(buffer, viewport=(0, 0, TABLE_WIDTH, rows))
        self._at_most = copy.count

    def release(self) -> None:
        """Free textures and buffers."""
        for texture in self._textures:
            self._device.forget(texture)
        for item in (*self._textures, self._counts, self._compaction):
            item.release()

    def _ask(self) -> None:
        if self._known:
            return
        if not self._reading:
            self.ask()
        assert self._reading
        counted, *_, self._at_most = self._reading.numbers()
        self._known, self._reading = True, None
        self._dropped += (counted - self._counted) % (1 << 32)
        self._counted = counted

    def _allocate(self, rows: int) -> tuple[moderngl.Texture, moderngl.Texture]:
        place, deposit = (self._device.texture((TABLE_WIDTH, rows), 4) for _ in range(2))
        return place, deposit
