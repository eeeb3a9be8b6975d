# SPDX-License-Identifier: GPL-3.0-or-later
"""The eye: where its rays start, and where they go."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...streams import Device, Stream, of_parts
from ...streams.device import Layer
from ..kernels.eye_rays import EyeRays
from ..kernels.records import PIXEL, RAY_DIRECTION, RAY_ORIGIN
from ..photons.splats import Projection
from ..scene import Scene
from ..settings import Region, Settings, pixel_filter_define
from ..stage.geometry import Frame
from ..stage.kinds import camera_kinds
from ..stage.movement import part_of_turn
from ..stage.needs import SceneNeeds
from .instants import instant

_FAR = 1.0e36  # clip distances beyond float32's use, and less than glsl/lib/reach.glsl's
_SHARP = 1.0e15  # squares of focus distances beyond it are no float32


class EyeCamera:
    """Sends eye rays through the scene's camera, in scene units."""

    def __init__(
        self,
        device: Device,
        layer: Layer,
        scene: Scene,
        frame: Frame,
        settings: Settings,
        needs: SceneNeeds,
    ) -> None:
        camera = scene.camera
        self._device, self._camera, self._settings = device, camera, settings
        defines = {**needs.camera_defines, **pixel_filter_define(settings)}
        self.kernel = EyeRays(device, layer, defines, made=needs.made)
        self._matrix = np.array(camera.matrix, np.float64)
        self._matrix[:3, 3] = frame.points(self._matrix[:3, 3])
        if camera.motion:
            self._matrices = camera.motion.matrices.copy()
            self._matrices[:, :3, 3] = frame.points(self._matrices[:, :3, 3])
        self._is_orthographic, self._scale = camera.kind == "ORTHO", frame.scale
        unit = frame.scale if self._is_orthographic else 1.0
        self._window = tuple(edge / unit for edge in camera.window)
        numbers = camera_kinds()[camera.kind.lower()].numbers(camera.parameters, 1 / frame.scale)
        self._uniforms: dict[str, Any] = {
            "camera_parameters": (*numbers, 0.0, 0.0, 0.0, 0.0)[:4],
            "clip": tuple(min(c / frame.scale, _FAR) for c in (camera.clip_start, camera.clip_end)),
            "frame_size": (settings.width, settings.height),
            "pixel_filter_width": settings.pixel_filter_width,
            "seed": settings.seed,
        }
        if lens := camera.lens:
            self._uniforms |= {
                "lens": (lens.radius / frame.scale, lens.rotation, 1.0 / lens.ratio),
                "focus": min(lens.focus / frame.scale, _SHARP),
                "blades": lens.blades,
            }

    def send(
        self, passes: range, region: Region, origin: Stream, direction: Stream, pixel: Stream
    ) -> Projection:
        """Send one ray of each pass through each pixel of a region; where points project then. A
        camera that moves sees one pass at a time, each at its instant."""
        assert len(passes) == 1 or not self._camera.motion
        settings = self._settings
        x0, y0, x1, y1 = region
        matrix, window = self._run(passes, (x0, y0), (origin, direction, pixel))
        left, right, bottom, top = window
        du, dv = (right - left) / settings.width, (top - bottom) / settings.height
        window = left + x0 * du, left + x1 * du, bottom + y0 * dv, bottom + y1 * dv
        spread = settings.pixel_filter_reach * du, settings.pixel_filter_reach * dv
        world_to_camera = _column_major(np.linalg.inv(matrix))
        return Projection(world_to_camera, window, spread, self._is_orthographic)

    def _run(
        self, passes: range, at: tuple[int, int], rays: Sequence[Stream], **changed: Any
    ) -> tuple[NDArray[np.float64], tuple[float, ...]]:
        """Send rays through the pixels from one on; where the camera is then, and its window."""
        matrix, window = self._at(passes.start)
        uniforms = {
            "camera": _column_major(matrix),
            "window": window,
            "region_origin": at,
            "pass_index": of_parts(passes),
        }
        streams = dict(zip(("origin", "direction", "pixel"), rays, strict=True))
        self.kernel.run(streams, uniforms=self._uniforms | uniforms | changed)
        return matrix, window

    def footprint(self) -> tuple[float, list[float] | None]:
        """How wide a pixel is at distance 1 from the eye, or everywhere and None [scene units]."""
        left, right, _, _ = self._window
        eye = None if self._is_orthographic else self._matrix[:3, 3].tolist()
        if self._camera.is_panorama:
            return self._middle_angle(), eye
        return (right - left) / self._settings.width, eye

    def widths(self) -> dict[str, tuple[float, ...]]:
        """How wide a pixel is anywhere, as glsl/lib/shading_point.glsl has it."""
        width, eye = self.footprint()
        widths = (0.0, width) if eye else (width, 0.0)
        return {**self.view_axis(), "pixel_width": (*widths, float(not self._camera.is_panorama))}

    def view_axis(self) -> dict[str, tuple[float, ...]]:
        """Where the eye is, and where it looks [scene units]."""
        return {
            "eye": tuple(map(float, self._matrix[:3, 3])),
            "view_axis": tuple(map(float, -self._matrix[:3, 2])),
        }

    def mist(self) -> dict[str, tuple[float, ...]]:
        """What glsl/lib/mist.glsl asks for, where an image of it is wanted."""
        if self._settings.mist is None:
            return {}
        begin, depth, power = self._settings.mist
        thickens = min(self._scale / depth, _FAR) if depth > 0.0 else 0.0  # no depth, no mist
        return {"mist": (begin / self._scale, thickens, power, float(self._is_orthographic))}

    def _at(self, index: int) -> tuple[NDArray[np.float64], tuple[float, ...]]:
        """Where the camera is at a pass's instant, and its window."""
        motion = self._camera.motion
        if not motion:
            return self._matrix, self._window
        time = instant(self._settings, index, motion.shutter)
        zoom = float(np.interp(time, (0.0, 0.5, 1.0), motion.zooms))
        return rigid_between(self._matrices, time), tuple(edge * zoom for edge in self._window)

    def _middle_angle(self) -> float:
        """Between the rays of two neighbouring pixels in the middle of the picture [rad]."""
        x, y = self._settings.width // 2, self._settings.height // 2
        records = RAY_ORIGIN, RAY_DIRECTION, PIXEL
        rays = [Stream(self._device, record, (2, 1)) for record in records]
        for ray in rays:
            ray.clear()
        # Through the middles of both, and of the lens.
        sharp = {"lens": (0.0, 0.0, 1.0)} if self._camera.lens else {}
        self._run(range(1), (x, y), rays, pixel_filter_width=0.0, **sharp)
        first, second = rays[1].download()[0, :, :3].astype(np.float64)
        for ray in rays:
            ray.release()
        return float(np.linalg.norm(first - second))


def rigid_between(matrices: NDArray[np.float64], time: float) -> NDArray[np.float64]:
    """The rigid transform (4, 4) at a time in [0, 1], of those at S even instants (S, 4, 4):
    between two of them it goes straight, and turns evenly about one axis."""
    place = time * (len(matrices) - 1)
    first = matrices[int(place)]
    last = matrices[min(int(place) + 1, len(matrices) - 1)]
    part = place - int(place)
    result: NDArray[np.float64] = first + part * (last - first)
    result[:3, :3] = part_of_turn(last[:3, :3] @ first[:3, :3].T, part) @ first[:3, :3]
    return result


def _column_major(matrix: NDArray[np.float64]) -> tuple[float, ...]:
    return tuple(map(float, matrix.T.ravel()))
