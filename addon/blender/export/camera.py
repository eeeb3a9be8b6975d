# SPDX-License-Identifier: GPL-3.0-or-later
"""Export the active camera."""

from __future__ import annotations

import math

import bpy
import numpy as np
from numpy.typing import NDArray

from ...photon.errors import SceneError
from ...photon.scene import Camera
from .report import Notes

Window = tuple[float, float, float, float]

# A product of unit axes above this is a skew, not the float32 rounding of matrix_world.
SKEW = 1e-5


def export_camera(
    camera: bpy.types.Object | None, depsgraph: bpy.types.Depsgraph, notes: Notes
) -> Camera:
    """Return the camera as the renderer needs it; raise SceneError if there is none."""
    scene = depsgraph.scene_eval
    if camera is None:
        raise SceneError(f"Scene '{scene.name}' has no camera")
    if camera.type != "CAMERA":
        raise SceneError(
            f"The scene's camera, '{camera.name}', is no camera but a {camera.type.lower()} object"
        )
    camera = camera.evaluated_get(depsgraph)
    data = camera.data
    name = f"Camera '{camera.name}'"
    if data.type not in ("PERSP", "ORTHO"):
        raise SceneError(
            f"{name} has lens type {data.type}: Photon Stream renders Perspective and Orthographic"
        )
    if data.dof.use_dof:
        notes.ignored(name, "Depth of Field", "everything is in focus")
    camera_exported = Camera(
        kind=data.type,
        matrix=rigid(np.array(camera.matrix_world, np.float64), name, notes),
        window=window_of(camera, depsgraph),
        clip_start=data.clip_start,
        clip_end=data.clip_end,
    )
    if not notes.mention(name):
        notes.exact(name, "Perspective" if data.type == "PERSP" else "Orthographic")
    return camera_exported


def window_of(camera: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Window:
    """Return (left, right, bottom, top) at unit distance, ORTHO in metres.

    Blender's own projection matrix holds lens, sensor fit, shift and pixel aspect; here it is
    solved for the four edges of the frame, where normalised device coordinates are -1 and 1.
    """
    render = depsgraph.scene_eval.render
    width, height = frame_size(render)
    p = np.array(
        camera.calc_matrix_camera(
            depsgraph,
            x=width,
            y=height,
            scale_x=render.pixel_aspect_x,
            scale_y=render.pixel_aspect_y,
        ),
        np.float64,
    )
    if camera.data.type == "ORTHO":  # ndc = p00 x + p03
        left, right = ((edge - p[0, 3]) / p[0, 0] for edge in (-1.0, 1.0))
        bottom, top = ((edge - p[1, 3]) / p[1, 1] for edge in (-1.0, 1.0))
    else:  # ndc = (p00 x + p02 z) / -z at z = -1
        left, right = ((edge + p[0, 2]) / p[0, 0] for edge in (-1.0, 1.0))
        bottom, top = ((edge + p[1, 2]) / p[1, 1] for edge in (-1.0, 1.0))
    return float(left), float(right), float(bottom), float(top)


def frame_size(render: bpy.types.RenderSettings) -> tuple[int, int]:
    """Return the whole frame in pixels, rounded as Blender rounds it."""
    percentage = render.resolution_percentage
    return (
        max(1, render.resolution_x * percentage // 100),
        max(1, render.resolution_y * percentage // 100),
    )


def rigid(matrix: NDArray[np.float64], name: str, notes: Notes) -> NDArray[np.float64]:
    """Return `matrix` with its scale removed, as Blender does for cameras.

    A parent's uneven scale can skew the axes; then the view direction is kept and the others
    are turned back to right angles. A mirrored camera stays mirrored, as in Blender.
    """
    axes = matrix[:3, :3]
    lengths = np.linalg.norm(axes, axis=0)
    if not (np.isfinite(matrix).all() and lengths.min() > 0.0):
        raise SceneError(f"{name}: its transform has zero scale or is not finite")
    axes = axes / lengths
    x, y, z = axes.T
    if max(abs(x @ y), abs(y @ z), abs(z @ x)) > SKEW:
        notes.approximated(name, "Skewed transform", "its axes are turned to right angles")
    side = math.copysign(1.0, np.linalg.det(axes))
    y = y - (y @ z) * z
    y /= np.linalg.norm(y)
    result = np.eye(4)
    result[:3, :3] = np.column_stack((side * np.cross(y, z), y, z))
    result[:3, 3] = matrix[:3, 3]
    return result
