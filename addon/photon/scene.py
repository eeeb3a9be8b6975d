# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene as the renderer sees it: plain frozen data, no Blender.

World space, lengths in metres, linear RGB, powers in watts. Blender's units: a light's
`power` is Blender's P = energy * colour * 2^exposure.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from .errors import SceneError

SNAPSHOT_VERSION = 1
CameraKind = Literal["PERSP", "ORTHO"]
LightKind = Literal["POINT", "SPOT"]
MIRROR = np.inf  # Phong exponent of a perfect mirror


def _empty(shape: tuple[int, ...], dtype: Any) -> Any:
    return field(default_factory=lambda: np.zeros(shape, dtype))


@dataclass(frozen=True)
class Camera:
    """A pinhole or orthographic camera that looks along its local -Z with +Y up.

    `window` is (left, right, bottom, top) of the whole frame: for PERSP on the plane at unit
    distance, for ORTHO in metres. It holds lens, sensor fit, shift and pixel aspect.
    """

    kind: CameraKind
    matrix: NDArray[np.float64]  # (4, 4) camera to world, a rigid motion
    window: tuple[float, float, float, float]
    clip_start: float = 0.0  # [m] along the view axis
    clip_end: float = np.inf  # [m]


@dataclass(frozen=True)
class Light:
    """A point light or spotlight of intensity P / (4 pi), with the spot's smooth step."""

    name: str
    kind: LightKind
    position: tuple[float, float, float]  # [m]
    power: tuple[float, float, float]  # P [W] per channel, >= 0
    direction: tuple[float, float, float] = (0.0, 0.0, -1.0)  # SPOT: unit axis of the cone
    radius: float = 0.0  # [m]; 0 is a delta light
    spot_size: float = np.pi / 4  # SPOT: full cone angle [rad], [0, pi]
    spot_blend: float = 0.15  # SPOT: share of the cone in which it fades, [0, 1]

    def check(self) -> None:
        """Raise SceneError naming the light and the first value out of its range."""
        who = f"light {self.name!r}"
        if self.kind not in get_args(LightKind):
            raise SceneError(f"{who}: kind {self.kind!r} is none of {get_args(LightKind)}")
        _check_finite(f"{who}: position", self.position)
        _check_finite(f"{who}: power", self.power, 0.0)
        _check_finite(f"{who}: radius", self.radius, 0.0)
        _check_finite(f"{who}: direction", self.direction)
        if not any(self.direction):
            raise SceneError(f"{who}: direction {self.direction} has no length")
        if not 0.0 <= self.spot_size <= np.pi * (1 + 1e-6):
            raise SceneError(f"{who}: spot_size {self.spot_size} is outside [0, pi]")
        if not 0.0 <= self.spot_blend <= 1.0:
            raise SceneError(f"{who}: spot_blend {self.spot_blend} is outside [0, 1]")


@dataclass(frozen=True)
class Material:
    """BRDF = k_d / pi + k_s * (mirror, or normalised Phong lobe of `exponent`)."""

    name: str
    diffuse: tuple[float, float, float] = (0.8, 0.8, 0.8)  # k_d
    specular: tuple[float, float, float] = (0.0, 0.0, 0.0)  # k_s
    exponent: float = MIRROR

    def check(self) -> None:
        """Raise SceneError naming the material and the first value out of its range."""
        _check_finite(f"material {self.name!r}: diffuse", self.diffuse, 0.0)
        _check_finite(f"material {self.name!r}: specular", self.specular, 0.0)
        if not self.exponent >= 0.0:
            raise SceneError(f"material {self.name!r}: exponent {self.exponent} is not >= 0")

    def conserving(self) -> Material:
        """The material with k_d + k_s <= 1 in each channel (scaled down)."""
        total = np.add(self.diffuse, self.specular)
        if total.max() <= 1.0:
            return self
        scale = np.maximum(total, 1.0)
        return replace(
            self,
            diffuse=_colour(np.divide(self.diffuse, scale)),
            specular=_colour(np.divide(self.specular, scale)),
        )


@dataclass(frozen=True)
class Scene:
    """Triangles, materials, lights and one camera.

    Triangles may hold NaN, be degenerate, or there may be none: the renderer skips and counts
    them. `surface` tells apart surfaces that must not exchange photons (one number an object).
    """

    camera: Camera
    lights: tuple[Light, ...] = ()
    materials: tuple[Material, ...] = ()
    vertices: NDArray[np.float64] = _empty((0, 3), np.float64)  # (V, 3) [m]
    triangles: NDArray[np.int32] = _empty((0, 3), np.int32)  # (T, 3) indices into vertices
    corner_normals: NDArray[np.float32] = _empty((0, 3, 3), np.float32)  # (T, 3, 3) unit
    material: NDArray[np.int32] = _empty((0,), np.int32)  # (T,) index into materials
    surface: NDArray[np.int32] = _empty((0,), np.int32)  # (T,) index into surfaces
    surfaces: tuple[str, ...] = ()  # object names
    background: tuple[float, float, float] = (0.0, 0.0, 0.0)  # world radiance [W/(m^2 sr)]

    def check(self) -> None:
        """Raise SceneError if arrays do not fit together or a value is outside its range."""
        count = len(self.triangles)
        for name, shape, dtype in (
            ("vertices", (len(self.vertices), 3), np.float64),
            ("triangles", (count, 3), np.int32),
            ("corner_normals", (count, 3, 3), np.float32),
            ("material", (count,), np.int32),
            ("surface", (count,), np.int32),
        ):
            array = getattr(self, name)
            if array.shape != shape or array.dtype != dtype:
                raise SceneError(
                    f"scene.{name}: expected {np.dtype(dtype).name}{list(shape)}, "
                    f"got {array.dtype.name}{list(array.shape)}"
                )
        for name, limit in (
            ("triangles", len(self.vertices)),
            ("material", len(self.materials)),
            ("surface", len(self.surfaces)),
        ):
            array = getattr(self, name)
            bad = (array < 0) | (array >= limit)
            if bad.any():
                where = tuple(int(i) for i in np.argwhere(bad)[0])
                raise SceneError(
                    f"scene.{name}{list(where)} = {int(array[where])} is outside [0, {limit})"
                )
        self._check_camera()
        _check_finite("scene.background", self.background, 0.0)
        for light in self.lights:
            light.check()
        for material in self.materials:
            material.check()

    def _check_camera(self) -> None:
        camera = self.camera
        if camera.kind not in get_args(CameraKind):
            raise SceneError(
                f"scene.camera.kind = {camera.kind!r} is none of {get_args(CameraKind)}"
            )
        matrix = camera.matrix
        if matrix.shape != (4, 4) or not np.isfinite(matrix).all():
            raise SceneError("scene.camera.matrix: expected 4x4 finite numbers")
        if np.linalg.matrix_rank(matrix) < 4:
            raise SceneError("scene.camera.matrix has no inverse")
        left, right, bottom, top = camera.window
        if not (np.isfinite(camera.window).all() and left < right and bottom < top):
            raise SceneError(f"scene.camera.window {camera.window} is empty or not finite")
        if not 0.0 <= camera.clip_start < camera.clip_end:  # also refuses NaN
            raise SceneError(
                f"scene.camera: clip_start {camera.clip_start}, clip_end {camera.clip_end}: "
                "expected 0 <= start < end"
            )

    def save(self, path: str | Path) -> None:
        """Write the snapshot as an .npz file (arrays, and one JSON text for the rest)."""
        header = {
            "version": SNAPSHOT_VERSION,
            "camera": _plain(self.camera),
            "lights": [_plain(light) for light in self.lights],
            "materials": [_plain(material) for material in self.materials],
            "surfaces": list(self.surfaces),
            "background": list(self.background),
        }
        arrays = {name: getattr(self, name) for name in _ARRAYS}
        with open(path, "wb") as file:
            np.savez(file, header=np.array(json.dumps(header)), **arrays)

    @staticmethod
    def load(path: str | Path) -> Scene:
        """Read a snapshot; raise SceneError naming the file if it is not one."""
        try:
            with open(path, "rb") as file, np.load(file, allow_pickle=False) as data:
                scene = _read(data)
                scene.check()
        except FileNotFoundError:
            raise SceneError(f"{path}: no such file") from None
        except SceneError as error:
            raise SceneError(f"{path}: {error}") from error
        except Exception as error:  # numpy, zipfile and json raise a dozen kinds for damaged files
            raise SceneError(f"{path}: not a Photon Stream scene snapshot ({error})") from error
        return scene


def _read(data: Any) -> Scene:
    """A Scene from the arrays of a snapshot; raises whatever a malformed one leads to."""
    header = json.loads(str(data["header"]))
    if header["version"] != SNAPSHOT_VERSION:
        raise SceneError(
            f"snapshot version {header['version']}, this Photon Stream reads {SNAPSHOT_VERSION}"
        )
    camera = dict(header["camera"], matrix=np.array(header["camera"]["matrix"], np.float64))
    camera["window"] = tuple(map(float, camera["window"]))
    return Scene(
        camera=Camera(**camera),
        lights=tuple(Light(**_tuples(light)) for light in header["lights"]),
        materials=tuple(Material(**_tuples(m)) for m in header["materials"]),
        surfaces=tuple(header["surfaces"]),
        background=tuple(header["background"]),
        **{name: data[name] for name in _ARRAYS},
    )


def _colour(values: Any) -> tuple[float, float, float]:
    red, green, blue = map(float, values)
    return red, green, blue


def _check_finite(what: str, values: Any, low: float = -np.inf) -> None:
    """Raise SceneError unless all numbers are finite and at least `low`."""
    array = np.asarray(values, np.float64)
    if not (np.isfinite(array).all() and (array >= low).all()):
        raise SceneError(f"{what} = {values} is not finite or below {low}")


_ARRAYS = ("vertices", "triangles", "corner_normals", "material", "surface")


def _plain(record: Any) -> dict[str, Any]:
    """The fields of a record as JSON values; JSON's own Infinity is what Python reads back."""
    return {
        name: value.tolist() if isinstance(value, np.ndarray) else value
        for name, value in vars(record).items()
    }


def _tuples(values: dict[str, Any]) -> dict[str, Any]:
    return {name: tuple(v) if isinstance(v, list) else v for name, v in values.items()}
