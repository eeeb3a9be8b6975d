# SPDX-License-Identifier: GPL-3.0-or-later
"""Export where the camera is while the shutter is open; what else moves is tracks.py's."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...photon.scene import Camera, Motion
from .camera import Window, rigid, window_of
from .report import Notes

FrameSet = Callable[[int, float], None]  # RenderEngine.frame_set
SHUTTER_SAMPLES = 256  # of the shutter curve
MOST_STEPS = 129  # Cycles'


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


class Views:
    """Where the camera is at its instants."""

    def __init__(
        self, camera: bpy.types.Object, depsgraph: bpy.types.Depsgraph, notes: Notes
    ) -> None:
        self._camera, self._depsgraph, self._notes = camera, depsgraph, notes
        self.times = times_of(steps_of(camera))
        self._name = f"Camera '{camera.name}'"
        self._matrices: dict[float, NDArray[np.float64]] = {}
        self._windows: dict[float, Window] = {}

    def look(self, time: float) -> None:
        """See where it is now."""
        seen = self._camera.original.evaluated_get(self._depsgraph)
        matrix = np.array(seen.matrix_world, np.float64)
        self._matrices[time] = rigid(matrix, self._name, self._notes)
        self._windows[time] = window_of(seen, self._depsgraph)

    def moving(self, exported: Camera, curve: tuple[float, ...]) -> Camera:
        """The camera with its motion, and where it is in the middle of the exposure."""
        matrices = [self._matrices[time] for time in self.times]
        windows = [self._windows[time] for time in self.times]
        middle = len(matrices) // 2
        standing = replace(exported, matrix=matrices[middle])
        zooms = (1.0, 1.0, 1.0)
        if exported.kind == "PERSP":  # Cycles, too, lets no other camera zoom
            standing = replace(standing, window=windows[middle])
            widths = [right - left for left, right, _, _ in windows]
            zooms = (widths[0] / widths[middle], 1.0, widths[-1] / widths[middle])
        moves = any(not np.array_equal(matrix, matrices[middle]) for matrix in matrices)
        if not moves and len(set(zooms)) == 1:
            return standing
        self._notes.exact(self._name, "Motion Blur")
        return replace(standing, motion=Motion(np.array(matrices), zooms, curve))


def steps_of(obj: bpy.types.Object, owner: bpy.types.Object | None = None) -> int:
    """Return at how many instants Cycles looks where something is, between which it moves evenly;
    1: it stands still. `owner`: whose instance it is."""
    steps = 1
    for one in {obj.name: obj, (owner or obj).name: owner or obj}.values():
        cycles = getattr(one, "cycles", None)
        if not getattr(cycles, "use_motion_blur", True):
            return 1
        steps = max(steps, getattr(cycles, "motion_steps", 1))
    return min((2 << (steps - 1)) + 1, MOST_STEPS)


def times_of(steps: int) -> tuple[float, ...]:
    """Return so many even instants from 0 to 1, or the middle."""
    return tuple(step / (steps - 1) for step in range(steps)) if steps > 1 else (0.5,)


def bends(*objects: Any) -> bool:
    """Return whether Cycles looks how the shapes of objects change."""
    settings = (getattr(obj, "cycles", None) for obj in objects)
    return all(getattr(cycles, "use_deform_motion", True) for cycles in settings)
