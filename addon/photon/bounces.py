# SPDX-License-Identifier: GPL-3.0-or-later
"""Several bounces of a pass's photons in one launch, on devices that keep lists."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import moderngl

from ..streams import Device, Program, Stream
from ..streams.kernel import in_registers
from .projector import Projector
from .reflector import Reflector
from .tracer import Tracer

KERNELS = (Tracer, Projector, Reflector)


def declarations() -> str:
    """What glsl/kernels/bounces.glsl is compiled with."""
    return in_registers(KERNELS, ["bounce"])


class Bounces:
    """Tracer, Projector and Reflector, several times."""

    stem = "bounces"

    def __init__(self, device: Device) -> None:
        self.launches = 0
        self._program = Program(device, self.stem, declarations())
        self.tables = {name: table for kernel in KERNELS for name, table in kernel.tables.items()}

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
