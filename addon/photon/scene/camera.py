# SPDX-License-Identifier: GPL-3.0-or-later
"""The camera as the renderer sees it; see values.py for units."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import SceneError
from .checks import check_finite


@dataclass(frozen=True)
class Lens:
    """An aperture through which only what lies at the focus distance is sharp."""

    radius: float  # [m]
    focus: float  # [m] along the view axis; of panoramas along each ray
    blades: int = 0  # the aperture's corners; it is round if they are fewer than three
    rotation: float = 0.0  # [rad] of the blades
    ratio: float = 1.0  # the aperture is so many times higher than wide

    def check(self) -> None:
        """Raise SceneError naming the first value out of its range."""
        for name in ("radius", "focus", "blades", "ratio"):
            check_finite(f"scene.camera.lens.{name}", getattr(self, name), 0.0)
        check_finite("scene.camera.lens.rotation", self.rotation)
        if self.ratio == 0.0:
            raise SceneError("scene.camera.lens.ratio = 0: the aperture is infinitely wide")


@dataclass(frozen=True)
class Motion:
    """Where a camera is while its shutter is open."""

    matrices: NDArray[np.float64]  # (S, 4, 4) at even instants, the first and the last included
    # The window's size at the first, middle and last instant, over what it is.
    zooms: tuple[float, float, float] = (1.0, 1.0, 1.0)
    shutter: tuple[float, ...] = ()  # how open it is, at even instants; (): all the time the same

    def check(self) -> None:
        """Raise SceneError naming the first value out of its range."""
        shape = self.matrices.shape
        if len(shape) != 3 or shape[0] < 1 or shape[1:] != (4, 4):
            raise SceneError(f"scene.camera.motion.matrices: expected (S, 4, 4), got {shape}")
        check_finite("scene.camera.motion.matrices", self.matrices)
        check_finite("scene.camera.motion.zooms", self.zooms, 1e-9)
        check_finite("scene.camera.motion.shutter", self.shutter, 0.0)


@dataclass(frozen=True)
class Camera:
    """A camera of one of the kinds of glsl/cameras that looks along its local -Z with +Y up.

    `window` is (left, right, bottom, top) of the whole frame: for PERSP on the plane at unit
    distance, for ORTHO in metres, for others as their files say. It holds lens, sensor fit, shift
    and pixel aspect.
    """

    kind: str  # in capitals, as Blender has them
    matrix: NDArray[np.float64]  # (4, 4) camera to world, a rigid motion
    window: tuple[float, float, float, float]
    clip_start: float = 0.0  # [m] along the view axis
    clip_end: float = np.inf  # [m]
    parameters: Mapping[str, float] = field(default_factory=dict)
    lens: Lens | None = None  # of a pinhole: none
    motion: Motion | None = None  # None: it stands still

    @property
    def is_panorama(self) -> bool:
        """Whether it sees in directions that no plane shows."""
        return self.kind not in ("PERSP", "ORTHO")

    @staticmethod
    def read(values: Mapping[str, Any]) -> Camera:
        """The camera of a snapshot's JSON; raises whatever a malformed one leads to."""
        read = dict(values, matrix=np.array(values["matrix"], np.float64))
        read["window"] = tuple(map(float, values["window"]))
        if values.get("lens"):
            read["lens"] = Lens(**values["lens"])
        if motion := values.get("motion"):
            read["motion"] = Motion(
                np.array(motion["matrices"], np.float64),
                tuple(motion["zooms"]),
                tuple(motion["shutter"]),
            )
        return Camera(**read)

    def check(self) -> None:
        """Raise SceneError naming the first value out of its range."""
        matrix = self.matrix
        if matrix.shape != (4, 4) or not np.isfinite(matrix).all():
            raise SceneError("scene.camera.matrix: expected 4x4 finite numbers")
        if np.linalg.matrix_rank(matrix) < 4:
            raise SceneError("scene.camera.matrix has no inverse")
        left, right, bottom, top = self.window
        if not (np.isfinite(self.window).all() and left < right and bottom < top):
            raise SceneError(f"scene.camera.window {self.window} is empty or not finite")
        if not 0.0 <= self.clip_start < self.clip_end:  # also refuses NaN
            raise SceneError(
                f"scene.camera: clip_start {self.clip_start}, clip_end {self.clip_end}: "
                "expected 0 <= start < end"
            )
        for name, value in self.parameters.items():
            check_finite(f"scene.camera: {name}", value)
        if self.lens:
            self.lens.check()
        if self.motion:
            self.motion.check()
