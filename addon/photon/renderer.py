# SPDX-License-Identifier: GPL-3.0-or-later
"""The renderer: passes in, images out. The frame reads like the paper."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np

from ..denoiser import DenoiserError
from ..streams import StreamError
from .backends.backend import Backend
from .errors import DeviceError
from .eye.eye import Eye
from .eye.images import PassImages
from .eye.instants import instant
from .eye.path import Path
from .film.error import Error
from .film.picture import CHANNELS, FEATURES, exposed
from .film.resolver import DenoisingResolver, Picture, Resolver, Telling
from .film.strips import StripFilm
from .phases import Phases
from .photons.photon_pass import Photons
from .scene import Scene
from .settings import Settings
from .stage.device_scene import DeviceScene
from .stage.needs import SceneNeeds
from .version import VERSION

NO_DEPTH = 1.0e10  # Blender's depth where nothing is seen
ALL_IMAGES = (*CHANNELS, "Error", "Depth")


@dataclass(frozen=True)
class Parts:
    """What a renderer renders with (prepare.py)."""

    backend: Backend
    device_scene: DeviceScene
    needs: SceneNeeds
    eye: Eye
    images: PassImages
    film: StripFilm
    resolver: Resolver
    denoised: DenoisingResolver | None
    photons: Photons | None
    passes_together: int  # at most
    phases: Phases
    own: list[Callable[[], None]]  # what releases them


class Renderer:
    """Renders a scene pass by pass; `prepare` makes one.

    Passes depend on (seed, index) alone; what they share is the film. Raises DeviceError when
    OpenGL fails.
    """

    def __init__(
        self, scene: Scene, settings: Settings, parts: Parts, warnings: tuple[str, ...]
    ) -> None:
        self.scene, self.settings, self.warnings = scene, settings, warnings
        self.backend, self.device, self.needs = parts.backend, parts.backend.device, parts.needs
        self._device_scene, self.frame = parts.device_scene, parts.device_scene.frame
        self.triangles = len(parts.device_scene.mesh.triangles)
        self.eye, self.film, self.photons = parts.eye, parts.film, parts.photons
        self._images, self._resolver, self._denoised = parts.images, parts.resolver, parts.denoised
        self._phases, self._own, self._most_together = (
            parts.phases,
            parts.own,
            parts.passes_together,
        )
        self._first_normals: list[moderngl.Buffer] = []  # and depths, of each strip: not read yet
        # Nothing seen, until the first pass; a mean over passes would mix objects.
        x0, y0, x1, y1 = settings.frame_region
        self._depth = np.full((y1 - y0, x1 - x0, 1), NO_DEPTH, np.float32)
        self._telling: tuple[int, Telling] | None = None  # the error, after so many passes

    def render_pass(self) -> None:
        """Add the next pass to the film."""
        self.render_passes(1)

    def render_passes(self, most: int) -> int:
        """Add the next passes to the film: as many as the device renders together, but no more than
        `most`; how many. Of a pass that is the same picture, to the bit, as by itself."""
        return self._render_next(len(self.passes_together(most)), most)

    def _render_next(self, count: int, most: int) -> int:
        """Render so many passes of as many as somebody asks for; the first one by itself, where
        there is no room for all."""
        count = min(count, self._most_together)
        self.device.use()
        first = self.settings.first_pass + self.film.passes
        try:
            with self._phases.timed("eye"):
                self._render(range(first, first + count), most)
            self.device.check()
        except StreamError as error:
            if count == 1 or len({film.passes for film in self.film.films}) > 1:
                raise DeviceError(str(error)) from error
            self._most_together = 1
            self.device.drop_spare()
            return self._render_next(1, most)
        return count

    def passes_together(self, most: int, after: int = 0) -> range:
        """The passes that are rendered next, or after so many more. A GPU waits less for few
        threads that take long where there are more others. No more than there are already: somebody
        waits for the first ones."""
        done = self.film.passes + after
        index = self.settings.first_pass + done
        passes = range(index, index + max(1, min(most, self._most_together, done)))
        return self.photons.started_alike(passes) if self.photons else passes

    def _render(self, passes: range, most: int) -> None:
        with self._phases.timed("bvh"):
            self._device_scene = self._device_scene.at(
                instant(self.settings, passes.start, self.scene.shutter)
            )
        photons = self.photons.start(passes) if self.photons else None  # launched, not awaited
        for number, strip in enumerate(self.film.strips):
            path: Path | None = self.eye.send(passes, strip.region)
            assert path
            image = self._images.begin(path)
            while path and path.alive:
                paths = self.eye.follow(path)
                self.eye.look(paths, photons)
                for each in paths:
                    image.add(each)
                path = self.eye.scatter(paths[-1])
                if path and self.photons and strip is self.film.strips[-1]:
                    # While the host waits for what is alive.
                    self.photons.prefetch(self._following(passes, most))
            images = image.finish()
            if self.film.passes == 0:
                self._first_normals.append(images["normal"].copy())
            self.film.add(number, images, len(passes))

    def _following(self, passes: range, most: int) -> range:
        """The passes after some, of as many as are asked for; none after the last one, and none
        where nobody knows yet how many will be rendered together."""
        if len(passes) == most > 1:
            return range(0)
        after = self.passes_together(most, len(passes))
        return range(after.start, min(after.stop, self.settings.first_pass + self.settings.passes))

    def images(self, wanted: Collection[str] | None = None, is_preview: bool = False) -> Picture:
        """The picture so far, of it what is wanted, or all; see `picture_of`. Depth (h, w, 1) [m]
        is of the first pass, Error (h, w, 1) [W/(m^2 sr)] is `Error.image`. Light is multiplied by
        the exposure. Where the settings want it Combined is denoised, but in previews."""
        wanted = ALL_IMAGES if wanted is None else wanted
        if not self.settings.denoising_data:
            wanted = [name for name in wanted if name not in FEATURES]
        self.device.use()
        images, telling = self._resolve(wanted, is_preview)
        self._telling = self.film.passes, telling
        if "Error" in wanted and (image := self.error().image) is not None:
            images["Error"] = image
        if self.settings.caustics and "Caustics" in wanted and "Caustics" not in images:
            images["Caustics"] = np.zeros((*self.film.shape, 3), np.float32)  # nothing casts any
        if self.settings.exposure != 1.0:
            images = exposed(images, self.settings.exposure)
        if "Depth" in wanted:
            self._read_depth()
            images["Depth"] = self._depth
        return images

    def _resolve(self, wanted: Collection[str], is_preview: bool) -> tuple[Picture, Telling]:
        """Picture and error; plain ones, and a warning, where denoising fails."""
        is_seen = not {"Combined", "Error"}.isdisjoint(wanted)
        if self._denoised and is_seen and not is_preview and self.film.passes:
            try:
                with self._phases.timed("denoise"):
                    return self._denoised.resolve(wanted)
            except DenoiserError as error:
                self.warnings += (f"not denoised: {error}",)
                self._denoised = None
        return self._resolver.resolve(wanted)

    def error(self) -> Error:
        """How far the picture so far is from the converged one: the denoised one, if that was last
        asked for."""
        if self._telling is None or self._telling[0] != self.film.passes:
            self.images(())
        assert self._telling
        self.device.use()
        return self._telling[1]()

    def radius(self, index: int) -> float:
        """The gather radius of pass `index`, typical of where photons fall [m]."""
        if not self.photons:
            return 0.0
        self.device.use()
        try:
            return self.photons.radius(index) * self.frame.scale
        except StreamError as error:
            raise DeviceError(str(error)) from error

    @property
    def estimator(self) -> str:
        """What sums photons up: "splat", "gather", or "none"."""
        return "none" if not self.photons else "splat" if self.photons.splat else "gather"

    @property
    def seconds(self) -> dict[str, float]:
        """By phase."""
        return self._phases.seconds

    def info(self) -> dict[str, Any]:
        """What the picture was made with, for metadata and reports, and the error, if anybody has
        looked."""
        error = self.error() if self._telling else None
        photons = self.settings.photons_a_pass if self.photons else 0
        return {
            "version": VERSION,
            "device": self.device.name,
            "driver": self.device.version,
            "backend": self.backend.name,
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
            "denoiser": self._denoised.by if self._denoised else "none",
            "unfinished_photons": self.photons.mapper.unfinished if self.photons else 0,
            "dropped_photons": self.photons.dropped if self.photons else 0,
            "seconds": {name: round(value, 4) for name, value in self.seconds.items()},
        }

    def launches(self) -> dict[str, int]:
        """How often each kernel has run."""
        counts = self.eye.launches() | self._images.launches()
        for stem, count in (self.photons.launches() if self.photons else {}).items():
            counts[stem] = counts.get(stem, 0) + count
        return counts

    def release(self) -> None:
        """Free everything on the device but the device, what is kept for the next renderer, and
        what that will use again."""
        self.device.use()
        self._let_go()
        self.device.end_render()
        self.device.trim()

    def _let_go(self) -> None:
        for release in reversed(self._own):
            release()
        self._own.clear()
        for normals in self._first_normals:
            self.device.put_back(normals)
        self._first_normals.clear()

    def _read_depth(self) -> None:
        """Read the first pass's depths along the view axis [m], if they are still on the device."""
        for strip, normals in zip(self.film.strips, self._first_normals, strict=False):
            shape = strip.height, self._depth.shape[1], 4
            texels = self.device.read(normals, math.prod(shape)).reshape(shape)
            depth = texels[..., 3:] * np.float32(self.frame.scale)
            self._depth[strip.rows] = np.where(depth > 0, depth, np.float32(NO_DEPTH))
            self.device.put_back(normals)
        self._first_normals.clear()
