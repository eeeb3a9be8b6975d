# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers that the device is asked for now and the host reads later, without emptying the queue."""

from __future__ import annotations

import ctypes
import struct
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from .functions import find_function
from .source import StreamError

SLOT = 1 << 14  # [bytes] that can be asked for at once
SLOTS = 16  # that may be on their way

# OpenGL 4.5 (glcorearb.h)
_MAP_READ, _MAP_PERSISTENT, _MAP_COHERENT = 0x0001, 0x0040, 0x0080
_SYNC_COMMANDS_COMPLETE, _FLUSH_COMMANDS, _WAIT_FAILED = 0x9117, 0x0001, 0x911D
_SECOND = 1_000_000_000  # [ns]

_name, _size, _pointer = ctypes.c_uint, ctypes.c_ssize_t, ctypes.c_void_p
_FUNCTIONS: dict[str, tuple[Any, ...]] = {  # result and arguments
    "glCreateBuffers": (None, ctypes.c_int, ctypes.POINTER(_name)),
    "glDeleteBuffers": (None, ctypes.c_int, ctypes.POINTER(_name)),
    "glNamedBufferStorage": (None, _name, _size, _pointer, _name),
    "glMapNamedBufferRange": (_pointer, _name, _size, _size, _name),
    "glCopyNamedBufferSubData": (None, _name, _name, _size, _size, _size),
    "glFenceSync": (_pointer, _name, _name),
    "glClientWaitSync": (_name, _pointer, _name, ctypes.c_uint64),
    "glDeleteSync": (None, _pointer),
}


class Reading:
    """Numbers on their way to the host."""

    def __init__(self, readback: Readback, slot: int, count: int, fence: Any) -> None:
        self._readback, self._slot, self._count, self._fence = readback, slot, count, fence
        self._data: bytes | None = None

    def data(self) -> bytes:
        """The numbers as they were when asked for; waits for what came before that."""
        if self._data is None:
            self._data = self._readback.take(self._slot, self._count, self._fence)
        return self._data

    def numbers(self) -> tuple[int, ...]:
        """As `data`, uint32."""
        return struct.unpack(f"{self._count}I", self.data())


class Readback:
    """Copies small buffers into memory that the host sees, a fence behind each copy.

    OpenGL's own reads wait for all that is in the queue: a GPU would idle while the host asks it
    how many photons are alive. Where OpenGL 4.5 is missing, numbers are copied when asked for all
    the same, and read so.
    """

    def __init__(self, ctx: Any) -> None:
        self._ctx = ctx
        self._taken: list[Reading | None] = [None] * SLOTS  # who has a slot
        self._next = 0
        self._large: tuple[int, int, int] | None = None  # name, bytes, address of a larger buffer
        self._gl = _functions() if ctx.version_code >= 450 else None
        if self._gl:
            self._name, self._memory = self._mapped(SLOT * SLOTS)
        else:
            self._staging = ctx.buffer(reserve=SLOT * SLOTS)

    def ask(self, buffer: moderngl.Buffer, count: int) -> Reading:
        """Ask for a buffer's first `count` uint32, as they are after all that was launched."""
        if 4 * count > SLOT:
            raise StreamError(f"{count} numbers are more than can be asked for at once")
        slot, self._next = self._next, (self._next + 1) % SLOTS
        if before := self._taken[slot]:
            before.data()
        fence = None
        if self._gl:
            copy = self._gl["glCopyNamedBufferSubData"]
            copy(buffer.glo, self._name, 0, slot * SLOT, 4 * count)
            fence = self._gl["glFenceSync"](_SYNC_COMMANDS_COMPLETE, 0)
        else:
            self._ctx.copy_buffer(self._staging, buffer, 4 * count, write_offset=slot * SLOT)
        reading = self._taken[slot] = Reading(self, slot, count, fence)
        return reading

    def take(self, slot: int, count: int, fence: Any) -> bytes:
        """What a reading finds in its slot; frees the slot."""
        self._taken[slot] = None
        if not self._gl:
            # moderngl cannot read no bytes.
            return bytes(self._staging.read(4 * count, offset=slot * SLOT)) if count else b""
        self._wait(fence)
        return ctypes.string_at(self._memory + slot * SLOT, 4 * count)

    def large(self, buffer: moderngl.Buffer, size: int) -> NDArray[np.float32] | None:
        """A buffer's first `size` bytes in memory that the device writes to: they hold until the
        next call. None where OpenGL 4.5 is missing."""
        if not self._gl:
            return None
        if self._large is None or self._large[1] < size:
            self._drop_large()
            name, address = self._mapped(size)
            self._large = name.value, size, address
        name, _, address = self._large
        self._gl["glCopyNamedBufferSubData"](buffer.glo, name, 0, 0, size)
        self._wait(self._gl["glFenceSync"](_SYNC_COMMANDS_COMPLETE, 0))
        memory: Any = (ctypes.c_char * size).from_address(address)
        return np.frombuffer(memory, np.float32)

    def _mapped(self, size: int) -> tuple[Any, int]:
        """A buffer that the host sees all the time: its name and where that is."""
        assert self._gl
        name, flags = ctypes.c_uint(), _MAP_READ | _MAP_PERSISTENT | _MAP_COHERENT
        self._gl["glCreateBuffers"](1, name)
        self._gl["glNamedBufferStorage"](name, size, None, flags)
        address = self._gl["glMapNamedBufferRange"](name, 0, size, flags)
        if not address:
            self._gl["glDeleteBuffers"](1, name)
            raise StreamError(f"OpenGL cannot map a buffer of {size} bytes")
        return name, address

    def _wait(self, fence: Any) -> None:
        assert self._gl
        waited = self._gl["glClientWaitSync"](fence, _FLUSH_COMMANDS, 60 * _SECOND)
        self._gl["glDeleteSync"](fence)
        if waited == _WAIT_FAILED:
            raise StreamError("OpenGL failed while the host waited for it")

    def _drop_large(self) -> None:
        if self._gl and self._large:
            self._gl["glDeleteBuffers"](1, ctypes.c_uint(self._large[0]))
        self._large = None

    def release(self) -> None:
        """Free the buffers, and the fences of what was never read."""
        for reading in filter(None, self._taken):
            reading.data()
        if self._gl:
            self._drop_large()
            self._gl["glDeleteBuffers"](1, self._name)
        else:
            self._staging.release()


def _functions() -> dict[str, Any] | None:
    """What moderngl does not call, if all of it is there."""
    found: dict[str, Any] = {}
    for name, kinds in _FUNCTIONS.items():
        address = find_function(name)
        if address is None:
            return None
        found[name] = ctypes.CFUNCTYPE(*kinds)(address)
    return found
