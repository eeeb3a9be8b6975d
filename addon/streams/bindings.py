# SPDX-License-Identifier: GPL-3.0-or-later
"""What a program reads and writes, bound in one call a kind: each call takes the host time, which a
GPU that has little to do waits for. And a barrier between launches, but only where one needs what
another has done: a GPU runs others at once, and a few slow threads of one hold up none of them.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterable
from typing import Any

import moderngl

from .functions import find_function

_MOST_ARRAYS = 1024  # of names, that are kept; a pass has a tenth of them
_SHADER_STORAGE_BUFFER = 0x90D2  # glcorearb.h

_names = ctypes.POINTER(ctypes.c_uint)
_FUNCTIONS: dict[str, tuple[Any, ...]] = {  # arguments, of OpenGL 4.4
    "glBindTextures": (ctypes.c_uint, ctypes.c_int, _names),
    "glBindImageTextures": (ctypes.c_uint, ctypes.c_int, _names),
    "glBindBuffersBase": (ctypes.c_uint, ctypes.c_uint, ctypes.c_int, _names),
}


class Bindings:
    """A device's. Where OpenGL 4.4 is missing, or not found, moderngl binds one after the other."""

    def __init__(self, ctx: Any) -> None:
        found = {name: find_function(name) for name in _FUNCTIONS if ctx.version_code >= 440}
        self._gl = {
            name: ctypes.CFUNCTYPE(None, *_FUNCTIONS[name])(address)
            for name, address in found.items()
            if address
        }
        self.is_whole = len(self._gl) == len(_FUNCTIONS)  # all of them are there
        self._arrays: dict[tuple[int, ...], Any] = {}
        self._barrier: Callable[[], None] = ctx.memory_barrier
        # OpenGL's names, of buffers below 0: what the next launch does, and what those did since
        # the last barrier.
        self._reads: list[int] = []
        self._writes: list[int] = []
        self._counts: list[int] = []
        self._read: set[int] = set()
        self._written: set[int] = set()
        self._counted: set[int] = set()

    def ready(self) -> None:
        """To be called before each launch of a compute program, once all that it uses is bound."""
        reads, writes, counts = self._reads, self._writes, self._counts
        read, written, counted = self._read, self._written, self._counted
        if not (
            written.isdisjoint(reads)
            and written.isdisjoint(writes)
            and written.isdisjoint(counts)
            and read.isdisjoint(writes)
            and read.isdisjoint(counts)
            and counted.isdisjoint(reads)
            and counted.isdisjoint(writes)
        ):
            self._put_barrier()
        read.update(reads)
        written.update(writes)
        counted.update(counts)
        reads.clear()
        writes.clear()
        counts.clear()

    def settle(self) -> None:
        """To be called before anything but a launch reads what programs write, or writes it."""
        if self._written or self._counted:
            self._put_barrier()

    def before_drawing(self) -> None:
        """To be called before each draw, whose order among launches OpenGL keeps: what is bound for
        it concerns none of these."""
        self.settle()
        for bound in (self._reads, self._writes, self._counts):
            bound.clear()

    def _put_barrier(self) -> None:
        self._barrier()
        for of_launches in (self._read, self._written, self._counted):
            of_launches.clear()

    def textures(self, textures: list[Any]) -> None:
        """To read, at units from 0."""
        self._reads += [texture.glo for texture in textures]
        if not self.is_whole:
            for unit, texture in enumerate(textures):
                texture.use(location=unit)
        elif textures:
            self._gl["glBindTextures"](0, len(textures), self._array(textures))

    def images(self, textures: list[moderngl.Texture]) -> None:
        """To write texels of, at units from 0."""
        self._writes += [texture.glo for texture in textures]
        if not self.is_whole:
            for unit, texture in enumerate(textures):
                texture.bind_to_image(unit, read=False, write=True)
        elif textures:
            self._gl["glBindImageTextures"](0, len(textures), self._array(textures))

    def lists(self, buffers: list[moderngl.Buffer], first: int = 0) -> None:
        """To read, from a binding of storage on."""
        self._reads += [-buffer.glo for buffer in buffers]
        self._bind(buffers, first)

    def buffers(self, buffers: list[moderngl.Buffer]) -> None:
        """To read and write, from the first binding of storage on."""
        self._writes += [-buffer.glo for buffer in buffers]
        self._bind(buffers, 0)

    def counter(self, buffer: moderngl.Buffer, is_counting: bool) -> None:
        """To add to, at the first binding of storage: in whatever order, which changes no sum."""
        self._counts += [-buffer.glo] * is_counting
        self._bind([buffer], 0)

    def _bind(self, buffers: list[moderngl.Buffer], first: int) -> None:
        if not self.is_whole:
            for binding, buffer in enumerate(buffers, first):
                buffer.bind_to_storage_buffer(binding)
        elif buffers:
            array = self._array(buffers)
            self._gl["glBindBuffersBase"](_SHADER_STORAGE_BUFFER, first, len(buffers), array)

    def _array(self, items: Iterable[Any]) -> Any:
        """OpenGL's names of these, as C has them."""
        names = tuple([item.glo for item in items])
        array = self._arrays.get(names)
        if array is None:
            if len(self._arrays) >= _MOST_ARRAYS:
                self._arrays.clear()
            array = self._arrays[names] = (ctypes.c_uint * len(names))(*names)
        return array
