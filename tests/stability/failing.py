# SPDX-License-Identifier: GPL-3.0-or-later
"""A renderer process in which the n-th allocation of a render fails.

What starts it (`failing_python`) is told each time which: a file says "<n> <kind>", and another
how many there were in the render before. Kinds: "refused", where OpenGL makes no object; "memory",
where it makes one without room for it; "host", where numpy has none.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import moderngl
import numpy as np

from addon.photon.scene import Scene, snapshot

ROOT = Path(__file__).resolve().parents[2]
OBJECTS = ("texture", "buffer", "framebuffer", "program", "compute_shader", "vertex_array", "query")
ARRAYS = ("empty", "zeros", "full", "concatenate", "stack", "ascontiguousarray", "take")
TOO_LARGE: dict[str, tuple[tuple[Any, ...], dict[str, Any]]] = {  # in their place
    "texture": (((16384, 16384), 4), {"dtype": "f4"}),
    "buffer": ((), {"reserve": 1 << 60}),
}
FOLDER = "PHOTON_STREAM_TEST_FAILING"


def failing_python(folder: Path) -> str:
    """A program that stands in for the renderer's interpreter, and reads what shall fail from
    `folder`."""
    python = folder / "python"
    prelude = "from tests.stability.failing import install; install()"
    python.write_text(
        f"#!/bin/sh\nexport PYTHONPATH={ROOT}:$PYTHONPATH {FOLDER}={folder}\n"
        f'exec {sys.executable} -c "{prelude}\n$2"\n'
    )
    python.chmod(0o755)
    return str(python)


def ask(folder: Path, number: int, kind: str) -> None:
    """Let that allocation of the next render fail; 0: none."""
    (folder / "wanted").write_text(f"{number} {kind}")


def counted(folder: Path) -> int:
    """How many allocations the render before the last one made, or the last up to its failure."""
    return int((folder / "counted").read_text())


class _Allocations:
    """Counts them, and says whose turn it is to fail."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self.made, self.fails_at, self.kind = 0, 0, ""

    def begin(self) -> None:
        """With a render."""
        (self._folder / "counted").write_text(str(self.made))
        number, self.kind = (self._folder / "wanted").read_text().split()
        self.made, self.fails_at = 0, int(number)

    def is_next_to_fail(self, kinds: tuple[str, ...]) -> bool:
        if self.kind not in kinds:
            return False
        self.made += 1
        return self.made == self.fails_at


def install() -> None:
    """Put counters before all that allocates."""
    allocations = _Allocations(Path(os.environ[FOLDER]))
    unpack = snapshot.unpack

    def begin(arrays: Any) -> Scene:
        scene = unpack(arrays)
        allocations.begin()
        return scene

    snapshot.unpack = begin  # for the worker, which is imported after this
    for name in OBJECTS:
        setattr(moderngl.Context, name, _object(allocations, name))
    for name in ARRAYS:
        setattr(np, name, _array(allocations, getattr(np, name)))


def _object(allocations: _Allocations, name: str) -> Callable[..., Any]:
    make = getattr(moderngl.Context, name)

    def made(ctx: moderngl.Context, *arguments: Any, **options: Any) -> Any:
        if name in TOO_LARGE and allocations.kind == "memory":
            # A GPU may have room for such a texture.
            may = name == "buffer" or "llvmpipe" in ctx.info["GL_RENDERER"]
            if may and allocations.is_next_to_fail(("memory",)):
                large, named = TOO_LARGE[name]
                return make(ctx, *large, **named)
        elif allocations.is_next_to_fail(("refused",)):
            raise moderngl.Error(f"cannot create {name}")
        return make(ctx, *arguments, **options)

    return made


def _array(allocations: _Allocations, make: Callable[..., Any]) -> Callable[..., Any]:
    def made(*arguments: Any, **options: Any) -> Any:
        if allocations.is_next_to_fail(("host",)):
            raise MemoryError(f"numpy.{make.__name__}")
        return make(*arguments, **options)

    return made
