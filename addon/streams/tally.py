# SPDX-License-Identifier: GPL-3.0-or-later
"""Tally: how many elements of several runs of a program were alive, asked for once."""

from __future__ import annotations

from .device import Device
from .readback import Reading
from .source import StreamError


class Tally:
    """Slots on the device in which compute programs count, one a run."""

    def __init__(self, device: Device, slots: int) -> None:
        self._device, self._slots, self._used = device, slots, 0
        self._zeros = device.ctx.buffer(bytes(4 * slots))
        self.buffer = device.ctx.buffer(bytes(4 * slots))

    def clear(self) -> None:
        """Begin anew."""
        self._device.copy_buffer(self.buffer, self._zeros, self._zeros.size)
        self._used = 0

    def next_slot(self) -> int:
        """The slot of the run to come; StreamError if none is left."""
        if self._used == self._slots:
            raise StreamError(f"a tally of {self._slots} runs is full")
        self._used += 1
        return self._used - 1

    def ask(self) -> Reading:
        """The runs' counts, in order."""
        return self._device.ask(self.buffer, self._used)

    def release(self) -> None:
        """Free the buffers."""
        self.buffer.release()
        self._zeros.release()
