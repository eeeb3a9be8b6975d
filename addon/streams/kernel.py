# SPDX-License-Identifier: GPL-3.0-or-later
"""Kernel: a GLSL function run once for each element of its output streams."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from functools import lru_cache, partial
from typing import Any, ClassVar, Protocol

import moderngl

from .count import Count
from .declaration import (
    FIRST_LIST,
    GROUPS,
    MOST_OUTPUTS,
    THREADS,
    Declaration,
    Defines,
    Items,
    OfParts,
    Ports,
    for_all_parts,
    present,
)
from .device import Device, Layer
from .readback import Reading
from .record import Record
from .source import Made, Source, StreamError, every_branch, expand
from .stream import TEXEL, Stream
from .tally import Tally

_MOST_CHECKED = 64  # sets of streams that a kernel remembers; a pass has fewer


class Placed(Protocol):
    """A table that is made where it is asked for."""

    @property
    def on_device(self) -> moderngl.Texture:
        """For GLSL."""

    @property
    def on_host(self) -> Any:
        """For kernels that the host computes."""


class Kernel:
    """Runs `glsl/kernels/<stem>.glsl` over streams; subclasses only declare.

    The GLSL file defines `void kernel()` against generated functions: `load_<input>()`,
    `store_<output>(record)`, `skip()` (the element becomes zero and does not count as alive),
    `element()` and `element_index()`. Structure is a `#define`: those of `structure` that it is
    compiled with; a port, uniform or table in `When` is there only with its own. Files below made/
    that it includes are given as text.

    In compute programs several `lanes` may share each element: all run `kernel()`, which takes
    every LANES-th step of its loop from `lane()`. Where LANES_WAIT for those of other elements, no
    element skips before `sum_over_lanes(vec4)`; elsewhere all lanes of one may.

    Raises StreamError at construction if the declaration and the file don't match, and there or at
    the first launch if the driver refuses the program.
    """

    stem: ClassVar[str]
    structure: ClassVar[tuple[str, ...]] = ()
    inputs: Ports = {}
    outputs: Ports = {}
    uniforms: Mapping[str, Any] = {}  # of Uniform, or When
    tables: Mapping[str, Any] = {}  # of Table or Items, or When
    records: ClassVar[tuple[Record, ...]] = ()  # structs besides those of the ports

    def __init__(
        self,
        device: Device,
        layer: Layer,
        defines: Defines | None = None,
        lanes: int = 1,
        made: Made | None = None,
    ) -> None:
        """Of `defines` and `made`, what a whole scene is compiled with, it takes what it uses."""
        self.device, self.layer, self.launches = device, layer, 0
        declaration = self.declaration(defines or {})
        self.inputs, self.outputs = declaration.inputs, declaration.outputs
        self.uniforms, self.tables = declaration.uniforms, declaration.tables
        self._checked: dict[Any, tuple[int, int]] = {}  # sizes of streams that fitted
        threads = device.warp or THREADS
        self._group = GROUPS[threads][lanes]
        source = self.source(layer, device.glsl_version, defines or {}, lanes, made, threads)
        self._skips = "skip()" in source.text.split("void kernel()", 1)[1]
        compute = layer == "compute"
        corners = _FULL_SCREEN_TRIANGLE.format(version=device.glsl_version)
        self._program = device.program(
            *(() if compute else (corners,)),
            source.text,
            refused=partial(device.refusal, type(self).__name__, source),
        )
        if not compute:
            self._quad = device.ctx.vertex_array(self._program.program, [])
        lists = [name for name, table in self.tables.items() if isinstance(table, Items)]
        self._buffers = lists if compute else []
        self._of_parts = declaration.of_parts if compute else []
        self._textures = [name for name in self.tables if name not in self._buffers]
        samplers = [f"input_{name}" for name in self.inputs]
        samplers += [f"{name}_table" if name in lists else name for name in self._textures]
        for unit, name in enumerate(samplers):
            self._program.set(name, unit)
        device.check()

    @classmethod
    def declaration(cls, defines: Defines) -> Declaration:
        """What the kernel declares if it is compiled with these."""
        return cls._declared(tuple(defines))

    @classmethod
    @lru_cache(maxsize=256)
    def _declared(cls, defines: tuple[str, ...]) -> Declaration:
        return Declaration(
            present(cls.inputs, defines),
            present(cls.outputs, defines),
            present(cls.uniforms, defines),
            present(cls.tables, defines),
            cls.records,
        )

    @classmethod
    def source(
        cls,
        layer: Layer,
        version: int,
        defines: Defines,
        lanes: int = 1,
        made: Made | None = None,
        threads: int = THREADS,
    ) -> Source:
        """The whole program text for a layer; checks the declaration against the file."""
        path = f"kernels/{cls.stem}.glsl"
        cls._check_declaration(path, every_branch(path))
        own = tuple((name, value) for name, value in defines.items() if name in cls.structure)
        return expand(path, cls._header(layer, version, own, lanes, threads), made)

    @classmethod
    @lru_cache(maxsize=256)
    def _header(
        cls,
        layer: Layer,
        version: int,
        own: tuple[tuple[str, int | float], ...],
        lanes: int,
        threads: int,
    ) -> str:
        """Kept, for each renderer that is set up asks for the same again."""
        defines = dict(own)
        return cls.declaration(defines).header(layer, version, defines, lanes, threads)

    def run(
        self,
        streams: Mapping[str, Stream],
        tables: Mapping[str, Any] | None = None,
        uniforms: Mapping[str, Any] | None = None,
    ) -> None:
        """Run once over all elements of the outputs.

        `streams` binds every input and output port, `tables` every table to a texture, or in
        compute programs every list to a buffer, and `uniforms` every uniform. Raises StreamError
        for a wrong port, record or size.
        """
        self._launch(streams, tables or {}, uniforms or {}, False)

    def count(
        self,
        streams: Mapping[str, Stream],
        tables: Mapping[str, Any] | None = None,
        uniforms: Mapping[str, Any] | None = None,
    ) -> Count:
        """Run as `run` does, and count the elements that are not skipped. One count at a time is on
        its way: read it before the next."""
        return Count(self._launch(streams, tables or {}, uniforms or {}, True))

    def tally(
        self,
        streams: Mapping[str, Stream],
        tables: Mapping[str, Any] | None = None,
        uniforms: Mapping[str, Any] | None = None,
        *,
        into: Tally,
    ) -> None:
        """As `count`, of compute programs; the count is the tally's next."""
        self._launch(streams, tables or {}, uniforms or {}, into)

    def _launch(
        self,
        streams: Mapping[str, Stream],
        tables: Mapping[str, Any],
        uniforms: Mapping[str, Any],
        count: bool | Tally,
    ) -> Callable[[], int]:
        names = (*streams.items(),), (*tables,), (*uniforms,)
        size = self._checked.get(names)
        if size is None:
            size = self._check_bindings(streams, tables, uniforms)
            if len(self._checked) >= _MOST_CHECKED:
                self._checked.clear()
            self._checked[names] = size
        textures: list[Any] = [streams[name].texture for name in self.inputs]
        self.device.bind.textures(textures + [tables[name] for name in self._textures])
        self.device.bind.lists([tables[name] for name in self._buffers], FIRST_LIST)
        if self._of_parts:
            uniforms = self._by_parts(uniforms, size[1])
        self._program.set_all(uniforms)
        self._program.set("stream_size", size)
        self.launches += 1
        targets = [streams[name].texture for name in self.outputs]
        if self.layer == "compute":
            return self._dispatch(targets, size, count)
        assert not isinstance(count, Tally)
        return self._draw(targets, count)

    def _by_parts(self, uniforms: Mapping[str, Any], rows: int) -> dict[str, Any]:
        """The uniforms as the program has them, of a stream of so many rows."""
        parts, values = 1, dict(uniforms)
        for name in self._of_parts:
            value = values.pop(name)
            own = [*value] if isinstance(value, OfParts) else [value]
            parts = max(parts, len(own))
            values[f"{name}_of"] = for_all_parts(own)
        if rows % parts:
            raise StreamError(f"{type(self).__name__}: {rows} rows are not of {parts} parts")
        return values | {"rows_a_part": rows // parts}

    @staticmethod
    def placed(table: Placed) -> Any:
        """A table where this kernel reads it."""
        return table.on_device

    def release(self) -> None:
        """Free what is its own; the program is the device's."""
        if self.layer != "compute":
            self._quad.release()

    def _dispatch(
        self,
        targets: list[moderngl.Texture],
        size: tuple[int, int],
        count: bool | Tally,
    ) -> Callable[[], int]:
        self.device.bind.images(targets)
        self._program.set("is_counting", bool(count))
        tally = count if isinstance(count, Tally) else None
        self._program.set("alive_slot", tally.next_slot() if tally else 0)
        self.device.bind.counter(tally.buffer if tally else self.device.alive, bool(count))
        groups = [-(-n // g) for n, g in zip(size, self._group, strict=True)]
        self.device.bind.ready()
        self._program.program.run(*groups)
        self.device.launched()
        if tally or not count:
            return no_count
        return partial(self._counted, self.device.ask(self.device.alive, 1))

    def _counted(self, reading: Reading) -> int:
        (total,) = reading.numbers()
        alive = (total - self.device.alive_before) % (1 << 32)
        self.device.alive_before = total
        return alive

    def _draw(self, targets: list[moderngl.Texture], count: bool) -> Callable[[], int]:
        framebuffer = self.device.framebuffer(targets)
        framebuffer.use()
        if self._skips:
            framebuffer.clear()
        if not count:
            self._quad.render(moderngl.TRIANGLES, vertices=3)
            return no_count
        with self.device.samples_passed as query:
            self._quad.render(moderngl.TRIANGLES, vertices=3)
        return lambda: int(query.samples)

    def _check_bindings(
        self,
        streams: Mapping[str, Stream],
        tables: Mapping[str, Any],
        uniforms: Mapping[str, Any],
    ) -> tuple[int, int]:
        who = type(self).__name__
        ports: dict[str, Any] = {**self.inputs, **self.outputs}
        for what, given, wanted in (
            ("stream", streams, ports),
            ("table", tables, self.tables),
            ("uniform", uniforms, self.uniforms),
        ):
            if given.keys() != wanted.keys():
                odd = sorted(given.keys() ^ wanted.keys())
                raise StreamError(f"{who}: {what}s {odd} are bound or declared, but not both")
        size = streams[next(iter(self.outputs))].size
        for name, record in ports.items():
            stream = streams[name]
            plain = record is TEXEL or (stream.record is TEXEL and name in self.inputs)
            if not plain and stream.record.name != record.name:
                raise StreamError(
                    f"{who}: port {name!r} is a stream of {record.name}, got {stream.record.name}"
                )
            if stream.size != size:
                raise StreamError(f"{who}: port {name!r} is {stream.size}, others are {size}")
        written = {id(streams[name].texture): name for name in self.outputs}
        if len(written) < len(self.outputs):
            raise StreamError(f"{who}: one stream is bound to two outputs of {[*self.outputs]}")
        for name in self.inputs:
            if id(streams[name].texture) in written:
                other = written[id(streams[name].texture)]
                raise StreamError(f"{who}: input {name!r} and output {other!r} are one stream")
        return size

    @classmethod
    @lru_cache(maxsize=256)
    def _check_declaration(cls, path: str, text: str) -> None:
        text = re.sub(r"//.*", "", text)
        if "void kernel()" not in text:
            raise StreamError(f"{cls.__name__}: {path} defines no `void kernel()`")
        if not 1 <= len(cls.outputs) <= MOST_OUTPUTS:
            count = len(cls.outputs)
            raise StreamError(f"{cls.__name__}: {count} outputs, 1 to {MOST_OUTPUTS} are possible")
        for kind, verb, ports in (("input", "load", cls.inputs), ("output", "store", cls.outputs)):
            used = set(re.findall(rf"\b{verb}_(\w+)\s*\(", text))
            for name in ports.keys() - used:
                raise StreamError(
                    f'{cls.__name__}: {kind} "{name}" has no {verb}_{name}() in {path}'
                )
            for name in used - ports.keys():
                raise StreamError(
                    f'{path}: {verb}_{name}() has no {kind} "{name}" in {cls.__name__}'
                )


def no_count() -> int:
    """What a launch that does not count has found."""
    return 0


_FULL_SCREEN_TRIANGLE = """#version {version} core
void main() {{
    vec2 corner = vec2((gl_VertexID << 1) & 2, gl_VertexID & 2);
    gl_Position = vec4(corner * 2.0 - 1.0, 0.0, 1.0);
}}
"""
