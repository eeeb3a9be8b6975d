# SPDX-License-Identifier: GPL-3.0-or-later
"""The scenes of a run: snapshots, folders of them, or .blend files where bpy is."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Iterable
from importlib.util import find_spec
from pathlib import Path

from addon.photon.errors import PhotonStreamError
from addon.photon.scene import Scene

ROOT = Path(__file__).resolve().parents[3]


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
            if file.stem in scenes:
                refused.append(f"{file}: another scene has its name")
            elif file.suffix.lower() == ".blend" and find_spec("bpy") is None:
                refused.append(f"{file}: bpy is not here to open it")
            else:
                try:
                    if file.suffix.lower() == ".blend":
                        scenes[file.stem], exports[file.stem] = export(file)
                    else:
                        scenes[file.stem] = Scene.load(file)
                except (PhotonStreamError, RuntimeError) as error:
                    refused.append(str(error))
    return scenes, exports, refused


def export(blend: Path) -> tuple[Scene, float]:
    """A .blend's scene, and [s] of exporting it, in a process of its own: bpy and OpenGL apart.

    Raises RuntimeError with the last line of what that process said when it failed.
    """
    with tempfile.TemporaryDirectory() as folder:
        snapshot = Path(folder) / "scene.npz"
        command = [sys.executable, "-c", _EXPORT, str(blend.resolve()), str(snapshot)]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
        if done.returncode:
            last = (done.stderr.strip().splitlines() or ["no message"])[-1]
            raise RuntimeError(f"{blend}: {last}")
        return Scene.load(snapshot), float(done.stdout.split("exported in")[1].split()[0])


_EXPORT = """
import atexit, sys, time, addon, bpy
from pathlib import Path
from addon.blender.export import SpecularModel, snapshot
addon.register()
atexit.register(addon.unregister)  # else bpy crashes at exit
bpy.ops.wm.open_mainfile(filepath=sys.argv[1])
depsgraph = bpy.context.evaluated_depsgraph_get()
start = time.perf_counter()
model = SpecularModel(depsgraph.scene_eval.photon_stream.specular_model)
scene, _ = snapshot(depsgraph, model=model)
print("exported in", time.perf_counter() - start)
scene.save(Path(sys.argv[2]))
"""
