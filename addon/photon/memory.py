# SPDX-License-Identifier: GPL-3.0-or-later
"""What memory a render will take, told before any of it is taken.

The bytes below were measured as peak resident sizes, or counted (tests/unit/test_memory.py holds
them to both). They are upper ends: a render takes half of its estimate or more, once it is known
how often photons land. What kept.py keeps beside has a limit of its own, and makes room.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from ..streams import TABLE_WIDTH, Device
from .errors import PhotonStreamError, SceneError, SettingsError
from .film.film import SPARE
from .film.strips import strips_of
from .photons.device_photon_mapper import landed_rows
from .photons.photon_mapper import STREAM_WIDTH, pilot_photons
from .scene import Scene
from .settings import Settings
from .stage.needs import MOST_LOBES
from .stage.tables import is_seen
from .ways.direct_light import RAYS_AT_ONCE

TEXEL = 16  # [bytes]
FIXED = 80 << 20  # programs, a grid of the smallest
# On a GPU: photon_grid.MAX_CELLS in two buffers, and the grids of device_radii.py.
GRIDS = (40 + 60) << 20
# A pixel's on the host: the images and the squared errors of its parts while a picture is made;
# and the images twice more, the last preview's in shared memory and what was asked for of them.
PICTURE = 96 + 40 + 2 * 96
STRIP = 500  # a strip's pixel's on the host: means and errors in float64
# A photon's: six textures of paths, three of a bounce's ends and four of shaded points, and two
# more of these if there are lobes; and all that have half the size of another (photon_mapper.py).
PATHS, LOBE_PATHS = 2 * 13 * TEXEL, 2 * 2 * TEXEL
RESIDENT_PATHS = 2 * 6 * TEXEL  # on a GPU with compute programs
RESIDENT_ROOM = 6 * TEXEL  # in the list: device_photon_mapper.GUESSED and some
DOWNLOADED = 2 * TEXEL  # where a bounce's photons have landed
LISTED = 136  # bytes a deposit, in lists and sorted
SORTED = 5 * (2 * TEXEL + 4) // 4  # in the lists that Gather reads: Device.buffer
RESIDENT_LISTED = 6 * TEXEL  # in textures a quarter longer, and those before that were too short
SPLATS = 512  # software OpenGL's vertices
MOST_GUESSED = 4.0  # deposits a photon, before any was traced
# A triangle's while its tree is built, on a soup of them; a grid of them takes four fifths.
BUILD, NATIVE_BUILD = 340, 520
TABLES, NATIVE_TABLES = 10 * TEXEL, 6 * TEXEL  # corners, normals and at worst a node
TANGENTS = 3 * TEXEL  # and as much on the host
MOST_TRIANGLES = (1 << 24) - 1  # float32 numbers them

_ADVICE = {
    "pixels": "lower the resolution or render a border region",
    "photons": "lower the photons a pass and render more passes",
    "triangles": "give the scene fewer triangles",
}


@dataclass(frozen=True)
class Part:
    """What one number of a render takes [bytes]."""

    name: str  # of _ADVICE
    count: int
    device: float  # in the GPU's memory, or what textures take where OpenGL is software
    host: float

    def refusal(self, text: str) -> PhotonStreamError:
        """The error that names what to lower."""
        kind = SceneError if self.name == "triangles" else SettingsError
        return kind(f"{text}: {_ADVICE[self.name]}")


class Budget:
    """A render's memory and what there is of it, looked up once, before anything is taken."""

    def __init__(self, scene: Scene, settings: Settings, device: Device, layer: str) -> None:
        """`layer`: "fragment", "compute" or "native". Raises as `check`."""
        self._settings, self._layer, self._device = settings, layer, device
        self._triangles, self._emitters = len(scene.triangles), scene.emitters
        self._tangents = TANGENTS if len(scene.corner_tangents) else 0
        used = np.bincount(scene.material, minlength=len(scene.materials))
        self._materials = [m for m, count in zip(scene.materials, used, strict=True) if count]
        self._strip = strips_of(settings.frame_region, device)[0].size
        self._resident = device.keeps_lists(layer)
        self.free_host = free_host_memory()
        self.free_device = None if device.is_software else device.free_memory()
        self.check()

    def check(self, deposits: float | None = None) -> None:
        """Raise SettingsError or SceneError, naming what to lower, for what is too large here.

        `deposits` a photon are known once some have been traced.
        """
        parts, name = self.parts(deposits), self._device.name
        self._check_textures(parts, deposits)
        if self._device.is_software:
            sizes = {part: part.device + part.host for part in parts}
            _compare("memory", self.free_host, sizes, FIXED)
        else:
            _compare("memory", self.free_host, {part: part.host for part in parts}, FIXED)
            sizes = {part: part.device for part in parts}
            _compare(f"memory on {name}", self.free_device, sizes, FIXED + GRIDS)

    def spare(self, deposits: float) -> int | None:
        """What a render leaves of where its deposits are [bytes]; None: unknown."""
        if self._device.is_software:
            return None if self.free_host is None else self.free_host - self.needed(deposits)
        if self.free_device is None:
            return None
        return int(self.free_device - FIXED - GRIDS - sum(p.device for p in self.parts(deposits)))

    def needed(self, deposits: float | None = None) -> int:
        """All of it, wherever [bytes]."""
        return FIXED + int(sum(part.device + part.host for part in self.parts(deposits)))

    def parts(self, deposits: float | None = None) -> tuple[Part, ...]:
        """What pixels, photons and triangles take."""
        settings, count = self._settings, self._pixels
        native, software = self._layer == "native", self._device.is_software
        photons = settings.photons_a_pass if self._has_photons else 0
        landed = self._deposits(deposits) * photons
        if native:
            photon_bytes = 0.0, LISTED * landed
        elif self._resident:
            sizes = {photons, pilot_photons(settings)} if photons else {0}
            most = settings.photon_bounces + 1
            rows = sum({landed_rows(number, most) for number in sizes})
            paths = RESIDENT_PATHS * sum(sizes) + 2 * TEXEL * STREAM_WIDTH * rows
            lists = RESIDENT_ROOM * photons + (RESIDENT_LISTED + SORTED) * landed
            photon_bytes = paths + lists, 0.0
        else:
            listed = DOWNLOADED * photons + LISTED * landed
            paths = PATHS + (LOBE_PATHS if self._lobes else 0)
            photon_bytes = paths * photons + SORTED * landed, listed
        if settings.estimator == "splat":
            photon_bytes = photon_bytes[0] + (SPLATS if software else 0) * landed, photon_bytes[1]
        tables = 0 if software else self._tangents + (NATIVE_TABLES if native else TABLES)
        build = self._tangents + (NATIVE_BUILD if native else BUILD)
        strip = self._strip[0] * self._strip[1]
        textures = self.film_textures * count + self.strip_textures * strip
        # The first pass's normals wait for the first look, and are read by way of a buffer of a
        # strip's size; natively that look takes more than they do.
        waiting = 0 if native else count + strip
        host = PICTURE * count + STRIP * strip + settings.caller_bytes
        return (
            Part("pixels", count, TEXEL * (textures + waiting), host),
            Part("photons", photons, *photon_bytes),
            Part("triangles", self._triangles, tables * self._triangles, build * self._triangles),
        )

    @cached_property
    def film_textures(self) -> int:
        """How many textures there are for each pixel: a sum and its low part of each of film.py's
        images, and four of batches; natively there are arrays of as many bytes."""
        return 2 * (5 + 2 * self._has_mirrors + self._has_photons + self._has_emitters) + 4

    @cached_property
    def strip_textures(self) -> int:
        """How many there are of a strip's size: ray_tracer.py's and what films write to."""
        settings, native = self._settings, self._layer == "native"
        count = 22 + 2 * self._lobes + (0 if native else SPARE)
        if native and not settings.direct_by_photons:
            count += 4 * min(len(self._emitters), RAYS_AT_ONCE)  # shadow rays
        count += 6 * self._has_mirrors + 3 * self._has_emitters
        if self._has_photons:
            count += 1 + settings.boundary_correction  # cuts and coverage
            count += settings.estimator == "splat"  # reach
            if not native and (self._has_mirrors or settings.estimator != "splat"):
                count += 2  # what Gather's launches add to where photons crowd
        return count

    @cached_property
    def _has_mirrors(self) -> bool:
        return self._settings.mirror_depth > 0 and self._lobes > 0

    @cached_property
    def _has_emitters(self) -> bool:
        """To be seen."""
        return any(map(is_seen, self._emitters))

    @cached_property
    def _lobes(self) -> int:
        """That a visible point has at most."""
        counts = (sum(lobe.reflects for lobe in m.lobes) for m in self._materials)
        return min(max(counts, default=0), MOST_LOBES)

    @cached_property
    def _has_photons(self) -> bool:
        return bool(self._emitters) and self._triangles > 0 and self._settings.photons_a_pass > 0

    @property
    def _pixels(self) -> int:
        x0, y0, x1, y1 = self._settings.frame_region
        return (x1 - x0) * (y1 - y0)

    def _deposits(self, known: float | None) -> float:
        """How often a photon lands; before it is known, as if all walls were the brightest."""
        if known is not None:
            return known
        diffuse = [m for m in self._materials if m.is_diffuse]
        albedo = max((np.mean(m.head_on()) for m in diffuse), default=0.0)
        bounces = self._settings.photon_bounces
        several = float(np.sum(albedo ** np.arange(1, bounces + 1)))
        return min(several, MOST_GUESSED) + float(self._settings.direct_by_photons)

    def _check_textures(self, parts: Sequence[Part], deposits: float | None) -> None:
        """What no memory helps: the sides of textures, and the size of buffers."""
        limit, name = self._device.texture_limit, self._device.name
        pixels, photons, triangles = parts
        if max(self._strip) > limit:
            width, height = self._strip
            size = f"{width}x{height} pixels are more than {limit} a side"
            raise pixels.refusal(f"{size}, the most that {name} holds")
        most = limit * TABLE_WIDTH
        landed = self._deposits(deposits) * photons.count
        if self._layer == "compute" and deposits is not None:
            most = min(most, self._device.buffer_limit // TEXEL)  # the lists that Gather reads
        if self._layer != "native" and (photons.count > limit * STREAM_WIDTH or landed > most):
            raise photons.refusal(f"{photons.count} photons a pass are more than {name} holds")
        if triangles.count > min(MOST_TRIANGLES, limit * TABLE_WIDTH // 4):
            raise triangles.refusal(f"{triangles.count} triangles are more than {name} holds")


def free_host_memory() -> int | None:
    """What the machine has left [bytes], or its control group if that is less; None: unknown."""
    try:
        lines = Path("/proc/meminfo").read_text().splitlines()
        fields = dict(line.split(":") for line in lines)
        free = 1024 * int(fields["MemAvailable"].split()[0])
    except (OSError, KeyError, ValueError):
        return None
    group = Path("/sys/fs/cgroup")
    try:
        stat = dict(line.split() for line in (group / "memory.stat").read_text().splitlines())
        limit, used = (int((group / f"memory.{x}").read_text()) for x in ("max", "current"))
        return min(free, limit - used + int(stat["inactive_file"]))  # files make room
    except (OSError, KeyError, ValueError):  # no group, or "max": no limit
        return free


def _compare(what: str, free: int | None, sizes: Mapping[Part, float], fixed: int) -> None:
    """Raise the error of the largest part if all of them are more than what is free."""
    needed = fixed + sum(sizes.values())
    if free is None or needed <= free:
        return
    part = max(sizes, key=lambda part: sizes[part])
    raise part.refusal(
        f"the render needs about {_size(needed)} of {what} and {_size(free)} are free; "
        f"{_size(sizes[part])} of it are for {part.count} {part.name}"
    )


def _size(count: float) -> str:
    return f"{count / 1e9:.3g} GB"
