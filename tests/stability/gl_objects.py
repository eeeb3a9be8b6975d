# SPDX-License-Identifier: GPL-3.0-or-later
"""How many OpenGL objects live in the current context: every name that was ever given is asked
about."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any

from addon.streams.functions import find_function

GENERATED = ("Texture", "Buffer", "Framebuffer", "VertexArray", "Query", "Sampler")
LEAST_NAMES = 1 << 12  # asked about where a driver gives the lowest free name, not the next one
_FRAGMENT_SHADER = 0x8B30  # glcorearb.h
_NAME = ctypes.c_uint


def living_objects() -> dict[str, int]:
    """The number of objects by kind."""
    found = {kind: _count(kind, *_new_of(kind)) for kind in GENERATED}
    program, shader = _function("CreateProgram", _NAME)(), _function("CreateShader", _NAME, _NAME)
    found["Program"] = _count("Program", program, _function("DeleteProgram", None, _NAME))
    delete = _function("DeleteShader", None, _NAME)
    return found | {"Shader": _count("Shader", shader(_FRAGMENT_SHADER), delete)}


def _new_of(kind: str) -> tuple[int, Callable[[int], Any]]:
    """A new name, and what gives it back."""
    plural = {"Query": "Queries"}.get(kind, f"{kind}s")
    name, kinds = _NAME(), (ctypes.c_int, ctypes.POINTER(_NAME))
    _function(f"Gen{plural}", None, *kinds)(1, name)
    delete = _function(f"Delete{plural}", None, *kinds)
    return name.value, lambda new: delete(1, _NAME(new))


def _count(kind: str, new: int, delete: Callable[[int], Any]) -> int:
    delete(new)
    is_one = _function(f"Is{kind}", ctypes.c_ubyte, _NAME)
    return sum(is_one(name) != 0 for name in range(1, max(LEAST_NAMES, new)))


def _function(name: str, result: Any, *arguments: Any) -> Any:
    address = find_function(f"gl{name}")
    assert address, f"gl{name} is part of OpenGL 3.3"
    return ctypes.CFUNCTYPE(result, *arguments)(address)
