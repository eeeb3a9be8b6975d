# SPDX-License-Identifier: GPL-3.0-or-later
"""Kernel: a GLSL function run once for each element of its output streams."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any, ClassVar

import moderngl

from .device import Device, Layer, nothing
from .readback import Reading
from .source import Source, StreamError, expand, read
from .stream import TEXEL, Record, Stream

# Elements of a compute work group, by the invocations that share each: 64 in all suit every GPU's
# warp or wave size.
GROUPS = {1: (8, 8), 8: (4, 2), 32: (2, 1)}
TABLE_WIDTH = 4096  # texels; glsl/lib/table.glsl
FIRST_LIST = 1  # storage buffer binding; 0 counts who is alive
_MOST_CHECKED = 64  # sets of streams that a kernel remembers; a pass has fewer
_MAX_OUTPUTS = 4  # what OpenGL 3.3 guarantees in practice for float MRT


@dataclass(frozen=True)
class Uniform:
    """A value that is the same for every element."""

    kind: str  # GLSL type


@dataclass(frozen=True)
class Table:
    """A texture that an element may read anywhere, such as the BVH."""

    kind: str = "sampler2D"


@dataclass(frozen=True)
class Items:
    """A list that an element may read anywhere, as `<name>(i)`: a storage buffer in compute
    programs, which a GPU reads faster, else a texture TABLE_WIDTH texels wide."""

    kind: str = "vec4"  # or uint


class Kernel:
    """Runs `glsl/kernels/<stem>.glsl` over streams; subclasses only declare.

    The GLSL file defines `void kernel()` against generated functions: `load_<input>()`,
    `store_<output>(record)`, `skip()` (the element becomes zero and does not count as alive),
    `element()` and `element_index()`. Structure is a `#define` from `defines`.

    In compute programs several `lanes` may share each element: all run `kernel()`, which takes
    every LANES-th step of its loop from `lane()`, and never skips before `sum_over_lanes(vec4)`.
    Raises StreamError at construction if the declaration and the file don't match.
    """

    stem: ClassVar[str]
    inputs: ClassVar[Mapping[str, Record]] = {}
    outputs: ClassVar[Mapping[str, Record]] = {}
    uniforms: ClassVar[Mapping[str, Uniform]] = {}
    tables: ClassVar[Mapping[str, Table | Items]] = {}
    records: ClassVar[tuple[Record, ...]] = ()  # structs besides those of the ports

    def __init__(
        self,
        device: Device,
        layer: Layer,
        defines: Mapping[str, int | float] | None = None,
        lanes: int = 1,
    ) -> None:
        self.device, self.layer, self.launches = device, layer, 0
        self._checked: dict[Any, tuple[int, int]] = {}  # sizes of streams that fitted
        self._group = GROUPS[lanes]
        source = self.source(layer, device.glsl_version, defines or {}, lanes)
        self._skips = "skip()" in source.text.split("void kernel()", 1)[1]
        compute = layer == "compute"
        corners = _FULL_SCREEN_TRIANGLE.format(version=device.glsl_version)
        try:
            self._program = device.program(*(() if compute else (corners,)), source.text)
        except moderngl.Error as error:
            raise device.refusal(type(self).__name__, source, error) from None
        if not compute:
            self._quad = device.ctx.vertex_array(self._program.program, [])
        lists = [name for name, table in self.tables.items() if isinstance(table, Items)]
        self._buffers = lists if compute else []
        self._textures = [name for name in self.tables if name not in self._buffers]
        samplers = [f"input_{name}" for name in self.inputs]
        samplers += [f"{name}_table" if name in lists else name for name in self._textures]
        for unit, name in enumerate(samplers):
            self._program.set(name, unit)
        device.check()

    @classmethod
    def source(
        cls, layer: Layer, version: int, defines: Mapping[str, int | float], lanes: int = 1
    ) -> Source:
        """The whole program text for a layer; checks the declaration against the file."""
        path = f"kernels/{cls.stem}.glsl"
        cls._check_declaration(path, read(path, cls.__name__))
        return expand(path, cls._header(layer, version, defines, lanes))

    def run(
        self,
        streams: Mapping[str, Stream],
        tables: Mapping[str, Any] | None = None,
        uniforms: Mapping[str, Any] | None = None,
        count: bool = False,
        meanwhile: Callable[[], None] = nothing,
    ) -> int:
        """Run once over all elements of the outputs.

        `streams` binds every input and output port, `tables` every table to a texture, or in
        compute programs every list to a buffer, and `uniforms` every uniform. With `count`,
        returns how many elements were not skipped (calls `meanwhile`, which must not count, and
        waits for the device); else 0. Raises StreamError for a wrong port, record or size.
        """
        tables, uniforms = tables or {}, uniforms or {}
        names = (*streams.items(),), (*tables,), (*uniforms,)
        size = self._checked.get(names)
        if size is None:
            size = self._check_bindings(streams, tables, uniforms)
            if len(self._checked) >= _MOST_CHECKED:
                self._checked.clear()
            self._checked[names] = size
        textures = [streams[name].texture for name in self.inputs]
        for unit, texture in enumerate([*textures, *(tables[name] for name in self._textures)]):
            texture.use(location=unit)
        for binding, name in enumerate(self._buffers, FIRST_LIST):
            tables[name].bind_to_storage_buffer(binding)
        for name, value in uniforms.items():
            self._program.set(name, value)
        self._program.set("stream_size", size)
        self.launches += 1
        targets = [streams[name].texture for name in self.outputs]
        if self.layer == "compute":
            asked = self._dispatch(targets, size, count)
        else:
            asked = self._draw(targets, count)
        if not asked:
            return 0
        meanwhile()
        return asked()

    def release(self) -> None:
        """Free what is its own; the program is the device's."""
        if self.layer != "compute":
            self._quad.release()

    def _dispatch(
        self,
        targets: list[moderngl.Texture],
        size: tuple[int, int],
        count: bool,
    ) -> Callable[[], int] | None:
        for unit, texture in enumerate(targets):
            texture.bind_to_image(unit, read=False, write=True)
        self._program.set("is_counting", count)
        self.device.alive.bind_to_storage_buffer(0)
        groups = [-(-n // g) for n, g in zip(size, self._group, strict=True)]
        self._program.program.run(*groups)
        self.device.ctx.memory_barrier()
        self.device.launched()
        return partial(self._counted, self.device.ask(self.device.alive, 1)) if count else None

    def _counted(self, reading: Reading) -> int:
        (total,) = reading.numbers()
        alive = (total - self.device.alive_before) % (1 << 32)
        self.device.alive_before = total
        return alive

    def _draw(self, targets: list[moderngl.Texture], count: bool) -> Callable[[], int] | None:
        framebuffer = self.device.framebuffer(targets)
        framebuffer.use()
        if self._skips:
            framebuffer.clear()
        if not count:
            self._quad.render(moderngl.TRIANGLES, vertices=3)
            return None
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
        ports = {**self.inputs, **self.outputs}
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
        written = {id(streams[name]): name for name in self.outputs}
        if len(written) < len(self.outputs):
            raise StreamError(f"{who}: one stream is bound to two outputs of {[*self.outputs]}")
        for name in self.inputs:
            if id(streams[name]) in written:
                other = written[id(streams[name])]
                raise StreamError(f"{who}: input {name!r} and output {other!r} are one stream")
        return size

    @classmethod
    @lru_cache(maxsize=256)
    def _check_declaration(cls, path: str, text: str) -> None:
        text = re.sub(r"//.*", "", text)
        if "void kernel()" not in text:
            raise StreamError(f"{cls.__name__}: {path} defines no `void kernel()`")
        if not 1 <= len(cls.outputs) <= _MAX_OUTPUTS:
            raise StreamError(f"{cls.__name__}: {len(cls.outputs)} outputs, 1 to 4 are possible")
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

    @classmethod
    def _header(
        cls, layer: Layer, version: int, defines: Mapping[str, int | float], lanes: int
    ) -> str:
        compute = layer == "compute"
        ports = (*cls.inputs.values(), *cls.outputs.values())
        records = {record.name: record for record in (*ports, *cls.records)}
        lines = [f"#version {max(version, 430) if compute else version} core"]
        lines += [f"#define {name} {value}" for name, value in defines.items()]
        lines.append(_BEFORE_400)
        lines += [record.glsl() for record in records.values()]
        lines.append("uniform ivec2 stream_size;")
        lines += [f"uniform {u.kind} {name};" for name, u in cls.uniforms.items()]
        lines += [
            f"uniform {t.kind} {name};" for name, t in cls.tables.items() if isinstance(t, Table)
        ]
        lists = [(name, t.kind) for name, t in cls.tables.items() if isinstance(t, Items)]
        for binding, (name, kind) in enumerate(lists, FIRST_LIST):
            lines += (
                _list_in_buffer(name, kind, binding) if compute else _list_in_texture(name, kind)
            )
        lines.append(f"#define LANES {lanes}")
        if compute:
            lines.append(_compute_prelude(lanes))
        else:
            lines.append("ivec2 element() { return ivec2(gl_FragCoord.xy); }")
        lines.append(_LANES if lanes > 1 else _ONE_LANE)
        lines.append("int element_index() { return element().y * stream_size.x + element().x; }")
        for name, record in cls.inputs.items():
            lines.append(f"uniform sampler2D input_{name};")
            lines.append(
                f"{record.name} load_{name}() "
                f"{{ return unpack_{record.name}(texelFetch(input_{name}, element(), 0)); }}"
            )
        for slot, (name, record) in enumerate(cls.outputs.items()):
            if compute:
                lines.append(
                    f"layout(rgba32f, binding = {slot}) writeonly uniform image2D output_{name};"
                )
                write = f"imageStore(output_{name}, element(), pack_{record.name}(record))"
                write = f"if (is_own()) {write}" if lanes > 1 else write
            else:
                lines.append(f"layout(location = {slot}) out vec4 output_{name};")
                write = f"output_{name} = pack_{record.name}(record)"
            lines.append(f"void store_{name}({record.name} record) {{ {write}; }}")
        if compute:
            zeros = " ".join(
                f"imageStore(output_{name}, element(), vec4(0.0));" for name in cls.outputs
            )
            lines.append(f"#define skip() {{ skipped = true; {zeros} return; }}")
            lines.append(_COMPUTE_MAIN)
        else:
            lines.append("#define skip() { discard; return; }")
            lines.append("void kernel();\nvoid main() { kernel(); }")
        return "\n".join(lines)


def in_registers(kernels: Sequence[type[Kernel]], own: Sequence[str]) -> str:
    """What a compute program declares to run several kernels one after the other in a thread, which
    keeps their streams in registers; `own` are the uniforms that differ from thread to thread.

    Raises StreamError for ports of one name and other records.
    """
    ports: dict[str, Record] = {}
    uniforms: dict[str, str] = {}
    for kernel in kernels:
        for name, record in {**kernel.inputs, **kernel.outputs}.items():
            before = ports.setdefault(name, record)
            if before is not record:
                who = kernel.__name__
                raise StreamError(f"{who}: port {name!r} is {record.name}, before {before.name}")
        uniforms |= {name: uniform.kind for name, uniform in kernel.uniforms.items()}
        uniforms |= {name: t.kind for name, t in kernel.tables.items() if isinstance(t, Table)}
    records = {record.name: record for record in ports.values()}
    lines = [record.glsl() for record in records.values()]
    for name, kind in uniforms.items():
        lines.append(f"{kind} {name};" if name in own else f"uniform {kind} {name};")
    for name, record in ports.items():
        lines.append(f"{record.name} port_{name};")
        lines.append(f"{record.name} load_{name}() {{ return port_{name}; }}")
        lines.append(f"void store_{name}({record.name} record) {{ port_{name} = record; }}")
    lines.append("bool skipped = false;\n#define skip() { skipped = true; return; }")
    return "\n".join(lines)


def _list_in_buffer(name: str, kind: str, binding: int) -> list[str]:
    return [
        f"layout(std430, binding = {binding}) readonly buffer {name}_list",
        f"{{ {kind} {name}_items[]; }};",
        f"{kind} {name}(int i) {{ return {name}_items[i]; }}",
    ]


def _list_in_texture(name: str, kind: str) -> list[str]:
    sampler, part = ("usampler2D", ".x") if kind == "uint" else ("sampler2D", "")
    at = f"ivec2(i % {TABLE_WIDTH}, i / {TABLE_WIDTH})"
    return [
        f"uniform {sampler} {name}_table;",
        f"{kind} {name}(int i) {{ return texelFetch({name}_table, {at}, 0){part}; }}",
    ]


_BEFORE_400 = """#if __VERSION__ < 400
#define precise
#define fma(a, b, c) ((a) * (b) + (c))
#endif"""

_FULL_SCREEN_TRIANGLE = """#version {version} core
void main() {{
    vec2 corner = vec2((gl_VertexID << 1) & 2, gl_VertexID & 2);
    gl_Position = vec4(corner * 2.0 - 1.0, 0.0, 1.0);
}}
"""


def _compute_prelude(lanes: int) -> str:
    x, y = GROUPS[lanes]
    return f"""layout(local_size_x = {x * y * lanes}) in;
layout(std430, binding = 0) buffer Alive {{ uint alive; }};
uniform bool is_counting;
shared uint group_alive;
bool skipped = false;
ivec2 own_element() {{
    int number = int(gl_LocalInvocationIndex) / LANES;
    return ivec2(gl_WorkGroupID.xy) * ivec2({x}, {y}) + ivec2(number % {x}, number / {x});
}}
// Within the stream, for lanes beyond it help to sum.
ivec2 element() {{ return min(own_element(), stream_size - 1); }}"""


_ONE_LANE = """int lane() { return 0; }
vec4 sum_over_lanes(vec4 own) { return own; }"""

_LANES = """shared vec4 lane_parts[gl_WorkGroupSize.x];
int lane() { return int(gl_LocalInvocationIndex) % LANES; }
bool is_own() { return lane() == 0 && own_element() == element(); }  // to write
vec4 sum_over_lanes(vec4 own) {
    lane_parts[gl_LocalInvocationIndex] = own;
    barrier();
    vec4 sum = vec4(0.0);
    int first = int(gl_LocalInvocationIndex) - lane();
    for (int i = first; i < first + LANES; i++) sum += lane_parts[i];
    barrier();
    return sum;
}"""

# One atomic a work group: those on one address wait for each other.
_COMPUTE_MAIN = """void kernel();
void main() {
    bool inside = all(lessThan(own_element(), stream_size));
    if (inside || LANES > 1) kernel();
    inside = inside && lane() == 0;
    if (!is_counting) return;
    if (gl_LocalInvocationIndex == 0u) group_alive = 0u;
    barrier();
    if (inside && !skipped) atomicAdd(group_alive, 1u);
    barrier();
    if (gl_LocalInvocationIndex > 0u || group_alive == 0u) return;
    atomicAdd(alive, group_alive);
}"""
