# SPDX-License-Identifier: GPL-3.0-or-later
"""What memory a render will take, told before any of it is taken.

The bytes below and those of backends/sizes.py were measured as peak resident sizes, or counted
(tests/unit/test_memory.py holds them to both). They are upper ends: a render takes half of its
estimate or more, once it is known how often photons land. What kept.py keeps beside has a limit of
its own, and makes room.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..streams import MOST_PARTS, TABLE_WIDTH
from .backends.backend import Backend
from .backends.sizes import FIXED, TEXEL, Bytes, PhotonCounts, Pool, free_host_memory
from .errors import PhotonStreamError, SceneError, SettingsError
from .eye.path import paths_together
from .film.denoise import FEWEST_FOR_TWO
from .film.strips import strips_of
from .kernels.records import LIGHT, LIGHT_NODE, LIGHT_PLACE, VOXEL
from .photons.mapper import pilot_photons
from .photons.native_photon_mapper import knows_lobes, leaves_lobes
from .scene import MOST_TRIANGLES, Scene
from .settings import Settings
from .stage.emission import MOST_OF_ONE, MOST_SHARES
from .stage.gathered import can_gather, gathering_kinds, seen_send_rays, send_rays
from .stage.layers import count_layered
from .stage.light_tables import is_seen
from .stage.light_tree import leaves_for
from .stage.media import MediaThere
from .stage.needs import MOST_LOBES
from .stage.panes import pane_of
from .stage.textures import advice, bytes_of

# A pixel's on the host: the images and the squared errors of its parts while a picture is made;
# and the images twice more, the last preview's in shared memory and what was asked for of them.
PICTURE = 96 + 40 + 2 * 96
PLAIN_LOBES = 2  # textures that say what Phong's lobes are
FEATURES = 3 * 24  # and of those of what denoisers go by
# Denoising's, in one way and in two: arrays, and what OpenImageDenoise takes, which works in tiles
# where that is more.
DENOISED, DENOISER, MOST_DENOISER = (220, 250), (520, 740), 3 << 30
STRIP = 500  # a strip's pixel's on the host: means and errors in float64
# Of what is left for more paths; what they may take where nobody knows what there is [bytes].
PART_OF_ROOM, ROOM_UNKNOWN = 4, 1 << 28
MOST_GUESSED = 4.0  # deposits a photon, before any was traced
TANGENTS = 3 * TEXEL  # and as much on the host

COLOURS = 3  # at most that a place in a volume has of what is lost, scattered and emitted, each
RGB_BYTES = 12  # of each on the host
_ADVICE = {
    "pixels": "lower the resolution or render a border region",
    "photons": "lower the photons a pass and render more passes",
    "triangles": "give the scene fewer triangles",
    "image pixels": "give the world a smaller image",
    "places in volumes": "give fewer objects volumes that differ from place to place",
}


def _of_lights(count: int, uneven: bool) -> int:
    """So many emissive triangles with their tree and places in it, and perhaps shares [bytes]; the
    host has twice that."""
    if not count:
        return 0
    leaves = leaves_for(count)
    places = LIGHT_PLACE.texels * max(count, leaves)
    shares = min(MOST_OF_ONE * count, MOST_SHARES) if uneven else 0
    return TEXEL * (LIGHT.texels * count + LIGHT_NODE.texels * 2 * leaves + places + shares)


@dataclass(frozen=True)
class Part:
    """What one number of a render takes [bytes]."""

    name: str  # of _ADVICE
    count: int
    size: Bytes
    advice: str = ""  # in place of that

    def refusal(self, text: str) -> PhotonStreamError:
        """The error that names what to lower."""
        kind = SettingsError if self.name in ("pixels", "photons") else SceneError
        return kind(f"{text}: {self.advice or _ADVICE[self.name]}")


class Budget:
    """A render's memory and what there is of it, looked up once, before anything is taken."""

    def __init__(self, scene: Scene, settings: Settings, backend: Backend) -> None:
        """Raises as `check`."""
        self._settings, self._device, self._sizes = settings, backend.device, backend.sizes
        self._triangles, self._emitters = len(scene.triangles), scene.emitters
        self._tangents = TANGENTS if len(scene.corner_tangents) else 0
        self._moving = sum(x.offsets.nbytes + x.normals.nbytes for x in scene.moving)
        self._instants = 2 if scene.moving else 1  # at once: a mesh is made of the last one
        self._image_pixels = sum(image.pixels.size // 3 for image in scene.images)
        self._textures = scene.textures
        grids = {medium.grid for medium in scene.media if medium.grid}
        grids |= {grid.beyond for grid in grids if grid.beyond}
        self._places = sum(grid.extinction.size // 3 for grid in grids)
        used = np.bincount(scene.material, minlength=len(scene.materials))
        emissive = np.array([material.is_emissive for material in scene.materials], bool)
        self._emissive = int(used[emissive].sum())
        self._uneven = any(material.emits_by_program for material in scene.materials)
        self._materials = [m for m, count in zip(scene.materials, used, strict=True) if count]
        self._is_transparent = any(material.is_transparent for material in self._materials)
        media = MediaThere.of(scene, self._materials)
        self._has_media, self._scatters, self._glows = media.any, media.scattering, media.glowing
        self._has_glass = any(map(pane_of, self._materials))  # which shadow rays may pass
        self._shares_memory = backend.shares_memory
        self._can_gather = can_gather(scene, settings, self._materials)
        self._seen_send_rays = seen_send_rays(scene, settings, self._materials)
        self._strip = strips_of(settings.frame_region, backend.strip_pixels)[0].size
        self._pools = backend.sizes.pools(free_host_memory())
        self._most_points = backend.strip_pixels
        still = backend.works_alone and not (scene.moving or scene.camera.motion)
        # Passes that are rendered together, and paths of theirs whose light is looked for together.
        self.passes, self.together, self._most_passes = 1, 1, MOST_PARTS if still else 1
        self.check()
        if backend.works_alone and self._has_chains:
            self.together = self._paths_together()

    def check(self, deposits: float | None = None) -> None:
        """Raise SettingsError or SceneError, naming what to lower, for what is too large here; and
        find how many passes there is room for together, no more than before.

        `deposits` a photon are known once some have been traced.
        """
        self._most_passes = self.passes = self._passes_together(deposits)
        parts = self.parts(deposits)
        self._check_textures(parts, deposits)
        for pool in self._pools:
            _check_pool(pool, {part: pool.taken(part.size) for part in parts})

    def _paths_together(self) -> int:
        """As many as fit in a part of what else the render leaves: they only save time."""
        spare, (width, height) = self.spare(self._deposits(None)), self._strip
        room = ROOM_UNKNOWN if spare is None else spare // PART_OF_ROOM
        more = room // (TEXEL * self.path_textures * width * height * self.passes)
        settings = self._settings
        bounces = settings.mirror_depth + settings.transparent_depth * self._is_transparent
        most = paths_together((width, height * self.passes))
        return min(1 + max(more, 0), 1 + bounces, most)

    def _passes_together(self, known: float | None) -> int:
        """Passes, likewise; by the deposits of a photon if they are known. Splats are drawn pass by
        pass. No more than half of all: those that are rendered first, somebody waits for."""
        settings, sizes = self._settings, self._sizes
        if settings.estimator == "splat" or self._most_passes == 1:
            return 1
        photons = max(1, settings.photons_a_pass * self._has_photons)
        landed = max(1, math.ceil(photons * self._deposits(known)))
        alone, two = (self.needed(known, passes) for passes in (1, 2))
        spare = self.spare(self._deposits(known), passes=1)
        room = ROOM_UNKNOWN if spare is None else max(spare, 0) // PART_OF_ROOM
        most = (
            self._most_points // self._pixels,
            self._device.texture_limit // self._strip[1],
            int(min(sizes.most_photons // photons, sizes.most_deposits(True) // landed)),
            1 + room // (two - alone),
            settings.passes // 2,
        )
        return max(1, min(self._most_passes, *most))

    def spare(self, deposits: float, passes: int | None = None) -> int | None:
        """What a render leaves of where its deposits are [bytes], with so many passes together;
        None: unknown."""
        pool = self._pools[-1]
        if pool.free is None:
            return None
        taken = sum(pool.taken(part.size) for part in self.parts(deposits, passes))
        return int(pool.free - pool.fixed - taken)

    def needed(self, deposits: float | None = None, passes: int | None = None) -> int:
        """All of it, wherever [bytes]; with so many passes together."""
        return FIXED + int(sum(sum(part.size) for part in self.parts(deposits, passes)))

    def parts(self, deposits: float | None = None, passes: int | None = None) -> tuple[Part, ...]:
        """What pixels, photons and triangles take; with so many passes together."""
        passes = self.passes if passes is None else passes
        settings, count, sizes = self._settings, self._pixels, self._sizes
        photons = settings.photons_a_pass if self._has_photons else 0
        counts = PhotonCounts(
            (passes * photons, photons, pilot_photons(settings)) if photons else (0,),
            self._deposits(deposits) * photons * passes,
            passes,
            settings.photon_bounces + 1,
            self._lobes > 0,
            (self._has_media or self._has_glass) + 2 * self._scatters,
            any(material.program or count_layered(material) for material in self._materials),
            settings.estimator == "splat",
        )
        strip, images = self._strip[0] * self._strip[1], self._image_pixels
        textures = self.strip_textures + self.going_on
        textures += (self.together - 1) * self.path_textures
        texels = self.film_textures * count + textures * strip * passes
        texels += sizes.waiting(count, strip)
        host = PICTURE * count + STRIP * strip + settings.caller_bytes
        host += FEATURES * count * self._has_features
        if settings.denoise:
            are_two = settings.passes >= FEWEST_FOR_TWO[False]  # a GPU's are in its own memory
            host += DENOISED[are_two] * count + min(DENOISER[are_two] * count, MOST_DENOISER)
        return (
            Part("pixels", count, Bytes(TEXEL * texels, host)),
            Part("photons", photons, sizes.photons(counts)),
            Part("triangles", self._triangles, self._of_triangles()),
            Part("image pixels", images, Bytes(TEXEL * images, TEXEL * images)),
            Part("places in volumes", self._places, self._of_places()),
            *self._of_textures(),
        )

    def _of_places(self) -> Bytes:
        """What they take, if media have a colour of their own at each, and each emits if any does;
        on the host once more where they are made."""
        fields = 2 + self._glows
        device = VOXEL.texels * TEXEL * COLOURS * fields * self._places
        return Bytes(device, device + fields * RGB_BYTES * self._places)

    def _of_textures(self) -> tuple[Part, ...]:
        """What they take; and on the host the largest once more, while it is sent."""
        if not self._textures:
            return ()
        size = bytes_of(self._textures)
        largest = max(texture.pixels.nbytes for texture in self._textures)
        named = advice(self._textures)
        return (Part("bytes of textures", size, Bytes(size, largest), named),)

    def _of_triangles(self) -> Bytes:
        """What they take, and the emissive ones besides."""
        found = self._sizes.triangles(self._triangles, self._tangents)
        lights = _of_lights(self._emissive, self._uneven)
        host = self._instants * (found.host + 2 * lights) + self._moving
        return Bytes(found.device + lights, host)

    @cached_property
    def film_textures(self) -> int:
        """How many textures there are for each pixel: a sum and its low part of each of film.py's
        images, and four of batches; natively there are arrays of as many bytes."""
        settings = self._settings
        images = 5 + 2 * self._has_chains + self._has_photons + self._has_emitters
        images += 2 * self._has_features + settings.caustics * (1 + self._has_chains)
        halves = 2 + self._has_chains + self._has_emitters
        images += halves * settings.denoise
        return 2 * (images + settings.illuminance + self._has_mist) + 4

    @cached_property
    def strip_textures(self) -> int:
        """How many there are of a strip's size: eye/path.py's and what films write to."""
        settings, sizes = self._settings, self._sizes
        count = 21 + 2 * self._lobes + sizes.film_spares + self._shadow_textures
        count += 3 * self._has_emitters + 3 * settings.illuminance + self._has_photons
        count += 2 * self._has_features + 3 * self._has_media + self._scatters + self._has_mist
        count += sizes.denoising_textures * settings.denoise
        if self._has_chains:
            count += 8 + 3 * self._has_photons
            count += (6 + 3 * self._has_mist) * self._is_transparent
            count += 6 * self._has_features + 2 * self._has_media
            count += any(material.scatters_below for material in self._materials)
        if self._has_photons:
            count += 3  # cuts, coverage and tilt
            count += settings.caustics * (4 + 3 * self._has_chains)
            count += 2 * (settings.estimator == "splat")  # radius, and a part of the splats
            if self._has_chains or settings.estimator != "splat":
                kinds = {lobe.kind for m in self._materials for lobe in m.lobes if lobe.reflects}
                is_phong = knows_lobes(self._lobes, kinds)
                native = PLAIN_LOBES if is_phong else 3 * self._lobes
                others = leaves_lobes(self._lobes, kinds, gathering_kinds(self._materials))
                count += sizes.gather_textures(self._gathers_lobes, native, others)
        return count

    @cached_property
    def path_textures(self) -> int:
        """How many of these one of its paths takes, where rays go on."""
        settings, lobes = self._settings, self._gathers_lobes
        count = 18 + 2 * self._lobes + 2 * lobes + 2 * self._has_emitters
        count += self._uneven  # whose nodes tell what is emitted
        count += 3 * self._has_photons + 2 * settings.illuminance + 3 * self._is_transparent
        count += 5 * self._has_media + self._scatters
        count += settings.caustics * self._has_photons * (1 + 2 * lobes)
        return count + any(material.scatters_below for material in self._materials)

    @cached_property
    def going_on(self) -> int:
        """How many of a strip's size the streams take together, at most, to which rays move that
        go on, and shadow rays behind transparent surfaces. The sums of what moved rays see
        (eye/moved_sums.py) are not counted apart."""
        if not (self._has_chains and self._shares_memory):
            return 0
        go_on = self._is_transparent or self._has_glass or self._has_media
        return self.strip_textures + 2 * self._shadow_textures * go_on

    @cached_property
    def _shadow_textures(self) -> int:
        if self._settings.direct_by_photons:
            return 0
        lights = len(self._emitters) + self._emissive
        more = self._has_glass + self._has_media
        return self._sizes.shadow_textures(lights, self._settings.illuminance, more)

    @cached_property
    def _has_chains(self) -> bool:
        sending = (send_rays(material, self._seen_send_rays) for material in self._materials)
        sends_rays = not self._gathers_lobes or any(sending) or self._scatters
        of_lobes = self._settings.mirror_depth > 0 and self._lobes > 0 and sends_rays
        return of_lobes or self._is_transparent

    @cached_property
    def _gathers_lobes(self) -> bool:
        return self._has_photons and self._can_gather

    @property
    def _has_features(self) -> bool:
        return self._settings.denoise or self._settings.denoising_data

    @property
    def _has_mist(self) -> bool:
        return self._settings.mist is not None

    @cached_property
    def _has_emitters(self) -> bool:
        """To be seen."""
        return self._emissive > 0 or self._glows or any(map(is_seen, self._emitters))

    @cached_property
    def _lobes(self) -> int:
        """That a visible point has at most."""
        counts = [sum(lobe.reflects for lobe in m.lobes) for m in self._materials]
        return min(max([*counts, int(self._scatters)]), MOST_LOBES)

    @cached_property
    def _has_photons(self) -> bool:
        lit = bool(self._emitters) or self._emissive > 0
        return lit and self._triangles > 0 and self._settings.photons_a_pass > 0

    @property
    def _pixels(self) -> int:
        x0, y0, x1, y1 = self._settings.frame_region
        return (x1 - x0) * (y1 - y0)

    def _deposits(self, known: float | None) -> float:
        """How often a photon lands; before it is known, as if all walls were the brightest."""
        if known is not None:
            return known
        gather = [m for m in self._materials if m.is_diffuse or self._can_gather]
        albedo = max(
            (np.minimum(m.conserving().head_on(), 1.0).mean() for m in gather), default=0.0
        )
        bounces = self._settings.photon_bounces
        several = float(np.sum(albedo ** np.arange(1, bounces + 1)))
        return min(several, MOST_GUESSED) + float(self._settings.direct_by_photons)

    def _check_textures(self, parts: Sequence[Part], deposits: float | None) -> None:
        """What no memory helps: the sides of textures, and the size of buffers."""
        limit, name = self._device.texture_limit, self._device.name
        pixels, photons, triangles, images, *_ = parts
        if max(self._strip) > limit:
            width, height = self._strip
            size = f"{width}x{height} pixels are more than {limit} a side"
            raise pixels.refusal(f"{size}, the most that {name} holds")
        landed = self._deposits(deposits) * photons.count
        most = self._sizes.most_deposits(is_known=deposits is not None)
        if photons.count > self._sizes.most_photons or landed > most:
            raise photons.refusal(f"{photons.count} photons a pass are more than {name} holds")
        if triangles.count > min(MOST_TRIANGLES, limit * TABLE_WIDTH // 4):
            raise triangles.refusal(f"{triangles.count} triangles are more than {name} holds")
        if images.count > limit * TABLE_WIDTH:
            raise images.refusal(f"{images.count} pixels are more than {name} holds")


def _check_pool(pool: Pool, sizes: Mapping[Part, float]) -> None:
    """Raise the error of the largest part if all of them are more than what is free."""
    needed = pool.fixed + sum(sizes.values())
    if pool.free is None or needed <= pool.free:
        return
    part = max(sizes, key=lambda part: sizes[part])
    raise part.refusal(
        f"the render needs about {_size(needed)} of {pool.name} and {_size(pool.free)} are free; "
        f"{_size(sizes[part])} of it are for {part.count} {part.name}"
    )


def _size(count: float) -> str:
    return f"{count / 1e9:.3g} GB"
