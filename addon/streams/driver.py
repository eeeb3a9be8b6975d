# SPDX-License-Identifier: GPL-3.0-or-later
"""What moderngl has no call for: the newest context, the errors of its driver, its free memory."""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable
from typing import Any

import moderngl

from .functions import find_function
from .source import StreamError

_VERSIONS = (450, 430, 410, 330)  # compute programs from 430; macOS ends at 410
# GL_NVX_gpu_memory_info and GL_ATI_meminfo: the first of up to four numbers [kB]
_FREE_MEMORY = {"GL_NVX_gpu_memory_info": 0x9049, "GL_ATI_meminfo": 0x87FC}
# KHR_debug (glext.h)
_DEBUG_OUTPUT, _DEBUG_OUTPUT_SYNCHRONOUS = 0x92E0, 0x8242
_DEBUG_TYPE_ERROR, _DEBUG_SOURCE_SHADER_COMPILER = 0x824C, 0x8248
_DebugCallback = ctypes.CFUNCTYPE(
    None,
    ctypes.c_uint,
    ctypes.c_uint,
    ctypes.c_uint,
    ctypes.c_uint,
    ctypes.c_int,
    ctypes.c_char_p,
    ctypes.c_void_p,
)


# Callbacks of contexts not yet released: a driver calls them to the end.
_listening: list[Any] = []


def newest_context(index: int) -> moderngl.Context:
    """Ask an EGL device for the newest OpenGL that we use: some drivers give exactly what is asked
    for."""
    arguments: dict[str, Any] = {"standalone": True}
    if sys.platform.startswith("linux"):
        arguments |= {"backend": "egl", "device_index": index}
    for version in _VERSIONS:
        try:
            return moderngl.create_context(require=version, **arguments)
        except Exception as error:  # glcontext raises bare Exception
            reason = error
    raise StreamError(
        f"no OpenGL 3.3 context on device {index}: {reason}. "
        "Install a graphics driver (on Debian: libegl1 and libgl1-mesa-dri)"
    ) from reason


def free_memory(ctx: Any) -> int | None:
    """What the GPU has left [bytes]; None where the driver does not tell."""
    address = find_function("glGetIntegerv")
    for extension, number in _FREE_MEMORY.items():
        if address and extension in ctx.extensions:
            values = (ctypes.c_int * 4)(-1)  # which stays, if the driver does not know either
            ctypes.CFUNCTYPE(None, ctypes.c_uint, ctypes.c_void_p)(address)(number, values)
            return 1024 * values[0] if values[0] >= 0 else None
    return None


def listen(ctx: Any, errors: list[str]) -> Callable[[], None]:
    """Add KHR_debug errors to a list; moderngl has no call for it, so through the EGL loader. What
    ends that."""
    address, enable_address = map(find_function, ("glDebugMessageCallback", "glEnable"))
    if not address or not enable_address or ctx.version_code < 430:
        return nothing

    def hear(
        source: int, kind: int, _id: int, _severity: int, _n: int, text: bytes, _user: int
    ) -> None:
        # What a compiler says is raised by who links the program.
        if kind == _DEBUG_TYPE_ERROR and source != _DEBUG_SOURCE_SHADER_COMPILER:
            errors.append(text.decode(errors="replace"))

    callback = _DebugCallback(hear)
    enable = ctypes.CFUNCTYPE(None, ctypes.c_uint)(enable_address)
    enable(_DEBUG_OUTPUT)
    enable(_DEBUG_OUTPUT_SYNCHRONOUS)
    set_callback = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)(address)
    set_callback(ctypes.cast(callback, ctypes.c_void_p), None)
    _listening.append(callback)

    def stop() -> None:
        set_callback(None, None)
        _listening.remove(callback)

    return stop


def nothing() -> None:
    """What is done where there is nothing to do."""
