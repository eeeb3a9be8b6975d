# SPDX-License-Identifier: GPL-3.0-or-later
"""Cycles as a contender, without and with its OpenImageDenoise, and as the exporter of scenes."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterator
from pathlib import Path

import bpy
import OpenEXR

from addon.blender.export import snapshot
from addon.photon.scene import Scene
from tests.regression.cycles import open_blend, prepare, read_exr, replace_lobes, saved_model

from ..scenes import CAUSTICS
from .steps import Budget, Seconds, Step, now

METHODS = {"Cycles": "path", "Cycles + OIDN": "denoised"}
FIRST, FACTOR = 4, 4  # samples


def open_scene(name: str, size: int) -> Scene:
    """A scene of the chart, loaded in Blender and exported. Where caustics are what it is about
    its lamp has no size, whose images in glass and metal, a thousand times as bright as what they
    light, would be all that one measures; and what Cycles wants to know of caustics is said."""
    exported = open_blend(name, size)
    if name not in CAUSTICS:
        return exported
    for light in bpy.data.lights:
        setattr(light, "angle" if light.type == "SUN" else "shadow_soft_size", 0.0)
        light.cycles.is_caustics_light = True
    for thing in bpy.context.scene.objects:
        if thing.type == "MESH":
            shaders = [n.type for m in thing.data.materials for n in m.node_tree.nodes]
            thing.cycles.is_caustics_caster = "BSDF_GLASS" in shaders
            thing.cycles.is_caustics_receiver = "BSDF_DIFFUSE" in shaders
    return snapshot(bpy.context.evaluated_depsgraph_get(), model=saved_model())[0]


class Engine:
    """Cycles with one scene loaded."""

    def __init__(self) -> None:
        self.about = f"Cycles of Blender {bpy.app.version_string}"

    def load(self, snapshot: Path, blend: Path, size: int) -> None:
        """Open the .blend, write the snapshot that the others read, give Cycles our lobes."""
        exported = open_scene(blend.stem, size)
        exported.save(snapshot)
        replace_lobes(exported)
        self._warm: set[str] = set()

    def climb(self, method: str, seed: int, budget: Budget) -> Iterator[Step]:
        """Pictures of 4, 16, 64, ... samples, each rendered anew; the last fills the budget.

        The seconds are what Cycles itself calls render time: without its synchronization of the
        scene, and with the denoising. Kernels and denoiser are loaded by a render before.
        """
        if method not in self._warm:
            self._render(1, 0, method)
            self._warm.add(method)
        samples = FIRST
        while True:
            step = self._render(samples, seed, method)
            yield step
            share = 0.9 * budget.left / step.seconds.wall
            if share < 1.5:
                return
            samples = int(samples * (FACTOR if share > 1.5 * FACTOR else share))

    def _render(self, samples: int, seed: int, method: str) -> Step:
        scene = bpy.context.scene
        prepare(scene, samples, seed)
        scene.cycles.use_denoising = method == "denoised"
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "cycles.exr"
            scene.render.filepath = str(path)
            start = now()
            bpy.ops.render.render(write_still=True)
            cpu = (now() - start).cpu
            header = OpenEXR.File(str(path)).header()
            (stamp,) = [v for k, v in header.items() if re.fullmatch(r"cycles\..*\.render_time", k)]
            picture = read_exr(path)
            return Step(samples, Seconds(_seconds(stamp), cpu), lambda: picture)


def _seconds(stamp: str) -> float:
    """Of Blender's 00:01.23, or 01:02:03.45."""
    total = 0.0
    for part in stamp.split(":"):
        total = total * 60 + float(part)
    return max(total, 0.01)  # its resolution
