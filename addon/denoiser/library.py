# SPDX-License-Identifier: GPL-3.0-or-later
"""OpenImageDenoise 2, as Blender ships it or PyPI's pyoidn does, through its C API."""

from __future__ import annotations

import ctypes
import math
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from ctypes import c_bool, c_char_p, c_int, c_size_t, c_void_p
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Pixels = NDArray[np.float32]

VARIABLE = "PHOTON_STREAM_OIDN"  # in the environment: the library's file, or where to look first
ABSENT = "OpenImageDenoise is not here: Blender brings it, and so does `pip install pyoidn`"
NAMES = {
    "linux": ("libOpenImageDenoise.so.2",),
    "darwin": ("libOpenImageDenoise.2.dylib", "libOpenImageDenoise.dylib"),
    "win32": ("OpenImageDenoise.dll",),
}
# Of oidn.h.
_ANY, _CPU = 0, 1  # kinds of devices: the fastest that there is, the processor
KINDS = {1: "CPU", 2: "SYCL", 3: "CUDA", 4: "HIP", 5: "Metal"}
_FLOAT3 = 3
_SIGNATURES: Mapping[str, tuple[Any, tuple[Any, ...]]] = {
    "oidnNewDevice": (c_void_p, (c_int,)),
    "oidnSetDeviceInt": (None, (c_void_p, c_char_p, c_int)),
    "oidnGetDeviceInt": (c_int, (c_void_p, c_char_p)),
    "oidnCommitDevice": (None, (c_void_p,)),
    "oidnReleaseDevice": (None, (c_void_p,)),
    "oidnGetDeviceError": (c_int, (c_void_p, ctypes.POINTER(c_char_p))),
    "oidnNewBuffer": (c_void_p, (c_void_p, c_size_t)),
    "oidnNewSharedBuffer": (c_void_p, (c_void_p, c_void_p, c_size_t)),
    "oidnReleaseBuffer": (None, (c_void_p,)),
    "oidnReadBuffer": (None, (c_void_p, c_size_t, c_size_t, c_void_p)),
    "oidnWriteBuffer": (None, (c_void_p, c_size_t, c_size_t, c_void_p)),
    "oidnNewFilter": (c_void_p, (c_void_p, c_char_p)),
    "oidnReleaseFilter": (None, (c_void_p,)),
    "oidnSetFilterBool": (None, (c_void_p, c_char_p, c_bool)),
    "oidnSetFilterImage": (
        None,
        (c_void_p, c_char_p, c_void_p, c_int, *(c_size_t,) * 5),
    ),
    "oidnCommitFilter": (None, (c_void_p,)),
    "oidnExecuteFilter": (None, (c_void_p,)),
}


class DenoiserError(Exception):
    """OpenImageDenoise is absent, or says what it cannot do."""


def find(blender: Path | None = None) -> Path | None:
    """The library's file; None: it is nowhere here.

    It is looked for where $PHOTON_STREAM_OIDN says, in the Blender in the folder `blender` or whose
    Python this is, in PyPI's bpy and pyoidn, and where the system keeps its libraries.
    """
    names = NAMES.get(sys.platform, NAMES["linux"])
    for place in (*_of_blender(blender), *_places()) if blender else _places():
        for path in (place, *(place / name for name in names)):
            if path.is_file():
                return path
    return None


def _places() -> Iterator[Path]:
    if given := os.environ.get(VARIABLE):
        yield from _of_blender(Path(given))
    if Path(sys.prefix).name == "python":  # as in blender-5.0/5.0/python
        yield from _of_blender(Path(sys.prefix).parents[1])
    for package in ("bpy", "pyoidn"):
        for folder in map(Path, _folders_of(package)):
            if folder.parts[-3:-1] == ("scripts", "modules"):  # Blender's, in 5.0/scripts/modules
                yield from _of_blender(folder.parents[3])
            yield from _of_blender(folder)
            yield from (folder / "oidn" / "lib", folder / "oidn" / "bin")
    for root in map(Path, ("/usr", "/usr/local", "/opt/homebrew")):
        yield from (*root.glob("lib/*-linux-gnu"), root / "lib64", root / "lib")


def _of_blender(folder: Path) -> tuple[Path, ...]:
    """Where a Blender has its libraries: on Linux and macOS, and on Windows."""
    return folder, folder / "lib", folder / "blender.shared"


def _folders_of(package: str) -> list[str]:
    """Where a package is, which is not imported by that."""
    known = sys.modules.get(package)
    spec = known.__spec__ if known else find_spec(package)
    return list(spec.submodule_search_locations or ()) if spec else []


@lru_cache(maxsize=4)
def _load(path: Path) -> Any:
    """The library with its functions' types; DenoiserError if it is none or too old."""
    try:
        if sys.platform == "win32":  # where it finds its parts
            os.add_dll_directory(str(path.parent))
        library = ctypes.CDLL(str(path))
        for name, (result, arguments) in _SIGNATURES.items():
            function = getattr(library, name)
            function.restype, function.argtypes = result, arguments
    except (OSError, AttributeError) as error:
        raise DenoiserError(f"{path} is no OpenImageDenoise 2: {error}") from error
    return library


class Denoiser:
    """Filters pictures (h, w, 3) float32; the same pictures, device and version give the same bits.

    A context manager, or to be closed: pictures' memory is taken while they are filtered, or as
    long as one is prepared to be filtered in place, the device's until the end.
    """

    def __init__(self, path: Path | None = None, on_cpu: bool = False, threads: int = 0) -> None:
        """`on_cpu`: even if there is a GPU that it knows; `threads` there, 0 for all cores.
        DenoiserError if it is absent or finds no device."""
        path = path or find()
        if path is None:
            raise DenoiserError(ABSENT)
        self._library = _load(path)
        # A GPU that turns out to lack something is passed over.
        for kind in (_CPU,) if on_cpu else (_ANY, _CPU):
            self._device = self._library.oidnNewDevice(kind)
            if not self._device:
                said = self._said()
                continue
            if threads and kind == _CPU:
                self._library.oidnSetDeviceInt(self._device, b"numThreads", threads)
            self._library.oidnCommitDevice(self._device)
            said = self._said()
            if not said:
                return
            self._library.oidnReleaseDevice(self._device)
        self._device = None
        raise DenoiserError(f"OpenImageDenoise has no device: {said}")

    @property
    def name(self) -> str:
        """As OpenImageDenoise 2.3.3, CPU."""
        version, kind = (
            self._library.oidnGetDeviceInt(self._device, name) for name in (b"version", b"type")
        )
        number = f"{version // 10000}.{version // 100 % 100}.{version % 100}"
        return f"OpenImageDenoise {number}, {KINDS.get(kind, 'GPU')}"

    def __enter__(self) -> Denoiser:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Give its memory back."""
        if self._device:
            self._library.oidnReleaseDevice(self._device)
            self._device = None

    @contextmanager
    def filtering(
        self, shape: tuple[int, ...], features: Mapping[str, Pixels]
    ) -> Iterator[Callable[[Pixels], Pixels]]:
        """What takes the noise out of pictures of linear light of a shape (h, w, 3), or (h, w, 4),
        whose last channel says nothing; `features` of the same: "albedo" in [0, 1], and with it
        perhaps "normal". Each is asked for when it is taken."""
        library, size = self._library, 4 * math.prod(shape)

        def new(_: str) -> Any:
            return library.oidnNewBuffer(self._device, size)

        prepared = self._prepared(shape, ("color", *features, "output"), new)
        buffers = prepared.buffers

        def write(name: str, image: Pixels) -> None:
            assert image.shape == shape, (name, image.shape, shape)
            pixels = np.ascontiguousarray(image, np.float32)
            library.oidnWriteBuffer(buffers[name], 0, size, pixels.ctypes.data)

        def filtered(picture: Pixels) -> Pixels:
            result = np.empty(shape, np.float32)
            write("color", picture)
            prepared.run()
            library.oidnReadBuffer(buffers["output"], 0, size, result.ctypes.data)
            self._check()
            return result

        try:
            for name in features:
                write(name, features[name])
            self._check()
            yield filtered
        finally:
            prepared.release()

    @property
    def is_cuda(self) -> bool:
        """Whether it is on a GPU of CUDA's."""
        return KINDS.get(self._library.oidnGetDeviceInt(self._device, b"type")) == "CUDA"

    def filter_there(self, shape: tuple[int, int], places: Mapping[str, int]) -> PreparedFilter:
        """What filters a picture (h, w, 4) where it is on the device, into another: `places` of
        "color", "albedo", "normal" and "output"."""
        size = 16 * math.prod(shape)

        def at(port: str) -> Any:
            return self._library.oidnNewSharedBuffer(self._device, places[port], size)

        return self._prepared((*shape, 4), places, at)

    def _prepared(
        self, shape: tuple[int, ...], ports: Iterable[str], buffer: Callable[[str], Any]
    ) -> PreparedFilter:
        """A filter of pictures (h, w, channels), with what `buffer` gives for each port."""
        height, width, channels = shape
        rt = self._library.oidnNewFilter(self._device, b"RT")
        prepared = PreparedFilter(self._library, rt, self._check)
        try:
            for port in ports:
                prepared.buffers[port] = buffer(port)
                self._check()
                image = prepared.buffers[port], _FLOAT3, width, height, 0, 4 * channels, 0
                self._library.oidnSetFilterImage(rt, port.encode(), *image)
            self._library.oidnSetFilterBool(rt, b"hdr", True)
            self._library.oidnCommitFilter(rt)
            self._check()
        except DenoiserError:
            prepared.release()
            raise
        return prepared

    def _check(self) -> None:
        if said := self._said():
            raise DenoiserError(f"OpenImageDenoise: {said}")

    def _said(self) -> str:
        """What it last complained of; empty: nothing."""
        text = c_char_p()
        code = self._library.oidnGetDeviceError(self._device, ctypes.byref(text))
        return (text.value or b"error %d" % code).decode(errors="replace") if code else ""


class PreparedFilter:
    """One that knows its images; to be released before the denoiser is closed."""

    def __init__(self, library: Any, rt: Any, check: Callable[[], None]) -> None:
        self._library, self._rt, self._check = library, rt, check
        self.buffers: dict[str, Any] = {}  # by port

    def run(self) -> None:
        """Filter what is there now. Raises DenoiserError."""
        self._library.oidnExecuteFilter(self._rt)
        self._check()

    def release(self) -> None:
        """Give its memory back, not the pictures'."""
        self._library.oidnReleaseFilter(self._rt)
        for buffer in self.buffers.values():
            self._library.oidnReleaseBuffer(buffer)
        self.buffers.clear()
