# SPDX-License-Identifier: GPL-3.0-or-later
"""Export the active camera."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...photon.errors import SceneError
from ...photon.scene import Camera, Lens
from ...photon.stage.kinds import camera_kinds
from .report import Notes

Window = tuple[float, float, float, float]

# A product of unit axes above this is a skew, not the float32 rounding of matrix_world.
SKEW = 1e-5
SMALLEST_F_STOP = 1e-5  # Cycles'


def export_camera(
    camera: bpy.types.Object | None, depsgraph: bpy.types.Depsgraph, notes: Notes
) -> Camera:
    """Return the camera as it is at the current frame; raise SceneError if there is none."""
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
    kind = kind_of(data, name)
    matrix = rigid(np.array(camera.matrix_world, np.float64), name, notes)
    lens = lens_of(data, kind, matrix, depsgraph) if data.dof.use_dof else None
    if data.dof.use_dof:
        notes.exact(name, "Depth of Field")
    camera_exported = Camera(
        kind=kind,
        matrix=matrix,
        window=window_of(camera, depsgraph),
        clip_start=data.clip_start,
        clip_end=data.clip_end,
        parameters=parameters_of(data, kind, depsgraph.scene_eval.render),
        lens=lens,
    )
    if not notes.mentions(name):
        notes.exact(name, "Panoramic" if camera_exported.is_panorama else data.type.capitalize())
    return camera_exported


@dataclass(frozen=True)
class View:
    """What materials may ask of the camera."""

    camera: Camera

    @property
    def to_camera(self) -> NDArray[np.float64]:
        """(4, 4) from world space to the camera's, which looks along its Z."""
        found: NDArray[np.float64] = np.diag((1.0, 1.0, -1.0, 1.0)) @ np.linalg.inv(
            self.camera.matrix
        )
        return found

    @property
    def to_window(self) -> NDArray[np.float64]:
        """(3, 4) from world space to where the picture shows it, from 0 to 1, times a depth: the
        third row. A panorama has none such."""
        x, y, z, one = self.to_camera
        left, right, bottom, top = self.camera.window
        depth = one if self.camera.kind == "ORTHO" else z
        across, up = (x - left * depth) / (right - left), (y - bottom * depth) / (top - bottom)
        return np.array((across, up, depth))


def kind_of(data: bpy.types.Camera, name: str) -> str:
    """Return the kind of the renderer's camera; SceneError if it has none like this."""
    kind = panorama_of(data).panorama_type if data.type == "PANO" else data.type
    if kind.lower() not in camera_kinds():
        kinds = ", ".join(name.upper() for name in camera_kinds())
        raise SceneError(f"{name} is of type {kind}: Photon Stream renders {kinds}")
    return str(kind)


def panorama_of(data: bpy.types.Camera) -> Any:
    """Return what has a panorama's properties: the camera, before Blender 5.0 Cycles' part."""
    return data if hasattr(data, "panorama_type") else data.cycles


def parameters_of(
    data: bpy.types.Camera, kind: str, render: bpy.types.RenderSettings
) -> dict[str, float]:
    """Return what the kind's file asks for, by Blender's names of it."""
    width, height = frame_size(render)
    aspect = width * render.pixel_aspect_x / (height * render.pixel_aspect_y)
    fit = data.sensor_fit
    size = data.sensor_height if fit == "VERTICAL" else data.sensor_width
    across = fit == "HORIZONTAL" or (fit == "AUTO" and aspect > 1.0)
    sensor = {
        "sensor_width": size if across else size * aspect,
        "sensor_height": size / aspect if across else size,
    }
    properties = panorama_of(data)
    names = camera_kinds()[kind.lower()].parameters
    return {name: sensor[name] if name in sensor else getattr(properties, name) for name in names}


def lens_of(
    data: bpy.types.Camera,
    kind: str,
    matrix: NDArray[np.float64],
    depsgraph: bpy.types.Depsgraph,
) -> Lens:
    """Return the aperture and what it is focused on, as Cycles has them."""
    dof = data.dof
    length = 1.0 if kind == "ORTHO" else data.lens * 1e-3  # [m]
    return Lens(
        radius=length / (2.0 * max(dof.aperture_fstop, SMALLEST_F_STOP)),
        focus=focus_distance(dof, matrix, depsgraph),
        blades=dof.aperture_blades,
        rotation=dof.aperture_rotation,
        ratio=dof.aperture_ratio,
    )


def focus_distance(
    dof: bpy.types.CameraDOFSettings, matrix: NDArray[np.float64], depsgraph: bpy.types.Depsgraph
) -> float:
    """Return how far along the view axis the focus lies, before or behind the camera."""
    if dof.focus_object is None:
        return float(dof.focus_distance)
    target = dof.focus_object.evaluated_get(depsgraph)
    place = target.matrix_world
    if target.pose and dof.focus_subtarget in target.pose.bones:
        place = place @ target.pose.bones[dof.focus_subtarget].matrix
    return float(abs((matrix[:3, 3] - np.array(place.translation)) @ matrix[:3, 2]))


def window_of(camera: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Window:
    """Return (left, right, bottom, top) at unit distance, ORTHO in metres, PANO over [0, 1]^2.

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
    if camera.data.type == "PANO":
        x, y = camera.data.shift_x, camera.data.shift_y
        return x, 1.0 + x, y, 1.0 + y
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


def is_skewed(axes: NDArray[np.float64]) -> bool:
    """Whether the columns of (3, 3), of any length but zero, are not at right angles."""
    x, y, z = (axes / np.linalg.norm(axes, axis=0)).T
    return bool(max(abs(x @ y), abs(y @ z), abs(z @ x)) > SKEW)


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
    _, y, z = axes.T
    if is_skewed(axes):
        notes.approximated(name, "Skewed transform", "its axes are turned to right angles")
    side = math.copysign(1.0, np.linalg.det(axes))
    y = y - (y @ z) * z
    y /= np.linalg.norm(y)
    result = np.eye(4)
    result[:3, :3] = np.column_stack((side * np.cross(y, z), y, z))
    result[:3, 3] = matrix[:3, 3]
    return result
