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
from enum import Enum
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
_BALANCED = 5  # quality
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
    "oidnSetFilterInt": (None, (c_void_p, c_char_p, c_int)),
    "oidnSetFilterImage": (
        None,
        (c_void_p, c_char_p, c_void_p, c_int, *(c_size_t,) * 5),
    ),
    "oidnCommitFilter": (None, (c_void_p,)),
    "oidnExecuteFilter": (None, (c_void_p,)),
}


class Way(Enum):
    """How pictures go by features, which are noisy at edges, by way of glass and out of focus."""

    GIVEN = "with their noise"
    FILTERED = "without it, all by networks of a balanced quality"
    LARGEST = "without it, all by the largest networks, which take 2.4 times as long"


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
        version = self._library.oidnGetDeviceInt(self._device, b"version")
        number = f"{version // 10000}.{version // 100 % 100}.{version % 100}"
        return f"OpenImageDenoise {number}, {self._kind}"

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
        self, shape: tuple[int, ...], features: Mapping[str, Pixels], way: Way = Way.GIVEN
    ) -> Iterator[Callable[[Pixels], Pixels]]:
        """What takes the noise out of pictures of linear light of a shape (h, w, 3), or (h, w, 4),
        whose last channel says nothing; `features` of the same: "albedo" in [0, 1], and with it
        perhaps "normal". Each is asked for when it is taken."""
        library, size = self._library, 4 * math.prod(shape)
        prepared = PreparedFilter(library, self._device, shape, self._check)

        def write(name: str, image: Pixels) -> None:
            assert image.shape == shape, (name, image.shape, shape)
            pixels = np.ascontiguousarray(image, np.float32)
            library.oidnWriteBuffer(prepared.buffers[name], 0, size, pixels.ctypes.data)

        def filtered(picture: Pixels) -> Pixels:
            result = np.empty(shape, np.float32)
            write("color", picture)
            prepared.run("color")
            library.oidnReadBuffer(prepared.buffers["output"], 0, size, result.ctypes.data)
            self._check()
            return result

        try:
            for name in ("color", *features, "output"):
                prepared.add_buffer(name, library.oidnNewBuffer(self._device, size))
            prepared.add_filters(features, {"color": "output"}, way)
            for name in features:
                write(name, features[name])
            prepared.clean_features()
            yield filtered
        finally:
            prepared.release()

    @property
    def is_cuda(self) -> bool:
        """Whether it is on a GPU of CUDA's."""
        return self._kind == "CUDA"

    @property
    def is_on_gpu(self) -> bool:
        """Whether it is on a GPU of any kind."""
        return self._kind != "CPU"

    @property
    def _kind(self) -> str:
        return KINDS.get(self._library.oidnGetDeviceInt(self._device, b"type"), "GPU")

    def filter_there(
        self,
        shape: tuple[int, int],
        places: Mapping[str, int],
        pictures: Mapping[str, str],
        way: Way,
    ) -> PreparedFilter:
        """What filters pictures (h, w, 4) where they are on the device: `places` of "albedo", of
        "normal", and of pictures, of each of which the mapping says into which it is filtered."""
        size = 16 * math.prod(shape)
        prepared = PreparedFilter(self._library, self._device, (*shape, 4), self._check)
        try:
            for name, place in places.items():
                buffer = self._library.oidnNewSharedBuffer(self._device, place, size)
                prepared.add_buffer(name, buffer)
            features = [name for name in ("albedo", "normal") if name in places]
            prepared.add_filters(features, pictures, way)
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
    """Filters that know their images; to be released before the denoiser is closed. Features are
    filtered in place, where they are filtered."""

    def __init__(
        self, library: Any, device: Any, shape: tuple[int, ...], check: Callable[[], None]
    ) -> None:
        """Of images (h, w, channels); `check` raises DenoiserError."""
        self._library, self._device, self._shape, self._check = library, device, shape, check
        self.buffers: dict[str, Any] = {}  # of images, by name
        self._filters: dict[str, Any] = {}  # by the image that each takes the noise out of
        self._features: tuple[str, ...] = ()  # that have one

    def add_buffer(self, name: str, buffer: Any) -> None:
        """Take an image's buffer, to be released with this. Raises DenoiserError."""
        self.buffers[name] = buffer
        self._check()

    def add_filters(self, features: Iterable[str], pictures: Mapping[str, str], way: Way) -> None:
        """Filters of pictures into others, and perhaps of features. Raises DenoiserError."""
        names, are_clean = {name: name for name in features}, way is not Way.GIVEN
        self._features = tuple(names) if are_clean else ()
        for name in self._features:
            self._filter(name, {name: name, "output": name})
        for picture, output in pictures.items():
            rt = self._filter(picture, {"color": picture, **names, "output": output})
            self._library.oidnSetFilterBool(rt, b"hdr", True)
            self._library.oidnSetFilterBool(rt, b"cleanAux", are_clean)
        for rt in self._filters.values():
            if way is Way.FILTERED:
                self._library.oidnSetFilterInt(rt, b"quality", _BALANCED)
            self._library.oidnCommitFilter(rt)
            self._check()

    def _filter(self, image: str, ports: Mapping[str, str]) -> Any:
        """The filter of an image, with images' names by port."""
        height, width, channels = self._shape
        rt = self._filters[image] = self._library.oidnNewFilter(self._device, b"RT")
        self._check()
        for port, name in ports.items():
            given = self.buffers[name], _FLOAT3, width, height, 0, 4 * channels, 0
            self._library.oidnSetFilterImage(rt, port.encode(), *given)
        return rt

    def clean_features(self) -> None:
        """Filter features that have come, if they are to be. Raises DenoiserError."""
        for name in self._features:
            self._library.oidnExecuteFilter(self._filters[name])
        self._check()

    def run(self, picture: str) -> None:
        """Filter the picture that is there now. Raises DenoiserError."""
        self._library.oidnExecuteFilter(self._filters[picture])
        self._check()

    def release(self) -> None:
        """Give its memory back, not the pictures'."""
        for rt in self._filters.values():
            self._library.oidnReleaseFilter(rt)
        for buffer in self.buffers.values():
            self._library.oidnReleaseBuffer(buffer)
        self._filters.clear()
        self.buffers.clear()
