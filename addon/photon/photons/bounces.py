# SPDX-License-Identifier: GPL-3.0-or-later
"""Several bounces of a pass's photons in one launch, on devices that keep lists."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import moderngl

from ...streams import (
    ByDefines,
    Declaration,
    Defines,
    Device,
    Kernel,
    Made,
    Program,
    Stream,
    Tally,
    in_registers,
)
from ...streams.compute import GROUP
from ..kernels.free_flight import FreeFlight, media_values
from ..kernels.projector import Projector
from ..kernels.records import DEPOSIT, PLACE
from ..kernels.reflector import Reflector
from ..kernels.shade import Shade
from ..kernels.tracer import Tracer
from ..settings import Settings
from ..stage.needs import SceneNeeds
from ..stage.tables import Tables
from .deposits import DeviceDeposits
from .mapper import PhotonBatch, draw_of
from .paths import STREAM_WIDTH, Paths

# Rows for what lands in one launch: photons take as many bounces in it as that has room for, for a
# launch costs a GPU more than dead photons do unless there are many.
LANDED_ROWS = 2048


def landed_rows(photons: int, bounces: int) -> int:
    """Rows for what lands of so many photons of so many bounces, in one launch."""
    rows = -(-photons // STREAM_WIDTH)
    return max(rows, min(LANDED_ROWS, rows * bounces))


def kernels(defines: Defines) -> list[tuple[str, Declaration]]:
    """The kernels of a bounce, in order."""
    flight = [FreeFlight] if "SCATTERING" in defines else []
    of_bounce: list[type[Kernel]] = [Tracer, *flight, Shade, Projector, Reflector]
    return [(k.__name__, k.declaration(defines)) for k in of_bounce]


def declarations(defines: Defines) -> str:
    """What glsl/kernels/bounces.glsl is compiled with."""
    return in_registers(kernels(defines), defines, ["bounce"])


class Bounces:
    """Tracer, Shade, Projector and Reflector, several times."""

    stem = "bounces"

    def __init__(self, device: Device, defines: Defines, made: Made) -> None:
        self.launches = 0
        # Photons bounce as often as they do: a group of many waits for its last one.
        group = device.warp or GROUP
        self._program = Program(device, self.stem, declarations(defines), made, group)
        self.tables = {
            n: table for _, kernel in kernels(defines) for n, table in kernel.tables.items()
        }

    def run(
        self,
        begin: Mapping[str, Stream],
        end: Sequence[Stream],
        tables: Mapping[str, moderngl.Texture],
        alive: moderngl.Buffer,
        uniforms: Mapping[str, Any],
    ) -> None:
        """`begin` are the streams of Paths, and `end` origin, direction and flux after it, the
        places and deposits of all bounces, one bounce's streams above the last one's, and the media
        if there are any. Counts in `alive` who has not ended."""
        width, height = begin["origin"].size
        textures = {f"begin_{name}": stream.texture for name, stream in begin.items()}
        images = [stream.texture for stream in end]
        self._program.run(width * height, [alive], {**textures, **tables}, images, uniforms)
        self.launches += 1


class SeveralBounces:
    """As many a launch as there is room for, up to that in which a photon is cut off."""

    paths: ClassVar = Paths  # that it takes

    def __init__(
        self, device: Device, tables: Tables, settings: Settings, needs: SceneNeeds
    ) -> None:
        self._device, self._tables, self._settings = device, tables, settings
        self._most, self._covers = needs.photon_bounces + 1, needs.covers
        defines, made = needs.photon_defines, needs.made

        def bounces(more: Defines) -> Bounces:
            return Bounces(device, {**defines, **more}, made)

        self._programs = ByDefines(bounces)
        self._programs.of({})
        self._records = PLACE, DEPOSIT, *([PLACE] * needs.caustics)
        # A bounce's above the last's: places, deposits, and the caustics' places if told.
        self._landed: tuple[Stream, ...] = ()

    def make_room(self, photons: int) -> None:
        """For what lands of so many."""
        size = STREAM_WIDTH, landed_rows(photons, self._most)
        if not self._landed or self._landed[0].size != size:
            self.release()  # of passes of another size
            self._landed = tuple(Stream(self._device, record, size) for record in self._records)

    def worth_compacting(self, paths: Paths, first: int) -> bool:
        """Not if what is left takes one launch as it is."""
        return paths.rows * (self._most - first) > self._landed[0].size[1]

    def run(
        self, batch: PhotonBatch, paths: Paths, first: int, deposits: DeviceDeposits, tally: Tally
    ) -> int:
        """Launch bounces from the first on, append what lands, and count who goes on in the
        tally's next; how many bounces."""
        program = self._programs.of(self._tables.portal_defines(self._covers))
        bounces = min(self._landed[0].size[1] // paths.rows, self._most - first)
        backs = paths.backs()
        media = [backs.pop("medium")] if "medium" in backs else []
        program.run(
            paths.fronts(),
            [*backs.values(), *self._landed, *media],
            self._tables.of(program),
            tally.buffer,
            draw_of(self._settings, batch.index)
            | {"alive_slot": tally.next_slot(), "first_bounce": first, "bounces": bounces}
            | {"first_to_deposit": batch.first_to_deposit(self._settings)}
            | {"numbered": batch.numbered}
            | media_values(self._settings, self._tables)
            | dict(self._tables.footprint),
        )
        deposits.append(*self._landed, rows=bounces * paths.rows)
        paths.swap()
        return bounces

    def launches(self) -> dict[str, int]:
        """How often the program has run."""
        return {Bounces.stem: self._programs.launches}

    def release(self) -> None:
        """Free streams."""
        for stream in self._landed:
            stream.release()
        self._landed = ()
