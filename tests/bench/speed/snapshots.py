# SPDX-License-Identifier: GPL-3.0-or-later
"""The scenes of a run: snapshots, folders of them, or .blend files where bpy is."""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from importlib.util import find_spec
from pathlib import Path

from addon.photon.scene import Scene

EXPORT = Path(__file__).resolve().parents[3] / "addon" / "blender" / "command.py"


def load_scenes(files: Iterable[Path]) -> tuple[dict[str, Scene], dict[str, float], list[str]]:
    """Scenes by name, [s] of exporting each .blend, and what could not be loaded and why."""
    scenes: dict[str, Scene] = {}
    exports: dict[str, float] = {}
    refused: list[str] = []
    for given in files:
        found = sorted(given.glob("*.npz")) if given.is_dir() else [given]
        if not found or not all(file.is_file() for file in found):
            refused.append(f"{given}: no such snapshot")
            continue
        for file in found:
            if file.suffix.lower() != ".blend":
                scenes[file.stem] = Scene.load(file)
            elif find_spec("bpy") is None:
                refused.append(f"{file}: bpy is not here to open it")
            else:
                scenes[file.stem], exports[file.stem] = export(file)
    return scenes, exports, refused


def export(blend: Path) -> tuple[Scene, float]:
    """A .blend's scene, and [s] of exporting it, in a process of its own: bpy and OpenGL apart."""
    with tempfile.TemporaryDirectory() as folder:
        snapshot = Path(folder) / "scene.npz"
        command = [sys.executable, str(EXPORT), str(blend.resolve()), "-o", str(snapshot)]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        return Scene.load(snapshot), exporting(done.stdout)


def exporting(text: str) -> float:
    """[s] that the command line says it spent on exporting."""
    found = re.search(r"Exporting ([\d.]+) s", text)
    return float(found[1]) if found else float("nan")
