# SPDX-License-Identifier: GPL-3.0-or-later
"""The renderer: Scene and Settings in, images out. The frame reads like the paper."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from typing import Any, Protocol

import moderngl
import numpy as np
from numpy.typing import NDArray

from ..streams import Device, Stream, StreamError
from ..streams.device import Layer, nothing
from .device_photon_mapper import DevicePhotonMapper
from .error import Error, error_of
from .errors import DeviceError, PhotonStreamError
from .geometry import Mesh
from .kept import Kept, Mapper, Stage
from .kinds import check_kinds
from .memory import Budget
from .native_photon_mapper import NativePhotonMapper, knows
from .needs import SceneNeeds
from .photon_grid import PhotonGrid
from .photon_mapper import PhotonMapper, pilot_photons
from .picture import FILM_IMAGES, MIRROR_IMAGES, picture_of
from .radius_field import Radii, RadiusField, grids_over, shrink_of
from .ray_tracer import RayTracer
from .scene import Scene
from .settings import Settings, filter_define
from .splat import Splat, View
from .strips import StripFilm, strips_of
from .version import VERSION

NO_DEPTH = 1.0e10  # Blender's depth where nothing is seen


def photons_per_disc(photons: int) -> float:
    """How many photons of a first pass a disc shall hold.

    The error after n passes of P photons depends on radius and n P alone, and radii shrink with
    (n P)^(-1/6); so P photons a pass want P^(2/3) a disc. Measured on cornell_classic: 150 is best
    of 64, 150 and 384 at P = 16384, 384 at 65536. More than 400 cost more time than they save.
    """
    return float(min(max(150.0 * (photons / 16384) ** (2 / 3), 16.0), 400.0))


def open_device(settings: Settings) -> Device:
    """The OpenGL device that the settings ask for; DeviceError says what is missing."""
    try:
        device = Device(settings.device_index)
        _choose_layer(settings, device)
    except StreamError as error:
        raise DeviceError(str(error)) from error
    return device


class Renderer:
    """Renders a scene pass by pass.

    Passes depend on (seed, index) alone; what they share is the film. Raises SceneError or
    SettingsError for what it cannot render, DeviceError when OpenGL fails.
    """

    def __init__(
        self, scene: Scene, settings: Settings, device: Device, kept: Kept | None = None
    ) -> None:
        """`kept`: where renders one after the other find what has not changed between them."""
        scene.check()
        check_kinds(scene)
        settings.check()
        scene, self.warnings = _conserving(scene)
        self.scene, self.settings, self.device = scene, settings, device
        self.seconds: dict[str, float] = {}  # by phase
        self._phase: str | None = None
        self._ticked = 0.0
        self._awaited: Radii | None = None  # of a pass whose photons are on their way
        self._dropped = 0  # deposits that were not finite, of the passes so far
        self._first_normals: list[moderngl.Buffer] = []  # and depths, of each strip: not read yet
        device.use()
        self.layer = _choose_layer(settings, device)
        layer: Layer = "compute" if self.layer == "compute" else "fragment"
        self.estimator = "none"
        self._kept = kept or Kept(device, budget=0)
        self._parts: list[_Part] = [self._kept] if kept is None else []  # to release
        self.budget = self._find_room()
        # Nothing seen, until the first pass; a mean over passes would mix objects.
        x0, y0, x1, y1 = settings.frame_region
        self._depth = np.full((y1 - y0, x1 - x0, 1), NO_DEPTH, np.float32)
        self._error: tuple[int, Error] | None = None  # after so many passes
        with self._timed("bvh"):
            try:
                stage = self._kept.stage(scene, self.layer)
            except StreamError as error:
                raise DeviceError(str(error)) from error
            self.frame, mesh, triangles = stage.frame, stage.mesh, stage.triangles
        self.triangles = len(mesh.triangles)
        self.needs = SceneNeeds.of(scene, settings, mesh)
        self.warnings += _warnings(scene, mesh, self.needs)
        with self._timed("programs"):
            try:
                self.photon_mapper: Mapper | None = None
                if self.needs.photons:
                    self.photon_mapper = self._mapper(layer, stage)
                    self._parts.append(self.photon_mapper)
                    self._start_pilot()
                strips = strips_of(settings.frame_region, device)
                self.ray_tracer = RayTracer(
                    device,
                    layer,
                    stage.tables,
                    self.frame,
                    scene,
                    settings,
                    self.needs,
                    triangles,
                    strips[0].region,
                )
                self._parts.append(self.ray_tracer)
                names = list(FILM_IMAGES)
                names += MIRROR_IMAGES if self.needs.secondary_rays else ()
                names += ["blur"] if self.needs.photons else ()
                self.film = StripFilm(device, layer, strips, names, on_host=triangles is not None)
                self._parts.append(self.film)
                self.splat = self.grid = None
                if self.needs.photons:
                    self.estimator = (
                        "gather" if settings.estimator == "auto" else settings.estimator
                    )
                    if self.estimator == "splat":
                        self.splat = Splat(
                            device, layer, settings.splat_shape, filter_define(settings)
                        )
                        self._parts.append(self.splat)
                    if self.estimator == "gather" or self.needs.secondary_rays:
                        kinds = [False] * (self.estimator == "gather") + [
                            True
                        ] * self.needs.secondary_rays
                        on_host = triangles is not None
                        self.grid = PhotonGrid(
                            device, layer, settings, mesh.extent, mesh.area, on_host, kinds
                        )
                        self._parts.append(self.grid)
                self._start_first_pass(mesh)
            except StreamError as error:
                self.release()
                raise DeviceError(str(error)) from error
            except PhotonStreamError:
                self.release()
                raise

    def radius(self, index: int) -> float:
        """The gather radius of pass `index`, typical of where photons fall [m]."""
        if not self.photon_mapper:
            return 0.0
        self.device.use()
        shrink = shrink_of(self.settings.radius_shrink, index)
        try:
            return self._radius_field.of_pass(shrink).typical * self.frame.scale
        except StreamError as error:
            raise DeviceError(str(error)) from error

    def render_pass(self) -> None:
        """Add the next pass to the film."""
        index = self.settings.first_pass + self.film.passes
        self.device.use()
        try:
            radii = self._radius_field.of_pass(shrink_of(self.settings.radius_shrink, index))
            if self.photon_mapper:
                self._start_photons(index)
                self._awaited = radii
            with self._timed("eye"):
                estimate = self._estimate if self.photon_mapper else None
                for number, strip in enumerate(self.film.strips):
                    # Splats read a pass's deposits in every strip.
                    is_last = number == len(self.film.strips) - 1
                    meanwhile = partial(self._start_early, index + 1) if is_last else nothing
                    images = self.ray_tracer.trace(index, strip.region, estimate, radii, meanwhile)
                    if self.film.passes == 0:
                        self._first_normals.append(images["normal"].copy())
                    self.film.add(number, images)
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
        photons = self.settings.photons_a_pass if self.photon_mapper else 0
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
            "dropped_photons": self._dropped,
            "seconds": {name: round(value, 4) for name, value in self.seconds.items()},
        }

    def launches(self) -> dict[str, int]:
        """How often each kernel has run."""
        counts: dict[str, int] = {}
        for kernel in self.ray_tracer.kernels.values():
            counts[kernel.stem] = counts.get(kernel.stem, 0) + kernel.launches
        if self.photon_mapper:
            for stem, count in self.photon_mapper.launches().items():
                counts[stem] = counts.get(stem, 0) + count
        if self.grid:
            counts["gather"] = self.grid.launches
        if self.splat:
            counts |= self.splat.launches()
        return counts

    def release(self) -> None:
        """Free everything on the device but the device, what is kept for the next renderer, and
        what that will use again."""
        self.device.use()
        for part in self._parts:
            part.release()
        self._parts.clear()
        for normals in self._first_normals:
            self.device.put_back(normals)
        self._first_normals.clear()
        self.device.end_render()
        self.device.trim()

    @contextmanager
    def _timed(self, phase: str) -> Iterator[None]:
        """Counts a block's seconds as the phase's, and not as those of the phase around it."""
        around, self._phase = self._phase, phase
        self._tick(around)
        try:
            yield
        finally:
            self._tick(phase)
            self._phase = around

    def _tick(self, phase: str | None) -> None:
        """Count the seconds since the last tick."""
        now = time.perf_counter()
        if phase:
            self.seconds[phase] = self.seconds.get(phase, 0.0) + now - self._ticked
        self._ticked = now

    def _mapper(self, layer: Layer, stage: Stage) -> Mapper:
        if stage.triangles and knows(self.scene, self.needs):
            return NativePhotonMapper(
                self.device,
                self.scene,
                stage.tables,
                stage.mesh,
                self.settings,
                self.needs,
                stage.triangles,
            )
        arguments = stage.tables, self.settings, self.needs
        if self.device.keeps_lists(layer):
            return DevicePhotonMapper(self.device, *arguments)
        return PhotonMapper(self.device, layer, *arguments, stage.triangles)

    def _find_room(self) -> Budget:
        """The budget; what only makes a render start sooner goes where there is no room for it."""
        for make_room in (self.device.drop_spare, self._kept.release):
            try:
                return Budget(self.scene, self.settings, self.device, self.layer)
            except PhotonStreamError:
                make_room()
        return Budget(self.scene, self.settings, self.device, self.layer)

    def _start_pilot(self) -> None:
        """Launch the photons that tell the radii: a GPU traces them while the rest is made."""
        if self._has_pilot:
            assert self.photon_mapper
            photons = pilot_photons(self.settings)
            with self._timed("radius"):
                self._kept.start(self.photon_mapper, self.settings, 0, photons)

    def _start_first_pass(self, mesh: Mesh) -> None:
        """Launch its eye rays, which a GPU traces while the host waits for the pilot; its radii."""
        with self._timed("eye"):
            self.ray_tracer.start(self.settings.first_pass, self.film.strips[0].region)
        with self._timed("radius"):
            self._radius_field = self._find_radii(mesh)
            self._parts.append(self._radius_field)

    @property
    def _has_pilot(self) -> bool:
        """Whether photons tell the radii."""
        return bool(self.photon_mapper) and not self.settings.radius

    def _find_radii(self, mesh: Mesh) -> RadiusField:
        """The user's radius everywhere, or radii by where pass 0's photons fall."""
        if not self._has_pilot:
            return RadiusField.even(self.device, (self.settings.radius or 1.0) / self.frame.scale)
        assert self.photon_mapper
        photons_a_pass, photons = self.settings.photons_a_pass, pilot_photons(self.settings)
        deposits = self._kept.finish(self.photon_mapper)
        grids = grids_over(self.device, deposits)  # a GPU looks while the host looks for room
        landed = deposits.count / photons
        try:
            self.budget.check(landed)
        except PhotonStreamError:
            self._kept.forget_photons()  # there may be room without them
            self.budget = Budget(self.scene, self.settings, self.device, self.layer)
            self.budget.check(landed)
        self.photon_mapper.unfinished = deposits.dropped = 0
        times = photons_a_pass / photons
        wanted = photons_per_disc(photons_a_pass) / times
        pixel, eye = self.ray_tracer.footprint()
        field = RadiusField.by_density(
            self.device, deposits, grids, wanted, times, mesh.area, pixel, eye
        )
        self._kept.leave_room(self.budget.spare(landed))  # while a GPU makes them
        return field

    def _look(self) -> dict[str, NDArray[np.float32]]:
        """Make picture and error of what the film holds."""
        self.device.use()
        self._read_depth()
        film = self.film
        # Strip after strip, and each read twice: what is made of them takes more than they do.
        few = [*film.exposures()] if len(film.strips) == 1 else None
        images: dict[str, NDArray[np.float32]] = {}
        for strip, exposure in zip(film.strips, few or film.exposures(), strict=True):
            for name, image in picture_of(exposure.means).items():
                if name not in images:
                    images[name] = np.empty((*self._depth.shape[:2], image.shape[2]), np.float32)
                images[name][strip.rows] = image
        self._error = film.passes, error_of(few or film.exposures(), images["Combined"])
        return images

    def _read_depth(self) -> None:
        """Read the first pass's depths along the view axis [m], if they are still on the device."""
        for strip, normals in zip(self.film.strips, self._first_normals, strict=False):
            shape = strip.height, self._depth.shape[1], 4
            texels = self.device.read(normals, math.prod(shape)).reshape(shape)
            depth = texels[..., 3:] * np.float32(self.frame.scale)
            self._depth[strip.rows] = np.where(depth > 0, depth, np.float32(NO_DEPTH))
            self.device.put_back(normals)
        self._first_normals.clear()

    def _start_photons(self, index: int) -> None:
        """Launch a pass's photons. A GPU traces them while the host launches what needs none."""
        assert self.photon_mapper
        with self._timed("photons"):
            self._kept.start(self.photon_mapper, self.settings, index)

    def _start_early(self, index: int) -> None:
        """Launch the photons of the next pass, if there is one, before the host waits for this
        one's rays: a GPU has them to trace meanwhile."""
        is_wanted = index < self.settings.first_pass + self.settings.passes
        if is_wanted and isinstance(self.photon_mapper, DevicePhotonMapper):
            self._start_photons(index)

    def _finish_photons(self) -> None:
        """Prepare the estimators for the photons that were launched."""
        assert self.photon_mapper and self._awaited
        with self._timed("photons"):
            deposits = self._kept.finish(self.photon_mapper)
            self._dropped = deposits.dropped
        with self._timed("photon map"):
            for estimator in (self.splat, self.grid):
                if estimator:
                    estimator.prepare(deposits, self._awaited)
        self._awaited = None

    def _estimate(
        self, place: Stream, facing: Stream, cuts: Stream, irradiance: Stream, view: View | None
    ) -> None:
        """Splat what the camera sees directly, if asked to; gather the rest."""
        if self._awaited:
            self._finish_photons()
        if self.splat and view:
            self.splat.estimate(place, facing, cuts, irradiance, view)
        else:
            assert self.grid
            zeros = self.ray_tracer.zeros
            self.grid.estimate(place, facing, cuts, irradiance, zeros, in_chain=view is None)


def _choose_layer(settings: Settings, device: Device) -> str:
    """What runs the kernels: "fragment", "compute", or "native".

    Native is fragment programs, and the native core for the kernels that trace and gather.
    Measured: on software OpenGL that takes a fifth of the time of fragment programs alone
    (cornell_box, 512x512, 262144 photons).
    """
    if settings.layer == "native" or (settings.layer == "auto" and device.is_software):
        return "native"
    return device.choose_layer(settings.layer)


class _Part(Protocol):
    def release(self) -> None: ...


def _conserving(scene: Scene) -> tuple[Scene, tuple[str, ...]]:
    """The scene with no surface that reflects more than it receives, and what had to change."""
    materials = tuple(material.conserving() for material in scene.materials)
    warnings = tuple(
        f"material {old.name!r} reflects more than it receives: scaled down"
        for old, new in zip(scene.materials, materials, strict=True)
        if new is not old
    )
    return replace(scene, materials=materials), warnings


def _warnings(scene: Scene, mesh: Mesh, needs: SceneNeeds) -> tuple[str, ...]:
    warnings = []
    if needs.hidden_highlights:
        warnings.append("direct light by photons: highlights of glossy surfaces are missing")
    if mesh.tree.not_finite:
        warnings.append(
            f"{mesh.tree.not_finite} triangles with NaN or infinite vertices were skipped"
        )
    if mesh.tree.degenerate:
        warnings.append(f"{mesh.tree.degenerate} triangles of zero area were skipped")
    if not needs.surfaces:
        warnings.append("the scene has no triangles to render")
    if not scene.lights:
        warnings.append("the scene has no spotlight or point light")
    for light in scene.lights:
        if max(light.power) <= 0:
            warnings.append(f"light {light.name!r} has no power")
    return tuple(warnings)
