# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a pass's photons landed: a dense list, in order of bounce and photon.

On the host for devices whose compute programs are software; else it never leaves the device.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Protocol

import moderngl
import numpy as np
from numpy.typing import NDArray

from ...streams import TABLE_WIDTH, Compaction, Device, Reading, Stream
from ...streams.device import rounded_up
from ..stage.upload import upload_table

DEPOSIT_BYTES = 32  # two texels
MOST_APPENDS = 1025  # a pass: one a launch, of a bounce at least, and the first hits are one


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
    """A list of deposits: place (position, surface + 1, which tells the pass, too, as in
    glsl/lib/of_part.glsl) and deposit (flux, packed normal)."""

    dropped: int  # deposits that were not finite, over all passes
    held: Any  # what they are of, as their user says; None since they last changed

    @property
    def caustics(self) -> Deposits | None:
        """Those by way of lobes that are not diffuse, where they are told apart."""

    @property
    def count(self) -> int:
        """How many there are."""

    def clear(self) -> None:
        """Begin a pass."""

    def tables(self) -> tuple[int, moderngl.Texture, moderngl.Texture]:
        """How many there are, and their textures (tables)."""

    def arrays(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """All of them as (P, 4) arrays on the host: places, and deposits."""

    def fluxes(self) -> NDArray[np.float32]:
        """The second of `arrays` alone."""

    def copy(self) -> Copy:
        """All of them, beyond the pass; the caller releases them."""

    def paste(self, copy: Copy) -> None:
        """Begin a pass with copied ones, of this device and kind of list."""

    def release(self) -> None:
        """Free what is on the device."""


class HostDeposits:
    """Deposits in numpy arrays."""

    def __init__(self, device: Device, caustics: bool = False) -> None:
        """`caustics`: some are told apart."""
        self._device = device
        self.caustics = HostDeposits(device) if caustics else None
        self._parts: list[tuple[NDArray[np.float32], NDArray[np.float32]]] = []
        self._uploaded: tuple[moderngl.Texture, ...] = ()
        self.dropped = 0
        self.held: Any = None

    @property
    def count(self) -> int:
        """How many there are."""
        return sum(len(place) for place, _ in self._parts)

    def clear(self) -> None:
        """Begin a pass."""
        self._parts, self.held = [], None
        if self.caustics:
            self.caustics.clear()
        self._free()

    def append(self, place: Stream, deposit: Stream, caustic: Stream | None = None) -> None:
        """Add the elements of the streams that are not zero, in order; `caustic`: as `place`, of
        those that are told apart."""
        if self.caustics and caustic:
            self.caustics.append(caustic, deposit)
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

    def arrays(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """All deposits as (P, 4) arrays."""
        if not self._parts:
            none = np.zeros((0, 4), np.float32)
            return none, none
        if len(self._parts) > 1:
            places, deposits = zip(*self._parts, strict=True)
            self._parts = [(np.concatenate(places), np.concatenate(deposits))]
        return self._parts[0]

    def fluxes(self) -> NDArray[np.float32]:
        """The second of `arrays` alone."""
        return self.arrays()[1]

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
        self._free()
        if self.caustics:
            self.caustics.release()

    def _free(self) -> None:
        for texture in self._uploaded:
            self._device.free(texture)
        self._uploaded = ()


class DeviceDeposits:
    """Deposits in textures that grow; compute programs append to them.

    How many there are is on the device too, and asked for when it must be known: a GPU idles while
    the host waits for it.
    """

    def __init__(self, device: Device, caustics: bool = False) -> None:
        """`caustics`: some are told apart."""
        self._device = device
        self.caustics = DeviceDeposits(device) if caustics else None
        self._compaction = Compaction(device, "compact")
        self._textures: tuple[moderngl.Texture, ...] = self._allocate(1)
        # How many were dropped, which only grows (modulo 2^32), and where each append ends.
        self._counts = device.ctx.buffer(bytes(4 + 4 * MOST_APPENDS))
        self._counted = self._dropped = 0
        self._appends = 0  # of this pass
        self._count: int | None = 0  # None: not known since the last append
        self._reading: Reading | None = None  # of it
        self.held: Any = None

    @property
    def count(self) -> int:
        """How many there are (waits for the device)."""
        self._learn()
        assert self._count is not None
        return self._count

    @property
    def dropped(self) -> int:
        """Deposits that were not finite, over all passes (waits for the device)."""
        self._learn()
        return self._dropped

    @dropped.setter
    def dropped(self, number: int) -> None:
        self._learn()
        self._dropped = number

    def clear(self) -> None:
        """Begin a pass."""
        self._appends, self._count, self.held = 0, 0, None
        if self.caustics:
            self.caustics.clear()

    @property
    def room(self) -> int:
        """How many there may be."""
        return self._textures[0].height * TABLE_WIDTH

    def ask(self) -> None:
        """Ask the device how many there are; who needs to know then waits for what was before."""
        if self._count is None:
            self._reading = self._device.ask(self._counts, 1 + self._appends)
        if self.caustics:
            self.caustics.ask()

    def make_room(self, count: int) -> None:
        """For so many in all, before any is added: longer textures, if need be."""
        assert not self._appends  # what they hold is lost
        if self.caustics:
            self.caustics.make_room(count)
        if count <= self.room:
            return
        old, self._textures = self._textures, ()
        for texture in old:
            self._device.put_back(texture)
        rows = rounded_up(-(-count // TABLE_WIDTH))
        self._textures = self._allocate(min(rows, self._device.texture_limit))

    def append(
        self,
        place: Stream,
        deposit: Stream,
        caustic: Stream | None = None,
        *,
        rows: int | None = None,
    ) -> None:
        """Add the elements of the streams, or of their first `rows`, that are not zero, in order;
        what finds no room is counted, too; `caustic`: as HostDeposits'."""
        if self.caustics and caustic:
            self.caustics.append(caustic, deposit, rows=rows)
        elements = place.size[0] * (place.size[1] if rows is None else rows)
        streams = {"place": place.texture, "deposit": deposit.texture}
        self._compaction.count(elements, streams, [self._counts])
        number = {"append": self._appends}
        self._compaction.move(elements, streams, self._textures, [self._counts], number)
        self._appends += 1
        self._count, self._reading = None, None

    def tables(self) -> tuple[int, moderngl.Texture, moderngl.Texture]:
        """The list as it is on the device."""
        place, deposit = self._textures
        return self.count, place, deposit

    def arrays(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Download the list."""
        return self._device.texels(self._textures[0], self.count), self.fluxes()

    def fluxes(self) -> NDArray[np.float32]:
        """Download the second of `arrays` alone: a host takes its time for each."""
        return self._device.texels(self._textures[1], self.count)

    def copy(self) -> Copy:
        """The used rows of the textures, by a copy within the device."""
        size = 16 * TABLE_WIDTH * -(-self.count // TABLE_WIDTH)
        parts = []
        for texture in self._textures if size else ():
            whole, used = self._device.copy(texture), self._device.ctx.buffer(reserve=size)
            self._device.copy_buffer(used, whole, size)
            self._device.put_back(whole)
            parts.append(used)
        return Copy(self.count, tuple(parts))

    def paste(self, copy: Copy) -> None:
        """The same copy the other way."""
        self.clear()
        self.make_room(copy.count)
        rows = -(-copy.count // TABLE_WIDTH)
        for texture, buffer in zip(self._textures, copy.parts, strict=False):
            self._device.write(texture, buffer, (0, 0, TABLE_WIDTH, rows))
        self._count = copy.count

    def release(self) -> None:
        """Put the textures back, free the rest."""
        if self.caustics:
            self.caustics.release()
        for texture in self._textures:
            self._device.put_back(texture)
        for item in (self._counts, self._compaction):
            item.release()

    def _learn(self) -> None:
        if self._count is not None:
            return
        if not self._reading:
            self.ask()
        assert self._reading
        dropped, *_, self._count = self._reading.numbers()
        self._reading = None
        self._dropped += (dropped - self._counted) % (1 << 32)
        self._counted = dropped

    def _allocate(self, rows: int) -> tuple[moderngl.Texture, moderngl.Texture]:
        place, deposit = (self._device.texture((TABLE_WIDTH, rows), 4) for _ in range(2))
        return place, deposit
