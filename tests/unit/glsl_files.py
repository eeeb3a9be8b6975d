# SPDX-License-Identifier: GPL-3.0-or-later
"""A GLSL root of a test's own, and kernels declared in a line."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

import addon.streams.kernel
import addon.streams.source
from addon.streams import Kernel, Record

VALUE = Record("Value", {"value": "vec4"})


def use_root(root: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Let the stream framework read its GLSL from `root`."""
    monkeypatch.setattr(addon.streams.source, "glsl_root", lambda: root)
    return root


def copy_glsl(root: Path, kernels: Path) -> Path:
    """The real library, and beside it the real kernels and those of a folder."""
    shutil.copytree(addon.streams.source.glsl_root(), root, dirs_exist_ok=True)
    shutil.copytree(kernels, root / "kernels", dirs_exist_ok=True)
    return root


def write(root: Path, path: str, text: str) -> None:
    """A GLSL file below the root; read anew."""
    addon.streams.source._text.cache_clear()
    addon.streams.source._expanded.cache_clear()
    addon.streams.source._every_branch.cache_clear()
    (root / path).parent.mkdir(parents=True, exist_ok=True)
    (root / path).write_text(text, encoding="utf-8")


class _AtOnce(Kernel):
    """Linked when it is made, also where a driver's threads would have time for it."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._program.program  # asks for it


def declare(stem: str, outputs: Mapping[str, Record], **declaration: Any) -> type[Kernel]:
    """A kernel class named Probe."""
    return type("Probe", (_AtOnce,), {"stem": stem, "outputs": outputs, **declaration})
