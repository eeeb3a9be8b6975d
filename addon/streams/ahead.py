# SPDX-License-Identifier: GPL-3.0-or-later
"""Programs that a driver links by several threads at once, while the host goes on."""

from __future__ import annotations

import ctypes
import os
import time
from collections.abc import Callable
from typing import Any

from .functions import find_function

# OpenGL 4.5 (glcorearb.h)
_COMPUTE_SHADER, _LINK_STATUS = 0x91B9, 0x8B82
_EXTENSIONS = {
    "GL_KHR_parallel_shader_compile": "glMaxShaderCompilerThreadsKHR",
    "GL_ARB_parallel_shader_compile": "glMaxShaderCompilerThreadsARB",
}
_AS_MANY_AS_THERE_ARE = 0xFFFFFFFF
_FOUND = 0.25  # [s] in which a driver finds a program that it has linked

_name = ctypes.c_uint
_FUNCTIONS: dict[str, tuple[Any, ...]] = {  # result and arguments
    "glCreateShader": (_name, _name),
    "glShaderSource": (None, _name, ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p),
    "glCompileShader": (None, _name),
    "glDeleteShader": (None, _name),
    "glCreateProgram": (_name,),
    "glAttachShader": (None, _name, _name),
    "glLinkProgram": (None, _name),
    "glGetProgramiv": (None, _name, _name, ctypes.c_void_p),
    "glDeleteProgram": (None, _name),
}


class Ahead:
    """Links compute programs before they are asked for.

    moderngl waits for each program as soon as it is linked. So each is first linked without asking
    how that went; when moderngl links the same text, it is in the driver's cache.
    """

    def __init__(self, functions: dict[str, Any]) -> None:
        self._gl: dict[str, Any] | None = functions

    def begin(self, text: str) -> int:
        """Have a compute program linked; its name, 0 where that is no use."""
        if not self._gl:
            return 0
        source = ctypes.c_char_p(text.encode())
        shader = self._gl["glCreateShader"](_COMPUTE_SHADER)
        self._gl["glShaderSource"](shader, 1, ctypes.byref(source), None)
        self._gl["glCompileShader"](shader)
        program: int = self._gl["glCreateProgram"]()
        self._gl["glAttachShader"](program, shader)
        self._gl["glLinkProgram"](program)
        self._gl["glDeleteShader"](shader)  # with the program
        return program

    def end(self, program: int, link: Callable[[], Any]) -> Any:
        """What `link` gives, of a program that was begun."""
        if not (program and self._gl):
            return link()
        done, gl = ctypes.c_int(), self._gl
        gl["glGetProgramiv"](program, _LINK_STATUS, ctypes.byref(done))  # waits for it
        begun = time.perf_counter()
        try:
            return link()
        finally:
            gl["glDeleteProgram"](program)
            if time.perf_counter() - begun > _FOUND:
                self._gl = None  # the driver keeps none, and would link each of them twice


def links_ahead(ctx: Any) -> Ahead:
    """For a context: nothing is begun where the driver has no threads for it, or no cache."""
    call = next((_EXTENSIONS[name] for name in _EXTENSIONS if name in ctx.extensions), None)
    address = find_function(call) if call else None
    if address is None or os.environ.get("__GL_SHADER_DISK_CACHE") == "0":
        return Ahead({})
    found: dict[str, Any] = {}
    for name, kinds in _FUNCTIONS.items():
        own = find_function(name)
        if own is None:
            return Ahead({})
        found[name] = ctypes.CFUNCTYPE(*kinds)(own)
    ctypes.CFUNCTYPE(None, _name)(address)(_AS_MANY_AS_THERE_ARE)
    return Ahead(found)
