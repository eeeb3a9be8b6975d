# SPDX-License-Identifier: GPL-3.0-or-later
"""OpenGL's buffers as CUDA sees them, through the driver's C API: a denoiser on the same GPU reads
and writes them in place."""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from ctypes import c_int, c_size_t, c_uint, c_void_p
from typing import Any

DRIVER = "nvcuda.dll" if sys.platform == "win32" else "libcuda.so.1"
_pointer, _address = ctypes.POINTER, ctypes.c_uint64
_SIGNATURES: Mapping[str, tuple[Any, ...]] = {  # of cuda.h and cudaGL.h; all return an error
    "cuInit": (c_uint,),
    "cuDeviceGetCount": (_pointer(c_int),),
    "cuDeviceGet": (_pointer(c_int), c_int),
    "cuDevicePrimaryCtxRetain": (_pointer(c_void_p), c_int),
    "cuDevicePrimaryCtxRelease_v2": (c_int,),
    "cuCtxPushCurrent_v2": (c_void_p,),
    "cuCtxPopCurrent_v2": (_pointer(c_void_p),),
    "cuCtxSynchronize": (),
    "cuGraphicsGLRegisterBuffer": (_pointer(c_void_p), c_uint, c_uint),
    "cuGraphicsUnregisterResource": (c_void_p,),
    "cuGraphicsMapResources": (c_uint, _pointer(c_void_p), c_void_p),
    "cuGraphicsUnmapResources": (c_uint, _pointer(c_void_p), c_void_p),
    "cuGraphicsResourceGetMappedPointer_v2": (_pointer(_address), _pointer(c_size_t), c_void_p),
}


class CudaError(Exception):
    """CUDA is absent, or does not see what OpenGL has."""


class CudaBuffers:
    """Buffers of the OpenGL context that is current, registered until they are released."""

    def __init__(self, names: Mapping[str, int]) -> None:
        """`names`: those of OpenGL. CudaError where they are not to be seen, also where there are
        several GPUs, of which OpenGL and the denoiser may have taken one each."""
        try:
            driver = ctypes.CDLL(DRIVER)
            self._calls = {name: getattr(driver, name) for name in _SIGNATURES}
        except (OSError, AttributeError) as error:
            raise CudaError(f"{DRIVER}: {error}") from error
        for name, arguments in _SIGNATURES.items():
            self._calls[name].argtypes = arguments
        self._resources: dict[str, c_void_p] = {}
        self._device, self._context = c_int(), c_void_p()
        self._call("cuInit", 0)
        count = c_int()
        self._call("cuDeviceGetCount", ctypes.byref(count))
        if count.value != 1:
            raise CudaError(f"there are {count.value} GPUs")
        self._call("cuDeviceGet", ctypes.byref(self._device), 0)
        self._call("cuDevicePrimaryCtxRetain", ctypes.byref(self._context), self._device)
        try:
            with self._current():
                for name, number in names.items():
                    resource = c_void_p()
                    self._call("cuGraphicsGLRegisterBuffer", ctypes.byref(resource), number, 0)
                    self._resources[name] = resource
        except CudaError:
            self.release()
            raise

    @contextmanager
    def mapped(self) -> Iterator[dict[str, int]]:
        """Where they are, while OpenGL leaves them alone, which has to have finished with them."""
        count, all_of_them = len(self._resources), (c_void_p * len(self._resources))()
        all_of_them[:] = [resource.value for resource in self._resources.values()]
        with self._current():
            self._call("cuGraphicsMapResources", count, all_of_them, None)
            try:
                yield {name: self._place(x) for name, x in self._resources.items()}
                self._call("cuCtxSynchronize")
            finally:
                self._call("cuGraphicsUnmapResources", count, all_of_them, None)

    def _place(self, resource: c_void_p) -> int:
        address, size = _address(), c_size_t()
        places = ctypes.byref(address), ctypes.byref(size)
        self._call("cuGraphicsResourceGetMappedPointer_v2", *places, resource)
        return address.value

    @contextmanager
    def _current(self) -> Iterator[None]:
        self._call("cuCtxPushCurrent_v2", self._context)
        try:
            yield
        finally:
            self._call("cuCtxPopCurrent_v2", ctypes.byref(c_void_p()))

    def _call(self, name: str, *arguments: Any) -> None:
        call: Callable[..., int] = self._calls[name]
        if code := call(*arguments):
            raise CudaError(f"{name}: error {code}")

    def release(self) -> None:
        """Let go of them, while their OpenGL context is current; of what CUDA has lost, too."""
        if not self._context:
            return
        with suppress(CudaError), self._current():
            for resource in self._resources.values():
                with suppress(CudaError):
                    self._call("cuGraphicsUnregisterResource", resource)
        with suppress(CudaError):
            self._call("cuDevicePrimaryCtxRelease_v2", self._device)
        self._resources.clear()
        self._context = c_void_p()
