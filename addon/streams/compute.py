# SPDX-License-Identifier: GPL-3.0-or-later
"""Compute programs over buffers, and the parallel prefix sum that sorting and compacting need.

For what a stream kernel cannot say: writing to a computed place. Only on devices with compute
programs.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import moderngl

from .declaration import first_lines
from .device import Device
from .source import Made, Source, expand

GROUP = 256  # threads a work group
BLOCK = 1024  # elements that one work group sums, compacts or clears
_GROUPS_A_ROW = 32768  # OpenGL guarantees 65535 groups a dimension


def compute_source(
    stem: str,
    version: int = 430,
    declarations: str = "",
    made: Made | None = None,
    group: int = GROUP,
) -> Source:
    """The expanded text of `glsl/kernels/<stem>.glsl`, which declares its own bindings."""
    header = f"""{first_lines(max(version, 430))}
layout(local_size_x = {group}) in;
uniform int count;
int thread() {{
    int group = int(gl_WorkGroupID.y) * {_GROUPS_A_ROW} + int(gl_WorkGroupID.x);
    return group * {group} + int(gl_LocalInvocationID.x);
}}
int group() {{ return int(gl_WorkGroupID.y) * {_GROUPS_A_ROW} + int(gl_WorkGroupID.x); }}
{declarations}"""
    return expand(f"kernels/{stem}.glsl", header, made)


class Program:
    """A compute program that runs one thread an element: `thread()` below `count`."""

    def __init__(
        self,
        device: Device,
        stem: str,
        declarations: str = "",
        made: Made | None = None,
        group: int = GROUP,
    ) -> None:
        self._device, self.stem, self._group = device, stem, group
        source = compute_source(stem, device.glsl_version, declarations, made, group)
        self._program = device.program(source.text, refused=partial(device.refusal, stem, source))

    def run(
        self,
        count: int,
        buffers: Sequence[moderngl.Buffer] = (),
        textures: Mapping[str, moderngl.Texture] | None = None,
        images: Sequence[moderngl.Texture] = (),
        uniforms: Mapping[str, Any] | None = None,
        groups: int | None = None,
    ) -> None:
        """Run `count` threads; storage buffers and written images bind in order from 0.

        Every texture and uniform of the program has to be given: it is shared.
        """
        bind, textures = self._device.bind, textures or {}
        bind.buffers([*buffers])
        bind.textures([*textures.values()])
        bind.images([*images])
        self._program.set_all({name: unit for unit, name in enumerate(textures)})
        self._program.set_all(uniforms or {})
        self._program.set("count", count)
        groups = groups if groups is not None else -(-count // self._group)
        rows = -(-groups // _GROUPS_A_ROW)
        bind.ready()
        self._program.program.run(min(groups, _GROUPS_A_ROW), rows)
        self._device.launched()


def fill(device: Device, texture: moderngl.Texture, value: float) -> None:
    """Set all channels of all texels of a texture of float32 RGBA; zero is "no element"."""
    if device.has_compute and not device.is_software:
        program = Program(device, "fill_texture")
        program.run(math.prod(texture.size), images=[texture], uniforms={"value": value})
    else:  # drawing is faster there
        device.framebuffer([texture]).clear(value, value, value, value)
        # Of many that were not waited for, llvmpipe keeps memory long after they were freed.
        device.ctx.finish()


def clear(device: Device, buffer: moderngl.Buffer, count: int) -> None:
    """Set a buffer's first `count` uint32 to zero."""
    Program(device, "fill_zero").run(count, [buffer], groups=-(-count // BLOCK))


class Scan:
    """Exclusive prefix sums of uint32 buffers, in place (Blelloch 1990, by blocks)."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self._blocks = Program(device, "scan_blocks")
        self._add = Program(device, "scan_add")
        self._sums: dict[int, moderngl.Buffer] = {}  # block sums by level; they grow

    def run(self, buffer: moderngl.Buffer, count: int, level: int = 0) -> None:
        """Replace the first `count` numbers by the sums of those before them."""
        blocks = -(-count // BLOCK)
        sums = self._sums.get(level)
        if sums is None or sums.size < 4 * blocks:
            if sums is not None:
                self._device.put_back(sums)
            sums = self._sums[level] = self._device.buffer(4 * blocks)
        self._blocks.run(count, [buffer, sums], groups=blocks)
        if blocks > 1:
            self.run(sums, blocks, level + 1)
            self._add.run(count, [buffer, sums])

    def release(self) -> None:
        """Put the buffers back."""
        for buffer in self._sums.values():
            self._device.put_back(buffer)


class Compaction:
    """Moves what is worth keeping to the front, in order (glsl/lib/compaction.glsl):
    `<stem>_count.glsl` counts it by blocks, `<stem>_move.glsl` moves it.

    Two launches: flags, their sums by Scan and the move were six, and took a GPU longer.
    """

    def __init__(self, device: Device, stem: str, defines: str = "") -> None:
        """`defines`: lines of both programs."""
        self._device = device
        self._count, self._move = (
            Program(device, f"{stem}_{step}", defines) for step in ("count", "move")
        )
        self._blocks: moderngl.Buffer | None = None

    def count(
        self,
        elements: int,
        textures: Mapping[str, moderngl.Texture],
        buffers: Sequence[moderngl.Buffer] = (),
    ) -> None:
        """Count; `buffers` bind from 1."""
        blocks = -(-elements // BLOCK)
        if self._blocks is None or self._blocks.size < 4 * blocks:
            if self._blocks:
                self._device.put_back(self._blocks)
            self._blocks = self._device.buffer(4 * blocks)
        self._count.run(elements, [self._blocks, *buffers], textures, groups=blocks)

    def move(
        self,
        elements: int,
        textures: Mapping[str, moderngl.Texture],
        images: Sequence[moderngl.Texture],
        buffers: Sequence[moderngl.Buffer] = (),
        uniforms: Mapping[str, Any] | None = None,
    ) -> None:
        """Write those counted of as many elements; `buffers` bind from 1."""
        assert self._blocks
        blocks = -(-elements // BLOCK)
        self._move.run(
            elements, [self._blocks, *buffers], textures, images, uniforms, groups=blocks
        )

    def release(self) -> None:
        """Put the buffer back."""
        if self._blocks:
            self._device.put_back(self._blocks)
