# SPDX-License-Identifier: GPL-3.0-or-later
"""What memory each backend takes [bytes], and where: measured as peak resident sizes, or counted
(tests/unit/test_memory.py holds them to both)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from ...streams import TABLE_WIDTH, Device
from ...streams.device import Layer
from ..film.device_denoising import STREAMS
from ..film.film import SPARE
from ..photons.bounces import landed_rows
from ..photons.paths import STREAM_WIDTH

TEXEL = 16
FIXED = 88 << 20  # programs, a grid of the smallest
# On a GPU: photon_grid.MAX_CELLS in two buffers, and the grids of device_radii.py.
CELLS = 40 << 20
GRIDS = CELLS + (60 << 20)
# A photon's: six textures of paths, three of a bounce's ends and four of shaded points, and two
# more of these if there are lobes; and all that have half the size of another (photon_mapper.py).
PATHS, LOBE_PATHS = 2 * 13 * TEXEL, 2 * 2 * TEXEL
MEDIA = 2 * 2 * TEXEL  # a pair of streams that tell what it is in, likewise
RESIDENT_PATHS = 2 * 6 * TEXEL  # on a GPU with compute programs
RESIDENT_ROOM = 6 * TEXEL  # in the list: device_photon_mapper.GUESSED and some
DOWNLOADED = 2 * TEXEL  # where a bounce's photons have landed
LISTED = 136  # bytes a deposit, in lists and sorted
SORTED = 5 * (2 * TEXEL + 4) // 4  # in the lists that Gather reads: Device.buffer
RESIDENT_LISTED = 6 * TEXEL  # in textures a quarter longer, and those before that were too short
SPLATS = 512  # software OpenGL's vertices
# A triangle's while its tree is built, or while the native core makes its own of that, on a soup of
# them; a grid of them takes four fifths.
BUILD, NATIVE_BUILD = 376, 520
# And more where a thread finds its face (Mesh.find_faces): 39 MB of 320000 triangles.
AHEAD = 130
TABLES, NATIVE_TABLES = 11 * TEXEL, 6 * TEXEL  # corners, normals, face and at worst a node


class Bytes(NamedTuple):
    """What something takes."""

    device: float = 0.0  # in the GPU's memory, or what textures take where OpenGL is software
    host: float = 0.0


@dataclass(frozen=True)
class Pool:
    """Memory of which there is so much."""

    name: str
    free: int | None  # [bytes]; None: unknown
    fixed: int  # what every render takes of it
    holds_host: bool
    holds_device: bool

    def taken(self, size: Bytes) -> float:
        """Its share."""
        return self.holds_host * size.host + self.holds_device * size.device


@dataclass(frozen=True)
class PhotonCounts:
    """How many photons there are, and what they do."""

    batches: Sequence[int]  # photons of passes together, of one pass, and that tell the radii
    landed: float  # deposits of a pass, or of passes together
    passes: int  # together, each with a grid of its own
    most_bounces: int
    has_lobes: bool
    media: int  # pairs of streams that tell what they are in, and how that scatters them
    shades_long: bool  # SceneNeeds'
    are_drawn: bool  # as splats

    @property
    def a_pass(self) -> int:
        """The photons of a pass, or of passes together."""
        return self.batches[0]


class Sizes:
    """Of GLSL with lists on the host."""

    build = BUILD  # of a triangle, on the host
    tables = TABLES  # of a triangle, on the device

    def __init__(self, device: Device, layer: Layer) -> None:
        self.device, self.layer = device, layer

    def pools(self, free_host: int | None) -> tuple[Pool, ...]:
        """What memory there is; what is on the device in the last."""
        if self.device.is_software:
            return (Pool("memory", free_host, FIXED, True, True),)
        free, name = self.device.free_memory(), self.device.name
        host = Pool("memory", free_host, FIXED, True, False)
        return host, Pool(f"memory on {name}", free, FIXED + GRIDS, False, True)

    def photons(self, counts: PhotonCounts) -> Bytes:
        """Of paths, deposits and the photon map."""
        size = self.paths(counts)
        if counts.are_drawn and self.device.is_software:
            return Bytes(size.device + SPLATS * counts.landed, size.host)
        return size

    def paths(self, counts: PhotonCounts) -> Bytes:
        """The same without splats."""
        paths = PATHS + LOBE_PATHS * counts.has_lobes + MEDIA * counts.media
        return Bytes(
            paths * counts.a_pass + SORTED * counts.landed,
            DOWNLOADED * counts.a_pass + LISTED * counts.landed,
        )

    def triangles(self, count: int, tangents: int) -> Bytes:
        """Of triangles with so many bytes of tangents each."""
        tables = 0 if self.device.is_software else tangents + self.tables  # less than building
        return Bytes(tables * count, (tangents + self.build) * count)

    film_spares = SPARE  # streams that films of a size write to
    denoising_textures = 0  # of a strip's size, that looks at denoised pictures take

    def shadow_textures(self, rays: int, illuminance: bool, more: int) -> int:
        """Of a strip's size, for so many shadow rays of a point; `more`: that each has by glass and
        media on its way."""
        return 0

    def gather_textures(self, gathers_lobes: bool, native: int, others: bool) -> int:
        """Of a strip's size: what launches add to where photons crowd; of lobes that gather the
        same, and what they bring. `native`: that say what the native core gathers with; `others`:
        whether there are lobes that it does not know."""
        return 6 if gathers_lobes else 2

    def waiting(self, pixels: int, strip: int) -> int:
        """Texels that a film of so many pixels keeps for the first look. The first pass's normals
        wait for that, and are read by way of a buffer of a strip's size."""
        return pixels + strip

    @property
    def most_photons(self) -> float:
        """That streams hold."""
        return self.device.texture_limit * STREAM_WIDTH

    def most_deposits(self, is_known: bool) -> float:
        """That tables and lists hold; `is_known`: how many there are, which lists wait for."""
        most = self.device.texture_limit * TABLE_WIDTH
        if self.layer == "compute" and is_known:
            most = min(most, self.device.buffer_limit // TEXEL)  # the lists that Gather reads
        return most


class ResidentSizes(Sizes):
    """Of GLSL with lists on the device."""

    build = BUILD + AHEAD
    denoising_textures = STREAMS

    def paths(self, counts: PhotonCounts) -> Bytes:
        rows = sum(landed_rows(photons, counts.most_bounces) for photons in {*counts.batches})
        a_photon = PATHS + LOBE_PATHS if counts.shades_long else RESIDENT_PATHS
        paths = (a_photon + MEDIA * counts.media) * sum({*counts.batches})
        paths += 0 if counts.shades_long else 2 * TEXEL * STREAM_WIDTH * rows
        lists = RESIDENT_ROOM * counts.a_pass + (RESIDENT_LISTED + SORTED) * counts.landed
        return Bytes(paths + lists + CELLS * (counts.passes - 1))


class NativeSizes(Sizes):
    """Of the native core."""

    build, tables = NATIVE_BUILD, NATIVE_TABLES
    film_spares = 0

    def paths(self, counts: PhotonCounts) -> Bytes:
        return Bytes(0.0, LISTED * counts.landed)

    def shadow_textures(self, rays: int, illuminance: bool, more: int) -> int:
        return (3 + illuminance + more) * (rays > 0)  # one ray's at a time

    def gather_textures(self, gathers_lobes: bool, native: int, others: bool) -> int:
        if not gathers_lobes:
            return 0
        # Of other lobes also what GLSL finds, and what its launches add to.
        return 2 + native + (3 + 4 if others else 0)

    def waiting(self, pixels: int, strip: int) -> int:
        return 0  # the look takes more than they do

    @property
    def most_photons(self) -> float:
        return math.inf

    def most_deposits(self, is_known: bool) -> float:
        return math.inf


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
