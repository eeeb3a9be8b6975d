# SPDX-License-Identifier: GPL-3.0-or-later
"""What a render needs, made and launched before its first pass."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from itertools import chain

import numpy as np

from ..denoiser import ABSENT, find
from ..streams import Device, StreamError
from .backends.backend import Backend, backend_of
from .errors import DeviceError, PhotonStreamError
from .eye.eye import Eye
from .eye.images import PassImages, film_images
from .eye.instants import instant
from .eye.path import Path
from .film.picture import halved_images
from .film.strips import StripFilm, strips_of
from .memory import Budget
from .phases import Phases
from .photons.aim import Aiming
from .photons.deposits import Deposits
from .photons.kept import Kept
from .photons.landed import mean_flux
from .photons.mapper import Mapper, pilot_photons
from .photons.photon_grid import Gathering
from .photons.photon_pass import Photons
from .photons.radius_field import RadiusField, limits_by
from .photons.splats import Splats
from .photons.view import EYE_RAYS_A_SIDE, View
from .renderer import Parts, Renderer
from .scene import Scene
from .scene.takes import takes_of
from .settings import Settings, filter_define
from .stage.device_scene import DeviceScene
from .stage.find_needs import find_needs
from .stage.geometry import Mesh
from .stage.kinds import check_kinds
from .stage.needs import SceneNeeds
from .stage.textures import check_textures
from .takes_renderer import TakesRenderer, settings_of


def prepare(scene: Scene, settings: Settings, device: Device, kept: Kept | None = None) -> Renderer:
    """A renderer of a scene, or of all its takes, whose first photons and eye rays are on their
    way.

    `kept`: where renders one after the other find what has not changed between them. Raises
    SceneError or SettingsError for what cannot be rendered, DeviceError when OpenGL fails.
    """
    scene.check()
    check_kinds(scene)
    check_textures(scene)
    settings.check()
    scene, warnings = _clamped(scene)
    if settings.denoise and not find():
        settings = replace(settings, denoise=False)
        warnings = (*warnings, f"not denoised: {ABSENT}")
    device.use()
    keeps = kept or Kept(device, budget=0)
    scene = keeps.worked_out(scene, settings.width, backend_of(settings, device))
    if not kept:
        keeps.release()
    takes = takes_of(scene, settings.transparent)
    if kept:
        kept.limit(len(takes) - 1)
    made: list[Parts] = []
    for number, take in enumerate(takes):
        own = settings_of(take, settings)
        its_own = kept.beside(number) if kept else None
        one = _Preparation(take.scene, own, backend_of(own, device), its_own)
        with one.undone(made):
            made.append(one.parts())
        warnings = (*warnings, *(x for x in one.warnings if x not in warnings))
    if takes[0].scene is scene:
        return Renderer(scene, settings, made[0], warnings)
    return TakesRenderer(scene, settings, takes, made, warnings)


def photons_per_disc(photons: int) -> float:
    """How many photons of a first pass a disc shall hold.

    The error after n passes of P photons depends on radius and n P alone, and radii decay with
    (n P)^(-1/6); so P photons a pass want P^(2/3) a disc. More than 400 cost more time than
    they save.
    """
    return float(min(max(150.0 * (photons / 16384) ** (2 / 3), 4.0), 400.0))


def photons_wanted(deposits: Deposits, photons: int, photons_a_pass: int) -> float:
    """How many a disc shall hold of a pass, by the deposits of so many photons.

    Where most photons leave the scene, P are those that do not. If their fluxes are unequal, noise
    is that of n = (sum f)^2 / sum f^2 equal ones, and radii go with n^(-1/6). A device is asked
    for them where less than half land.
    """
    most, landed = photons_per_disc(photons_a_pass), deposits.count
    if 2 * landed >= photons or not landed:
        return most
    flux = mean_flux(deposits.fluxes())
    squares = float((flux**2).sum())
    equal = flux.sum() ** 2 / squares if squares > 0.0 else landed
    wanted = photons_per_disc(round(landed / photons * photons_a_pass))
    return float(min(wanted * (landed / equal) ** (1.0 / 3.0), most))


class _Preparation:
    """The steps, and what is to be undone if one fails."""

    def __init__(
        self, scene: Scene, settings: Settings, backend: Backend, kept: Kept | None
    ) -> None:
        self._scene, self._settings, self._backend = scene, settings, backend
        self._device, self._phases = backend.device, Phases()
        self._kept = kept or Kept(backend.device, budget=0)
        self._own: list[Callable[[], None]] = [] if kept else [self._kept.release]
        self._own.append(self._forget)
        self.warnings: tuple[str, ...] = ()
        self._aiming: Aiming | None = None

    def _forget(self) -> None:
        """Let go of what looks and finds by this: with it, a scene would stay until garbage is
        collected."""
        self._aiming = None

    @contextmanager
    def undone(self, others: Sequence[Parts]) -> Iterator[None]:
        """Release what was made if something fails, of other takes too, with one error for all that
        OpenGL says."""
        try:
            yield
        except BaseException as error:
            self._device.use()
            for release in chain(reversed(self._own), *(reversed(parts.own) for parts in others)):
                release()
            self._device.end_render()
            self._device.trim()
            if isinstance(error, StreamError):
                raise DeviceError(str(error)) from error
            raise

    def parts(self) -> Parts:
        """Make them, all programs first: a GPU's driver has threads that link them. Eye rays fly
        while the host waits for the photons that tell the radii."""
        settings, backend = self._settings, self._backend
        budget = self._find_room()
        with self._phases.timed("bvh"):
            device_scene = self._kept.device_scene(self._scene, backend)
            device_scene = device_scene.at(instant(settings, 0, self._scene.shutter))
        tables, mesh = device_scene.tables, device_scene.mesh
        needs = find_needs(self._scene, settings, mesh, tables.emitters, tables.asked)
        self.warnings = _warnings(self._scene, settings, mesh, needs)
        # Elsewhere a thread gains nothing, and takes none of the memory that others have freed.
        if backend.works_alone and needs.photons and settings.boundary_correction:
            mesh.find_faces()
        with self._phases.timed("programs"):
            mapper = self._mapper(device_scene, needs) if needs.photons else None
            strips = strips_of(settings.frame_region, backend.strip_pixels)
            seen = self._scene, settings, needs, strips[0].size, budget.together, budget.passes
            eye = Eye(backend, tables, device_scene.frame, *seen)
            self._own.append(eye.release)
            eye.prepare()
            tables.footprint = eye.footprint
            images = PassImages(backend, tables, settings, needs, eye)
            self._own.append(images.release)
            names = film_images(needs)
            halved = halved_images(names, needs.noisy_emission) if settings.denoise else []
            film = StripFilm(backend, strips, names, halved)
            self._own.append(film.release)
            film.prepare()
            resolver = backend.resolver(film, names)
            self._own.append(resolver.release)
            denoised = None
            if settings.denoise:
                given = film, resolver, self._kept.opened(), needs.noisy_features
                denoised = backend.denoising_resolver(*given)
                self._own.append(denoised.release)
            estimators = self._estimators(device_scene, needs) if mapper else None
            if mapper:
                self._start_pilot(mapper, device_scene, needs, eye)
            if not device_scene.movement or settings.first_pass == 0:  # else it is another instant
                with self._phases.timed("eye"):
                    eye.send_ahead(settings.first_pass, strips[0].region)
            photons = None
            if mapper and estimators:
                photons = self._photons(mapper, *estimators, device_scene, eye, budget)
        made = eye, images, film, resolver, denoised, photons
        return Parts(backend, device_scene, needs, *made, budget.passes, self._phases, self._own)

    def _find_room(self) -> Budget:
        """The budget; what only makes a render start sooner goes where there is no room for it."""
        arguments = self._scene, self._settings, self._backend
        for make_room in (self._device.drop_spare, self._kept.release):
            try:
                return Budget(*arguments)
            except PhotonStreamError:
                make_room()
        return Budget(*arguments)

    def _mapper(self, device_scene: DeviceScene, needs: SceneNeeds) -> Mapper:
        """What traces photons."""
        mapper = self._backend.photon_mapper(device_scene, self._settings, needs)
        self._own.append(mapper.release)
        return mapper

    def _estimators(
        self, device_scene: DeviceScene, needs: SceneNeeds
    ) -> tuple[Splats | None, Gathering | None, Gathering | None]:
        """What sums photons up, where the eye's own rays end and where others do; and those that
        are told apart."""
        backend, settings = self._backend, self._settings
        splat = grid = caustics = None
        if settings.estimator == "splat" and needs.projects:
            define = filter_define(settings)
            splat = Splats(self._device, backend.layer, settings.splat_shape, define)
            self._own.append(splat.release)
        if not splat or needs.secondary_rays:
            kinds = [False] * (not splat) + [True] * needs.secondary_rays
            grid = backend.photon_grid(device_scene.mesh, settings, needs, kinds)
            self._own.append(grid.release)
        if needs.caustics:
            kinds = [False] + [True] * needs.secondary_rays
            caustics = backend.photon_grid(device_scene.mesh, settings, needs, kinds)
            self._own.append(caustics.release)
        return splat, grid, caustics

    def _start_pilot(
        self, mapper: Mapper, device_scene: DeviceScene, needs: SceneNeeds, eye: Eye
    ) -> None:
        """Send the photons that tell where others shall start, and, unless the user has set it,
        the radius."""
        look = partial(self._look, device_scene, needs)
        moves = device_scene.movement is not None  # passes learn at the instant of pass 0
        _, place = eye.camera.footprint()
        self._aiming = Aiming(
            mapper,
            device_scene.tables,
            self._settings.seed,
            look,
            device_scene.mesh,
            at_once=moves,
            eye=place,
            direct_by_photons=self._settings.direct_by_photons,
        )
        with self._phases.timed("aim"):
            self._aiming.set(0)
        if not self._settings.radius:
            with self._phases.timed("radius"):
                self._kept.start(mapper, self._settings, 0, pilot_photons(self._settings))

    def _look(self, device_scene: DeviceScene, needs: SceneNeeds) -> View:
        """What the picture shows, in mirrors too."""
        region = (0, 0, EYE_RAYS_A_SIDE, EYE_RAYS_A_SIDE)
        settings = replace(
            self._settings, width=EYE_RAYS_A_SIDE, height=EYE_RAYS_A_SIDE, region=None, first_pass=0
        )
        bare = replace(
            needs,
            shadow_rays=0,
            emitters_seen=False,
            photons=False,
            illuminance=False,
            caustics=False,
        )
        tables, frame, scene = device_scene.tables, device_scene.frame, self._scene
        eye = Eye(self._backend, tables, frame, scene, settings, bare, region[2:])
        eye.prepare()
        found = []
        path: Path | None = eye.send(range(1), region)
        while path and path.alive:
            eye.shade(path)
            found.append(eye.gathering(path))
            path = eye.scatter(path)
        view = View(*eye.camera.footprint(), *map(np.concatenate, zip(*found, strict=True)))
        eye.release()
        return view

    def _photons(
        self,
        mapper: Mapper,
        splat: Splats | None,
        grid: Gathering | None,
        caustics: Gathering | None,
        device_scene: DeviceScene,
        eye: Eye,
        budget: Budget,
    ) -> Photons:
        backend, settings = self._backend, self._settings
        with self._phases.timed("radius"):
            if settings.radius:
                radius = settings.radius / device_scene.frame.scale
                field = RadiusField.even(self._device, radius, settings.photons_a_pass)
            else:
                field = self._find_radii(mapper, device_scene.mesh, eye, budget)
        find = partial(self._find_again, mapper, device_scene.mesh, eye)
        ahead = backend.works_alone and not device_scene.movement
        phases, aiming = self._phases, self._aiming
        assert aiming
        photons = Photons(
            mapper,
            self._kept,
            settings,
            field,
            splat,
            grid,
            caustics,
            ahead,
            phases,
            aiming,
            find,
            backend.sizes.most_deposits(is_known=True),
        )
        self._own.append(photons.release_field)
        return photons

    def _find_again(self, mapper: Mapper, mesh: Mesh, eye: Eye) -> RadiusField | None:
        """Radii by photons of pass 0 as they start now; None: the user has set it."""
        if self._settings.radius:
            return None
        before = mapper.unfinished, mapper.deposits.dropped
        self._kept.start(mapper, self._settings, 0, pilot_photons(self._settings))
        budget = Budget(self._scene, self._settings, self._backend)
        field = self._find_radii(mapper, mesh, eye, budget)
        mapper.unfinished, mapper.deposits.dropped = before
        return field

    def _find_radii(self, mapper: Mapper, mesh: Mesh, eye: Eye, budget: Budget) -> RadiusField:
        """Radii by where pass 0's photons fall."""
        photons_a_pass, photons = self._settings.photons_a_pass, pilot_photons(self._settings)
        deposits = self._kept.finish(mapper)
        if self._aiming and self._aiming.is_missed(deposits.count / photons):
            with self._phases.timed("aim"):
                self._aiming.set(0)
            self._kept.start(mapper, self._settings, 0, photons)
            deposits = self._kept.finish(mapper)
        focus = self._aiming.focus if self._aiming else None
        grids = self._backend.radius_grids(
            deposits, focus
        )  # a GPU looks while the host looks for room
        landed = deposits.count / photons
        try:
            budget.check(landed)
        except PhotonStreamError:
            self._kept.forget_photons()  # there may be room without them
            budget = Budget(self._scene, self._settings, self._backend)
            budget.check(landed)
        mapper.unfinished = deposits.dropped = 0
        times = photons_a_pass / photons
        wanted = photons_wanted(deposits, photons, photons_a_pass) / times
        pixel, place = eye.camera.footprint()
        sides, box = grids()
        area = min(mesh.area, box)
        limits = limits_by(wanted, times, deposits.count, area, pixel, place)
        radii = self._backend.radii(deposits, sides, limits)
        field = RadiusField(radii, landed * photons_a_pass)
        self._kept.leave_room(budget.spare(landed))  # while a GPU makes them
        return field


def _clamped(scene: Scene) -> tuple[Scene, tuple[str, ...]]:
    """The scene with no lobe that reflects more than it receives by itself; the materials of which
    some do, or all of their lobes together."""
    warnings = tuple(
        f"material {material.name!r} reflects more than it receives: each lobe is clamped to 1, and"
        " no photon gains by all"
        for material in scene.materials
        if material.is_too_bright
    )
    materials = tuple(x.clamped() if x.may_be_too_bright else x for x in scene.materials)
    changed = any(one is not other for one, other in zip(materials, scene.materials, strict=True))
    return replace(scene, materials=materials) if changed else scene, warnings


def _warnings(scene: Scene, settings: Settings, mesh: Mesh, needs: SceneNeeds) -> tuple[str, ...]:
    warnings = []
    if settings.estimator == "splat" and not needs.projects:
        what = "depth of field" if scene.camera.lens else "panoramas"
        warnings.append(f"photons are gathered: splats know no {what}")
    if needs.hidden_highlights:
        what = " and light in media" * needs.scattering
        warnings.append(f"direct light by photons: highlights of glossy surfaces{what} are missing")
    if mesh.tree.not_finite:
        warnings.append(
            f"{mesh.tree.not_finite} triangles with NaN or infinite vertices were skipped"
        )
    if mesh.tree.degenerate:
        warnings.append(f"{mesh.tree.degenerate} triangles of zero area were skipped")
    if not needs.surfaces:
        warnings.append("the scene has no triangles to render")
    if not scene.lights and not needs.emissive:
        warnings.append("the scene has no light")
    for light in scene.lights:
        if max(light.power) <= 0:
            warnings.append(f"light {light.name!r} has no power")
    return tuple(warnings)
