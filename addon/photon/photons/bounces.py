# SPDX-License-Identifier: GPL-3.0-or-later
"""Several bounces of a pass's photons in one launch, on devices that keep lists."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import moderngl

from ...streams import Declaration, Defines, Device, Made, Program, Stream, in_registers
from ..kernels.projector import Projector
from ..kernels.reflector import Reflector
from ..kernels.shade import Shade
from ..kernels.tracer import Tracer


def kernels(defines: Defines) -> list[tuple[str, Declaration]]:
    """The kernels of a bounce, in order."""
    return [(k.__name__, k.declaration(defines)) for k in (Tracer, Shade, Projector, Reflector)]


def declarations(defines: Defines) -> str:
    """What glsl/kernels/bounces.glsl is compiled with."""
    return in_registers(kernels(defines), defines, ["bounce"])


class Bounces:
    """Tracer, Shade, Projector and Reflector, several times."""

    stem = "bounces"

    def __init__(self, device: Device, defines: Defines, made: Made) -> None:
        self.launches = 0
        self._program = Program(device, self.stem, declarations(defines), made)
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
        """`begin` are origin, direction and flux of the photons, and `end` the same after it, and
        the places and deposits of all bounces, one bounce's streams above the last one's. Counts
        in `alive` who has not ended."""
        width, height = begin["origin"].size
        textures = {f"begin_{name}": stream.texture for name, stream in begin.items()}
        images = [stream.texture for stream in end]
        self._program.run(width * height, [alive], {**textures, **tables}, images, uniforms)
        self.launches += 1
