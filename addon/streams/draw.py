# SPDX-License-Identifier: GPL-3.0-or-later
"""DrawKernel: a kernel that scatters. It draws items over the elements that they add to."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Any, ClassVar, Literal

import moderngl

from .declaration import Defines, Items
from .device import Device
from .kernel import Kernel, no_count
from .source import Source, StreamError, every_branch, expand
from .stream import TEXEL, Stream
from .tally import Tally

Shape = Literal["triangle", "quad", "point"]

_VERTICES = {"triangle": 3, "quad": 4, "point": 1}
_MODES = {
    "triangle": moderngl.TRIANGLES,
    "quad": moderngl.TRIANGLE_STRIP,
    "point": moderngl.POINTS,
}
_UNLIMITED = 1.0e30
# Items are drawn in parts, which are then added up: a float32 sum of more loses what each adds to
# it. And drivers end a draw that takes them seconds; buffers lose what was written to them.
MOST_ITEMS = 1 << 12


class AddPart(Kernel):
    """What is blended to a sum, of the elements that a part of the items has drawn to."""

    stem = "add_part"
    inputs = {"part": TEXEL}
    outputs = {"sum": TEXEL}


class DrawKernel(Kernel):
    """Draws a rectangle for each of a list of items; what an item gives an element is added up.

    The GLSL file defines, under `#ifdef VERTEX`, `void vertex()`, which is run for `item()` and
    says by `cover(low, high)` where on the stream, [-1, 1]^2, the item lies, or nothing if it does
    not; else `void kernel()`, which is run at each element that is covered. `passed` values are
    written by the former and read by the latter. Streams are read at the element, tables by both.
    Raises StreamError at construction if the declaration and the file don't match.
    """

    passed: ClassVar[Mapping[str, str]] = {}  # GLSL types by name

    def __init__(self, device: Device, shape: Shape, defines: Defines | None = None) -> None:
        """`shape`: what is drawn for an item. Of points those that are larger than the device's
        become quads."""
        self.device, self.layer, self.launches = device, "fragment", 0
        declaration = self.declaration(defines or {})
        self.inputs, self.outputs = declaration.inputs, declaration.outputs
        self.uniforms, self.tables = declaration.uniforms, declaration.tables
        shapes: tuple[Shape, ...] = (shape, "quad") if shape == "point" else (shape,)
        self._add = AddPart(device, "fragment")
        self._part: Stream | None = None
        self._drawn = [self._shape(each, defines or {}) for each in shapes]
        limits = (device.point_size_limit,) if shape == "point" else ()
        self._sizes = list(zip((0.0, *limits), (*limits, _UNLIMITED), strict=True))
        device.check()

    def _shape(self, shape: Shape, defines: Defines) -> tuple[Shape, Any, Any]:
        """A shape's program and its vertex array."""
        vertex, fragment = self.sources(self.device.glsl_version, shape, defines)

        def refused(error: moderngl.Error) -> StreamError:
            failed = vertex if "vertex_shader" in str(error) else fragment
            return self.device.refusal(type(self).__name__, failed, error)

        program = self.device.program(vertex.text, fragment.text, refused=refused)
        lists = {name for name, table in self.tables.items() if isinstance(table, Items)}
        samplers = [f"input_{name}" for name in self.inputs]
        samplers += [f"{name}_table" if name in lists else name for name in self.tables]
        for unit, name in enumerate(samplers):
            program.set(name, unit)
        return shape, program, self.device.ctx.vertex_array(program.program, [])

    @classmethod
    def sources(cls, version: int, shape: Shape, defines: Defines) -> tuple[Source, Source]:
        """The vertex and the fragment program; checks the declaration against the file."""
        path = f"kernels/{cls.stem}.glsl"
        text = every_branch(path)
        cls._check_declaration(path, text)
        cls._check_vertices(path, text)
        own = {name: value for name, value in defines.items() if name in cls.structure}
        declaration = cls.declaration(own)
        passed = [f"{kind} {name};" for name, kind in cls.passed.items()]
        corners = declaration.common_header(version, {**own, "VERTEX": 1, _DEFINES[shape]: 1})
        corners += [*(f"flat out {line}" for line in passed), _COVER]
        elements = [declaration.header("fragment", version, own, 1)]
        elements += [f"flat in {line}" for line in passed]
        return expand(path, "\n".join(corners)), expand(path, "\n".join(elements))

    def run(
        self,
        streams: Mapping[str, Stream],
        tables: Mapping[str, Any] | None = None,
        uniforms: Mapping[str, Any] | None = None,
        items: int = 0,
    ) -> None:
        """Clear the output, and draw so many items to it; bound as Kernel's."""
        self._launch(streams, tables or {}, uniforms or {}, False, items)

    def _launch(
        self,
        streams: Mapping[str, Stream],
        tables: Mapping[str, Any],
        uniforms: Mapping[str, Any],
        count: bool | Tally,
        items: int = 0,
    ) -> Callable[[], int]:
        assert not count  # several items cover an element
        size = self._check_bindings(streams, tables, uniforms)
        self.launches += 1
        textures: list[Any] = [streams[name].texture for name in self.inputs]
        textures += [tables[name] for name in self.tables]
        (name,) = self.outputs
        for _, program, _ in self._drawn:
            program.set_all({**uniforms, "stream_size": size})
        ctx, whole = self.device.ctx, streams[name]
        self.device.framebuffer([whole.texture]).clear()
        ctx.enable(moderngl.BLEND | moderngl.PROGRAM_POINT_SIZE)
        ctx.blend_func = moderngl.ONE, moderngl.ONE
        for first in range(0, items, MOST_ITEMS):
            self.device.bind.textures(textures)
            several = min(MOST_ITEMS, items - first)
            if items <= MOST_ITEMS:
                self._draw_items(whole, first, several)
                continue
            part = self._part_like(whole)
            self.device.framebuffer([part.texture]).clear()
            self._draw_items(part, first, several)
            self._add.run({"part": part, "sum": whole})
        ctx.disable(moderngl.BLEND | moderngl.PROGRAM_POINT_SIZE)
        return no_count

    def _draw_items(self, target: Stream, first: int, several: int) -> None:
        self.device.framebuffer([target.texture]).use()
        for (shape, program, corners), (above, up_to) in zip(self._drawn, self._sizes, strict=True):
            own = {"first_item": first, "pixels_above": above, "pixels_up_to": up_to}
            for name, value in own.items():
                program.set(name, value)
            corners.render(_MODES[shape], vertices=_VERTICES[shape], instances=several)

    def _part_like(self, whole: Stream) -> Stream:
        if self._part is None or self._part.size != whole.size:
            if self._part:
                self._part.release()
            self._part = Stream(self.device, TEXEL, whole.size)
        return self._part

    def release(self) -> None:
        """Free what is its own; the programs are the device's."""
        for _, _, corners in self._drawn:
            corners.release()
        self._add.release()
        if self._part:
            self._part.release()

    @classmethod
    def _check_vertices(cls, path: str, text: str) -> None:
        if len(cls.outputs) > 1:
            raise StreamError(f"{cls.__name__}: {len(cls.outputs)} outputs, 1 is possible")
        if "void vertex()" not in text:
            raise StreamError(f"{cls.__name__}: {path} defines no `void vertex()`")
        for name in cls.passed:
            if not re.search(rf"\b{name} =", text):
                raise StreamError(f'{cls.__name__}: passed "{name}" is not written in {path}')


_DEFINES = {shape: f"SHAPE_{shape.upper()}" for shape in _VERTICES}

_COVER = """uniform int first_item;
uniform float pixels_above;  // the sizes that this shape is drawn for
uniform float pixels_up_to;
int item() { return first_item + gl_InstanceID; }

void cover(vec2 low, vec2 high) {
    // Clipped to the stream: OpenGL drops a point whose centre lies outside, with all its width.
    low = max(low, vec2(-1.0));
    high = min(high, vec2(1.0));
    if (any(greaterThanEqual(low, high))) return;
    vec2 centre = 0.5 * (low + high), half_size = 0.5 * (high - low);
    vec2 half_pixels = half_size * vec2(stream_size);
    float pixels = max(half_pixels.x, half_pixels.y) + 1.0;
    if (pixels < pixels_above || pixels > pixels_up_to) return;
#if defined(SHAPE_POINT)
    gl_Position = vec4(centre, 0.0, 1.0);
    gl_PointSize = pixels;
#elif defined(SHAPE_TRIANGLE)
    vec2 corner = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
    gl_Position = vec4(centre + corner * half_size, 0.0, 1.0);
#else
    vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0;
    gl_Position = vec4(centre + corner * half_size, 0.0, 1.0);
#endif
}

void vertex();
void main() {
    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);  // outside: clipped away
    vertex();
}"""
