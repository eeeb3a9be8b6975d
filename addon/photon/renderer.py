# SPDX-License-Identifier: GPL-3.0-or-later
"""The renderer: Scene and Settings in, images out. The frame reads like the paper."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..streams import Device, Stream, StreamError
from .error import Error, error_of
from .errors import DeviceError
from .film import Film
from .geometry import Frame, Mesh, Tables, frame_of
from .needs import SceneNeeds
from .photon_grid import PhotonGrid
from .photon_mapper import PhotonMapper
from .picture import FILM_IMAGES, picture_of
from .ray_tracer import RayTracer
from .scene import Scene
from .settings import Settings, filter_define
from .splat import Splat, View
from .version import VERSION

NO_DEPTH = 1.0e10  # Blender's depth where nothing is seen
# The automatic radius's aim in the first pass. Measured on cornell_classic and cornell_mirror: 24
# has twice the error after 16 passes, 150 two thirds of it but takes half as long again.
PHOTONS_PER_DISC = 64.0


def open_device(settings: Settings) -> Device:
    """The OpenGL device that the settings ask for; DeviceError says what is missing."""
    try:
        device = Device(settings.device_index)
        device.choose_layer(settings.layer)
    except StreamError as error:
        raise DeviceError(str(error)) from error
    return device


class Renderer:
    """Renders a scene pass by pass.

    Passes depend on (seed, index) alone; what they share is the film. Raises SceneError or
    SettingsError for what it cannot render, DeviceError when OpenGL fails.
    """

    def __init__(self, scene: Scene, settings: Settings, device: Device) -> None:
        scene.check()
        settings.check()
        scene, self.warnings = _conserving(scene)
        self.scene, self.settings, self.device = scene, settings, device
        self.seconds: dict[str, float] = {}
        device.use()
        self.layer = device.choose_layer(settings.layer)
        self.estimator = "none"
        with _Timed(self.seconds, "bvh"):
            self.frame: Frame = frame_of(scene)
            mesh = Mesh.build(scene, self.frame)
        self.triangles = len(mesh.corners)
        self.needs = SceneNeeds.of(scene, settings, mesh)
        self.warnings += _warnings(scene, mesh, self.needs)
        self._automatic_radius = _automatic_radius(settings, mesh)
        defines = filter_define(settings)
        with _Timed(self.seconds, "programs"):
            try:
                self._tables = Tables(device, scene, self.frame, mesh)
                self.ray_tracer = RayTracer(
                    device, self.layer, self._tables, self.frame, scene, settings, self.needs
                )
                x0, y0, x1, y1 = settings.frame_region
                names = (*FILM_IMAGES, "blur") if self.needs.photons else FILM_IMAGES
                self.film = Film(device, self.layer, (x1 - x0, y1 - y0), names)
                self.photon_mapper = self.splat = self.grid = None
                if self.needs.photons:
                    self.photon_mapper = PhotonMapper(
                        device, self.layer, self._tables, settings, self.needs
                    )
                    self.estimator = (
                        "gather" if settings.estimator == "auto" else settings.estimator
                    )
                    if self.estimator == "splat":
                        self.splat = Splat(device, settings.splat_shape, defines)
                    if self.estimator == "gather" or self.needs.mirror:
                        self.grid = PhotonGrid(device, self.layer, defines, mesh.extent)
            except StreamError as error:
                raise DeviceError(str(error)) from error
        # Nothing seen, until the first pass.
        self._depth = np.full((y1 - y0, x1 - x0, 1), NO_DEPTH, np.float32)
        self._error: tuple[int, Error] | None = None  # after so many passes

    def radius(self, index: int) -> float:
        """The gather radius of pass `index` [m].

        Knaus & Zwicker 2011, eq. 15, in closed form: r_i^2 = r_1^2 prod (k + alpha) / (k + 1).
        """
        first = self.settings.radius or self._automatic_radius * self.frame.scale
        alpha, i = self.settings.radius_shrink, index + 1
        log_area = math.lgamma(i + alpha) - math.lgamma(1 + alpha) - math.lgamma(i + 1)
        return first * math.exp(log_area / 2)

    def render_pass(self) -> None:
        """Add the next pass to the film."""
        index = self.settings.first_pass + self.film.passes
        self.device.use()
        try:
            radius = self.radius(index) / self.frame.scale
            if self.photon_mapper:
                self._trace_photons(index, radius)
            with _Timed(self.seconds, "eye"):
                estimate = self._estimate if self.photon_mapper else None
                images = self.ray_tracer.trace(index, estimate, radius)
                if self.film.passes == 0:
                    self._depth = self._depth_seen(images["normal"])
                self.film.add(images)
            self.device.check()
        except StreamError as error:
            raise DeviceError(str(error)) from error

    def images(self) -> dict[str, NDArray[np.float32]]:
        """The picture so far; see `picture_of`. Depth (h, w, 1) [m] is of the first pass, Error
        (h, w, 1) [W/(m^2 sr)] is `Error.image`."""
        return self._look() | {"Depth": self._depth, "Error": self.error().image}

    def error(self) -> Error:
        """How far the picture so far is from the converged one."""
        if self._error is None or self._error[0] != self.film.passes:
            self._look()
        assert self._error
        return self._error[1]

    def info(self) -> dict[str, Any]:
        """What the picture was made with, for metadata and reports; the error is the last known."""
        error = self._error[1] if self._error else None
        photons = self.settings.photons if self.photon_mapper else 0
        return {
            "version": VERSION,
            "device": self.device.name,
            "driver": self.device.version,
            "layer": self.layer,
            "estimator": self.estimator,
            "triangles": self.triangles,
            "photons": photons * self.film.passes,
            "photons_a_pass": photons,
            "radius": self.radius(0),
            "seed": self.settings.seed,
            "passes": self.film.passes,
            "error": error.total if error else math.inf,
            "noise": error.noise if error else math.inf,
            "bias": error.bias if error else math.inf,
            "unfinished_photons": self.photon_mapper.unfinished if self.photon_mapper else 0,
            "dropped_photons": self.photon_mapper.deposits.dropped if self.photon_mapper else 0,
            "seconds": {name: round(value, 4) for name, value in self.seconds.items()},
        }

    def launches(self) -> dict[str, int]:
        """How often each kernel has run."""
        kernels = [*self.ray_tracer.kernels.values()]
        if self.photon_mapper:
            kernels += self.photon_mapper.kernels
        counts: dict[str, int] = {}
        for kernel in kernels:
            counts[kernel.stem] = counts.get(kernel.stem, 0) + kernel.launches
        if self.grid:
            counts["gather"] = self.grid.kernel.launches
        if self.splat:
            counts["splat"] = self.splat.launches
        return counts

    def release(self) -> None:
        """Free everything on the device but the device."""
        self.device.use()
        parts = (
            self.ray_tracer,
            self.film,
            self.photon_mapper,
            self.splat,
            self.grid,
            self._tables,
        )
        for part in parts:
            if part:
                part.release()

    def _look(self) -> dict[str, NDArray[np.float32]]:
        """Make picture and error of what the film holds."""
        self.device.use()
        exposure = self.film.exposure()
        images = picture_of(exposure.means)
        self._error = self.film.passes, error_of(exposure, images["Combined"])
        return images

    def _trace_photons(self, index: int, radius: float) -> None:
        assert self.photon_mapper
        with _Timed(self.seconds, "photons"):
            deposits = self.photon_mapper.trace(index, len(self.scene.lights))
        with _Timed(self.seconds, "photon map"):
            for estimator in (self.splat, self.grid):
                if estimator:
                    estimator.prepare(deposits, radius)

    def _estimate(
        self, place: Stream, facing: Stream, irradiance: Stream, view: View | None
    ) -> None:
        """Splat what the camera sees directly, if asked to; gather the rest."""
        if self.splat and view:
            self.splat.estimate(place, facing, irradiance, view)
        else:
            assert self.grid
            self.grid.estimate(place, facing, irradiance)

    def _depth_seen(self, normal: Stream) -> NDArray[np.float32]:
        """Depth along the view axis [m] of one pass: a mean over passes would mix objects."""
        depth = normal.download()[..., 3:] * np.float32(self.frame.scale)
        return np.where(depth > 0, depth, np.float32(NO_DEPTH))


class _Timed:
    """Adds the seconds of a `with` block to an entry of `seconds`."""

    def __init__(self, seconds: dict[str, float], name: str) -> None:
        self._seconds, self._name = seconds, name

    def __enter__(self) -> None:
        self._start = time.perf_counter()

    def __exit__(self, *_: object) -> None:
        spent = time.perf_counter() - self._start
        self._seconds[self._name] = self._seconds.get(self._name, 0.0) + spent


def _conserving(scene: Scene) -> tuple[Scene, tuple[str, ...]]:
    """The scene with no surface that reflects more than it receives, and what had to change."""
    materials = tuple(material.conserving() for material in scene.materials)
    warnings = tuple(
        f"material {old.name!r} reflects more than it receives: scaled down"
        for old, new in zip(scene.materials, materials, strict=True)
        if new is not old
    )
    return replace(scene, materials=materials), warnings


def _automatic_radius(settings: Settings, mesh: Mesh) -> float:
    """A first radius [scene units] that holds about PHOTONS_PER_DISC photons.

    From the diffuse area and the expected number of deposits, albedo / (1 - albedo) a photon.
    """
    albedo = min(max(mesh.albedo, 0.05), 0.9)
    expected = max(settings.photons, 1) * albedo / (1.0 - albedo)
    return math.sqrt(PHOTONS_PER_DISC * (mesh.area or 1.0) / (math.pi * expected))


def _warnings(scene: Scene, mesh: Mesh, needs: SceneNeeds) -> tuple[str, ...]:
    warnings = []
    if needs.hidden_highlights:
        warnings.append("direct light by photons: highlights of glossy surfaces are missing")
    if mesh.not_finite:
        warnings.append(f"{mesh.not_finite} triangles with NaN or infinite vertices were skipped")
    if mesh.degenerate:
        warnings.append(f"{mesh.degenerate} triangles of zero area were skipped")
    if not needs.surfaces:
        warnings.append("the scene has no triangles to render")
    if not scene.lights:
        warnings.append("the scene has no spotlight or point light")
    for light in scene.lights:
        if max(light.power) <= 0:
            warnings.append(f"light {light.name!r} has no power")
    return tuple(warnings)
