# SPDX-License-Identifier: GPL-3.0-or-later
"""Export where the camera is while the shutter is open."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Hashable, Iterator
from dataclasses import replace

import bpy
import numpy as np

from ...photon.scene import Camera, Motion
from .camera import rigid, window_of
from .report import Notes

FrameSet = Callable[[int, float], None]  # RenderEngine.frame_set
SHUTTER_SAMPLES = 256  # of the shutter curve


class Shutter:
    """The time in which a frame is exposed, as Cycles has it."""

    def __init__(self, scene: bpy.types.Scene, frame_set: FrameSet) -> None:
        render = scene.render
        self._frame_set = frame_set
        self._frame = scene.frame_current + scene.frame_subframe
        self._length = render.motion_blur_shutter  # in frames
        start = {"START": 0.0, "CENTER": -0.5, "END": -1.0}[render.motion_blur_position]
        self._opening = self._frame + start * self._length
        curve = render.motion_blur_shutter_curve
        curve.initialize()
        line = curve.curves[0]
        self.curve = tuple(
            max(0.0, curve.evaluate(line, i / (SHUTTER_SAMPLES - 1)))
            for i in range(SHUTTER_SAMPLES)
        )

    def go(self, time: float) -> None:
        """Let Blender evaluate the scene at a time from the opening, 0, to the closing, 1."""
        self._to(self._opening + time * self._length)

    def leave(self) -> None:
        """Go back to the frame."""
        self._to(self._frame)

    def _to(self, frame: float) -> None:
        whole = math.floor(frame)
        self._frame_set(whole, frame - whole)


def with_motion(
    exported: Camera,
    camera: bpy.types.Object,
    depsgraph: bpy.types.Depsgraph,
    shutter: Shutter,
    notes: Notes,
) -> Camera:
    """Return the camera with its motion, and where it is in the middle of the exposure.

    Blender is left there: it is where everything that stands still within a frame is seen.
    """
    name = f"Camera '{camera.name}'"
    steps = steps_of(camera)
    matrices, windows = [], []
    for step in range(steps):
        shutter.go(step / (steps - 1) if steps > 1 else 0.5)
        seen = camera.original.evaluated_get(depsgraph)
        matrices.append(rigid(np.array(seen.matrix_world, np.float64), name, notes))
        windows.append(window_of(seen, depsgraph))
    note_moving(depsgraph, shutter, notes)
    shutter.go(0.5)
    middle = steps // 2
    standing = replace(exported, matrix=matrices[middle])
    zooms = (1.0, 1.0, 1.0)
    if exported.kind == "PERSP":  # Cycles, too, lets no other camera zoom
        standing = replace(standing, window=windows[middle])
        widths = [right - left for left, right, _, _ in windows]
        zooms = (widths[0] / widths[middle], 1.0, widths[-1] / widths[middle])
    moves = any(not np.array_equal(matrix, matrices[middle]) for matrix in matrices)
    if not moves and len(set(zooms)) == 1:
        return standing
    notes.exact(name, "Motion Blur")
    return replace(standing, motion=Motion(np.array(matrices), zooms, shutter.curve))


def steps_of(camera: bpy.types.Object) -> int:
    """Return at how many instants Cycles looks where it is; between them it moves evenly."""
    cycles = getattr(camera, "cycles", None)
    if not getattr(cycles, "use_motion_blur", True):
        return 1
    return int((2 << (max(1, getattr(cycles, "motion_steps", 1)) - 1)) + 1)


def note_moving(depsgraph: bpy.types.Depsgraph, shutter: Shutter, notes: Notes) -> None:
    """Write down what else moves while the shutter is open."""
    shutter.go(0.0)
    first = dict(_places(depsgraph))
    shutter.go(1.0)
    for key, (owner, place) in _places(depsgraph):
        if key not in first or first[key][1] != place:
            notes.ignored(owner, "Motion Blur", "it stands still, as in the middle of the exposure")


def _places(depsgraph: bpy.types.Depsgraph) -> Iterator[tuple[Hashable, tuple[str, bytes]]]:
    """Yield whatever Cycles would blur, by what tells it apart: who it is, and where its points
    are, as far as Cycles would look."""
    for instance in depsgraph.object_instances:  # its items do not outlive an iteration
        obj = instance.object
        owner = instance.parent if instance.is_instance else obj
        cycles = getattr(owner, "cycles", None)
        if not instance.show_self or not getattr(cycles, "use_motion_blur", True):
            continue
        place = np.array(instance.matrix_world, np.float32).tobytes()
        if (
            obj.type == "MESH"
            and not instance.is_instance
            and getattr(cycles, "use_deform_motion", True)
        ):
            points = np.empty(3 * len(obj.data.vertices), np.float32)
            obj.data.vertices.foreach_get("co", points)
            place += hashlib.blake2b(points.tobytes(), digest_size=16).digest()
        if obj.type not in ("CAMERA", "EMPTY", "ARMATURE"):
            kind = "Light" if obj.type == "LIGHT" else "Object"
            key = obj.name, owner.name, tuple(instance.persistent_id)
            yield key, (f"{kind} '{owner.name}'", place)
