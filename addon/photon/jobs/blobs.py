# SPDX-License-Identifier: GPL-3.0-or-later
"""Arrays on their way to the renderer process: files of a folder, named by their content.

The folder alone says what the renderer has, and a file there is a whole one. So what did not change
is not sent again, and a renderer that was started anew, with a folder of its own, gets everything.
"""

from __future__ import annotations

import math
import os
import weakref
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from hashlib import blake2b
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import RenderError
from ..scene.snapshot import bits_of

Layout = list[list[Any]]  # of each array: [name, dtype, shape]

BLOBS = "blobs"  # the folder, in the one that both processes share
PART = 1 << 20  # [bytes] that a thread digests at once
# [bytes] from which a file is mapped, not read: it takes no memory twice, but a descriptor, and a
# process may have a thousand of these, on some systems fewer.
MAPPED = 1 << 22
UNFINISHED = ".part"


def names_of(arrays: Sequence[NDArray[Any]]) -> list[str]:
    """The names of arrays by their content: BLAKE2b of dtype, shape and the digests of their parts,
    which are taken side by side."""
    with ThreadPoolExecutor() as pool:
        parts = [[pool.submit(_digest, part) for part in _parts(array)] for array in arrays]
    return [_name(array, digests) for array, digests in zip(arrays, parts, strict=True)]


def _parts(array: NDArray[Any]) -> Iterator[memoryview]:
    bits = bits_of(array)
    step = PART // bits.itemsize
    for start in range(0, len(bits), step):
        yield bits.data[start : start + step]


def _name(array: NDArray[Any], parts: Iterable[Future[bytes]]) -> str:
    whole = blake2b(repr((array.dtype.str, array.shape)).encode(), digest_size=16)
    for part in parts:
        whole.update(part.result())
    return whole.hexdigest()


def _digest(part: memoryview) -> bytes:
    return blake2b(part).digest()


class BlobWriter:
    """The sender's end: keeps in the folder what the last scene of each view layer needs."""

    def __init__(self, folder: Path) -> None:
        """`folder` is made at the first write."""
        self._folder = folder
        self._needed: dict[str, set[str]] = {}  # names by view layer

    def write(self, arrays: Sequence[NDArray[Any]], layer: str = "", layers: int = 1) -> Layout:
        """Bring all arrays of a layer's scene there, of a frame that has so many layers.

        Their layout, for `BlobReader.read`. Raises OSError if there is no room, and leaves none of
        a file that did not get whole.
        """
        names = names_of(arrays)
        if len({*self._needed, layer}) > layers:
            self._needed.clear()
        self._needed[layer] = set(names)
        self._folder.mkdir(exist_ok=True)
        there = self._sweep()
        for name, array in dict(zip(names, arrays, strict=True)).items():
            if there.get(name) != array.nbytes:
                self._write(name, array)
        return [
            [name, array.dtype.str, list(array.shape)]
            for name, array in zip(names, arrays, strict=True)
        ]

    def _sweep(self) -> dict[str, int]:
        """Remove what no layer needs; [bytes] of what is there, by name."""
        needed: set[str] = set().union(*self._needed.values())
        there = {}
        with os.scandir(self._folder) as entries:
            for entry in entries:
                if entry.name in needed:
                    there[entry.name] = entry.stat().st_size
                else:
                    # Windows refuses while the renderer maps it: the next sweep takes it away.
                    with suppress(OSError):
                        os.unlink(entry)
        return there

    def _write(self, name: str, array: NDArray[Any]) -> None:
        part = self._folder / (name + UNFINISHED)
        try:
            with open(part, "wb") as file:
                np.ascontiguousarray(array).tofile(file)
            os.replace(part, self._folder / name)
        except BaseException:
            part.unlink(missing_ok=True)
            raise


class BlobReader:
    """The renderer's end. What it reads twice is one array, as long as somebody has it."""

    def __init__(self, folder: Path) -> None:
        """`folder` is the writer's."""
        self._folder = folder
        self._read: weakref.WeakValueDictionary[str, NDArray[Any]] = weakref.WeakValueDictionary()

    def read(self, layout: Iterable[Sequence[Any]]) -> list[NDArray[Any]]:
        """The arrays that were written, not to be written to; they outlive their files.

        Raises RenderError if one is not there or not whole.
        """
        try:
            return [self._array(*entry) for entry in layout]
        except (OSError, TypeError, ValueError) as error:
            raise RenderError(f"the scene came damaged: {error}") from error

    def _array(self, name: str, dtype: str, shape: Sequence[int]) -> NDArray[Any]:
        array = self._read.get(name)
        if array is None:
            array = self._read[name] = _load(self._folder / name, np.dtype(dtype), tuple(shape))
        return array


def _load(path: Path, dtype: np.dtype[Any], shape: tuple[int, ...]) -> NDArray[Any]:
    size, there = dtype.itemsize * math.prod(shape), path.stat().st_size
    if there != size:
        raise ValueError(f"{there} of {size} bytes are in {path}")
    if size >= MAPPED:
        array = np.asarray(np.memmap(path, dtype, "r", shape=shape))
    else:
        array = np.fromfile(path, dtype).reshape(shape)
    array.flags.writeable = False
    return array
