# SPDX-License-Identifier: GPL-3.0-or-later
"""OpenGL functions that moderngl does not call."""

from __future__ import annotations

import ctypes
import ctypes.util
import sys
from functools import lru_cache


@lru_cache(maxsize=64)
def find_function(name: str) -> int | None:
    """The address of a function, through the EGL loader; None where there is none."""
    egl = ctypes.util.find_library("EGL")  # runs other programs
    if egl is None or not sys.platform.startswith("linux"):
        return None
    find = ctypes.CDLL(egl).eglGetProcAddress
    find.restype, find.argtypes = ctypes.c_void_p, [ctypes.c_char_p]
    address: int | None = find(name.encode())
    return address
