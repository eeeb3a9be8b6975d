# SPDX-License-Identifier: GPL-3.0-or-later
"""What a kernel declares, and the GLSL that is made of it."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeVar

from .device import Layer
from .record import Record
from .source import StreamError

# Elements of a compute work group, by its threads and how many of these share each. So many suit
# every GPU's warp or wave size; a group that is one warp ends when its own threads have.
THREADS = 64
GROUPS = {
    THREADS: {1: (8, 8), 4: (4, 4), 8: (4, 2), 16: (2, 2)},
    32: {1: (4, 8), 4: (4, 2), 8: (2, 2), 16: (2, 1)},
}
TABLE_WIDTH = 4096  # texels, a power of two; glsl/lib/table.glsl
FIRST_LIST = 1  # storage buffer binding; 0 counts who is alive
MOST_OUTPUTS = 8  # what OpenGL guarantees of draw buffers, and of image units in compute programs
MOST_PARTS = 8  # of a stream, one above the other; glsl/lib/of_part.glsl tells no more apart

Defines = Mapping[str, int | float]
Item = TypeVar("Item")


@dataclass(frozen=True)
class Uniform:
    """A value that is the same for every element, or for all of a part: a stream may hold several
    things of one kind, such as passes, in as many rows each. GLSL knows an element's by `part`."""

    kind: str  # GLSL type
    of_parts: bool = False  # each may have its own, in compute programs


class OfParts(tuple[Any, ...]):
    """A uniform's values, one of each part of a stream."""


def of_parts(values: Sequence[Any]) -> Any:
    """A uniform's value by those of the parts, where there may be but one part."""
    return values[0] if len(values) == 1 else OfParts(values)


@dataclass(frozen=True)
class Table:
    """A texture that an element may read anywhere, such as the BVH; with a record, its elements
    are read as `<record>_at(index)`."""

    record: Record | None = None
    kind: str = "sampler2D"


@dataclass(frozen=True)
class Items:
    """A list that an element may read anywhere, as `<name>(i)`: a storage buffer in compute
    programs, which a GPU reads faster, else a texture TABLE_WIDTH texels wide."""

    kind: Literal["vec4", "uint"] = "vec4"


@dataclass(frozen=True)
class When:
    """A port, uniform or table, or another When, that is there only if the kernel is compiled with
    a define, or with one of several."""

    define: str | tuple[str, ...]
    item: Any

    def is_there(self, defines: Collection[str]) -> bool:
        """Whether it is, with these."""
        wanted = (self.define,) if isinstance(self.define, str) else self.define
        there = any(define in defines for define in wanted)
        return there and (not isinstance(self.item, When) or self.item.is_there(defines))

    def unwrapped(self) -> Any:
        """The port, uniform or table."""
        return self.item.unwrapped() if isinstance(self.item, When) else self.item


def for_all_parts(values: Sequence[Any]) -> list[Any]:
    """As many as MOST_PARTS, for arrays of GLSL: the last one again."""
    return [*values, *[values[-1]] * (MOST_PARTS - len(values))]


Ports = Mapping[str, Any]  # of Record, or When


def present(items: Mapping[str, Any], defines: Collection[str]) -> dict[str, Any]:
    """Those of a declaration's items that are there."""
    chosen = {
        name: item.unwrapped() if isinstance(item, When) else item
        for name, item in items.items()
        if not isinstance(item, When) or item.is_there(defines)
    }
    return chosen


def records_of(ports: Mapping[str, Record], tables: Mapping[str, Any]) -> dict[str, Record]:
    """The records that ports and tables are of, by name."""
    of_tables = [t.record for t in tables.values() if isinstance(t, Table) and t.record]
    return {record.name: record for record in (*ports.values(), *of_tables)}


def declare_tables(tables: Mapping[str, Table | Items]) -> list[str]:
    """Those that are textures."""
    lines = []
    for name, table in tables.items():
        if isinstance(table, Table):
            lines.append(f"uniform {table.kind} {name};")
            if table.record:
                lines.append(table.record.glsl_table(name, TABLE_WIDTH))
    return lines


def first_lines(version: int) -> str:
    """Of every program: NVIDIA's compiler takes half as long again, or twice as long, if it unrolls
    loops, and gains nothing by it."""
    return f"#version {version} core\n#pragma optionNV(unroll none)"


@dataclass(frozen=True)
class Declaration:
    """A kernel's ports, uniforms and tables, those that its defines leave."""

    inputs: Mapping[str, Record]
    outputs: Mapping[str, Record]
    uniforms: Mapping[str, Uniform]
    tables: Mapping[str, Table | Items]
    records: tuple[Record, ...] = ()

    def header(
        self, layer: Layer, version: int, defines: Defines, lanes: int, threads: int = THREADS
    ) -> str:
        """What precedes the kernel's file in its program."""
        compute = layer == "compute"
        lines = self.common_header(max(version, 430) if compute else version, defines, compute)
        lines.append(f"#define LANES {lanes}")
        if lanes > 1:
            lines.insert(1, _SHUFFLES)
        if compute:
            lines.append(_compute_prelude(GROUPS[threads][lanes], threads))
            lines.append(_parts(self.of_parts) if self.of_parts else _ONE_PART)
        else:
            lines.append("ivec2 element() { return ivec2(gl_FragCoord.xy); }")
            lines.append(_ONE_PART)
        lines.append(_LANES if lanes > 1 else _ONE_LANE)
        lines.append("int element_index() { return element().y * stream_size.x + element().x; }")
        for name, record in self.inputs.items():
            lines.append(f"uniform sampler2D input_{name};")
            lines.append(
                f"{record.name} load_{name}() "
                f"{{ return unpack_{record.name}(texelFetch(input_{name}, element(), 0)); }}"
            )
        lines += self._outputs(compute, lanes)
        return "\n".join(lines)

    @property
    def of_parts(self) -> list[str]:
        """The uniforms of which each part of a stream may have its own."""
        return [name for name, uniform in self.uniforms.items() if uniform.of_parts]

    def common_header(self, version: int, defines: Defines, compute: bool = False) -> list[str]:
        """Lines of every stage: records, uniforms and tables."""
        records = records_of({**self.inputs, **self.outputs}, self.tables)
        records |= {record.name: record for record in self.records}
        lines = [first_lines(version)]
        lines += [f"#define {name} {value}" for name, value in defines.items()]
        lines.append(_BEFORE_400)
        lines += [record.glsl() for record in records.values()]
        lines.append("uniform ivec2 stream_size;")
        for name, uniform in self.uniforms.items():
            if compute and uniform.of_parts:
                lines.append(f"uniform {uniform.kind} {name}_of[{MOST_PARTS}];")
                lines.append(f"{uniform.kind} {name};")
            else:
                lines.append(f"uniform {uniform.kind} {name};")
        lines += declare_tables(self.tables)
        lists = [(name, t.kind) for name, t in self.tables.items() if isinstance(t, Items)]
        for binding, (name, kind) in enumerate(lists, FIRST_LIST):
            if compute:
                lines += _list_in_buffer(name, kind, binding)
            else:
                lines += _list_in_texture(name, kind)
        return lines

    def _outputs(self, compute: bool, lanes: int) -> list[str]:
        lines = []
        for slot, (name, record) in enumerate(self.outputs.items()):
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
                f"imageStore(output_{name}, element(), vec4(0.0));" for name in self.outputs
            )
            lines.append(f"#define skip() {{ skipped = true; {zeros} return; }}")
            lines.append(_COMPUTE_MAIN)
        else:
            lines.append("#define skip() { discard; return; }")
            lines.append("void kernel();\nvoid main() { kernel(); }")
        return lines


def in_registers(
    kernels: Sequence[tuple[str, Declaration]], defines: Defines, own: Sequence[str]
) -> str:
    """What a compute program declares to run several kernels one after the other in a thread, which
    keeps their streams in registers; `own` are the uniforms that differ from thread to thread.

    Raises StreamError for ports of one name and other records.
    """
    ports: dict[str, Record] = {}
    uniforms: dict[str, str] = {}
    tables: dict[str, Table | Items] = {}
    for who, kernel in kernels:
        for name, record in {**kernel.inputs, **kernel.outputs}.items():
            before = ports.setdefault(name, record)
            if before is not record:
                raise StreamError(f"{who}: port {name!r} is {record.name}, before {before.name}")
        uniforms |= {name: uniform.kind for name, uniform in kernel.uniforms.items()}
        tables |= kernel.tables
    lines = [f"#define {name} {value}" for name, value in defines.items()]
    lines += [record.glsl() for record in records_of(ports, tables).values()]
    lines += declare_tables(tables)
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


def _compute_prelude(group: tuple[int, int], threads: int) -> str:
    x, y = group
    return f"""layout(local_size_x = {threads}) in;
layout(std430, binding = 0) buffer Alive {{ uint alive[]; }};
uniform bool is_counting;
uniform int alive_slot;
shared uint group_alive;
bool skipped = false;
ivec2 own_element() {{
    int number = int(gl_LocalInvocationIndex) / LANES;
    return ivec2(gl_WorkGroupID.xy) * ivec2({x}, {y}) + ivec2(number % {x}, number / {x});
}}
// Within the stream, for lanes beyond it help to sum.
ivec2 element() {{ return min(own_element(), stream_size - 1); }}"""


_ONE_PART = """const int part = 0;
ivec2 element_of_part() { return element(); }
void find_part() {}"""


def _parts(uniforms: Sequence[str]) -> str:
    """Which part an element is of, its place there, and the uniforms' values."""
    values = " ".join(f"{name} = {name}_of[part];" for name in uniforms)
    return f"""uniform int rows_a_part;
int part = 0;
ivec2 element_of_part() {{ return element() - ivec2(0, part * rows_a_part); }}
void find_part() {{ part = element().y / rows_a_part; {values} }}"""


_ONE_LANE = """const bool LANES_WAIT = false;
int lane() { return 0; }
vec4 sum_over_lanes(vec4 own) { return own; }"""

# NVIDIA's warps are runs of invocations, and so hold all lanes of an element: these need not wait
# at barriers, as they would twice a sum, and may end before others. Sums are the same. Old drivers
# know no subgroups.
_SHUFFLES = """#ifdef GL_NV_shader_thread_shuffle
#extension GL_KHR_shader_subgroup_basic : enable
#extension GL_KHR_shader_subgroup_shuffle : enable
#endif"""
_LANES = """int lane() { return int(gl_LocalInvocationIndex) % LANES; }
bool is_own() { return lane() == 0 && own_element() == element(); }  // to write
#if defined(GL_NV_shader_thread_shuffle) && defined(GL_KHR_shader_subgroup_shuffle)
const bool LANES_WAIT = false;
vec4 sum_over_lanes(vec4 own) {
    vec4 sum = vec4(0.0);
    uint first = gl_SubgroupInvocationID / uint(LANES) * uint(LANES);
    for (uint i = first; i < first + uint(LANES); i++) sum += subgroupShuffle(own, i);
    return sum;
}
#else
const bool LANES_WAIT = true;
shared vec4 lane_parts[gl_WorkGroupSize.x];
vec4 sum_over_lanes(vec4 own) {
    lane_parts[gl_LocalInvocationIndex] = own;
    barrier();
    vec4 sum = vec4(0.0);
    int first = int(gl_LocalInvocationIndex) - lane();
    for (int i = first; i < first + LANES; i++) sum += lane_parts[i];
    barrier();
    return sum;
}
#endif"""

# One atomic a work group: those on one address wait for each other.
_COMPUTE_MAIN = """void kernel();
void main() {
    bool inside = all(lessThan(own_element(), stream_size));
    find_part();
    if (inside || LANES > 1) kernel();
    inside = inside && lane() == 0;
    if (!is_counting) return;
    if (gl_LocalInvocationIndex == 0u) group_alive = 0u;
    barrier();
    if (inside && !skipped) atomicAdd(group_alive, 1u);
    barrier();
    if (gl_LocalInvocationIndex > 0u || group_alive == 0u) return;
    atomicAdd(alive[alive_slot], group_alive);
}"""
