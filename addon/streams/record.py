# SPDX-License-Identifier: GPL-3.0-or-later
"""Record: the layout of one element, of a stream or of a table, written once."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .source import StreamError

_SIZES = {"float": 1, "vec2": 2, "vec3": 3, "vec4": 4}
_CHANNELS = "xyzw"
CHANNELS = 4  # float32 numbers of a texel


@dataclass(frozen=True)
class Record:
    """Names float32 fields, in texels of four: {"position": "vec3", "surface": "float"}.

    A field that does not fit into what is left of a texel begins the next one. Elements of streams
    have one texel. There a record of all zeros means "no element": that is what a skipped element
    leaves behind.
    """

    name: str
    fields: Mapping[str, str]

    def __post_init__(self) -> None:
        unknown = [kind for kind in self.fields.values() if kind not in _SIZES]
        if unknown:
            raise StreamError(f"record {self.name}: no field type {unknown[0]!r}")

    @property
    def texels(self) -> int:
        """Of an element."""
        return 1 + max((texel for _, _, texel, _ in self._places()), default=0)

    @property
    def layout(self) -> str:
        """The declaration as one line of text, by which two languages compare theirs."""
        return "; ".join(f"{kind} {name}" for name, kind in self.fields.items())

    @property
    def dtype(self) -> np.dtype[Any]:
        """An element as numpy packs it."""
        places = list(self._places())
        shapes = [
            (size,) if size > 1 else () for size in (_SIZES[kind] for _, kind, _, _ in places)
        ]
        return np.dtype(
            {
                "names": [name for name, *_ in places],
                "formats": [(np.float32, shape) for shape in shapes],
                "offsets": [4 * (CHANNELS * texel + at) for _, _, texel, at in places],
                "itemsize": 4 * CHANNELS * self.texels,
            }
        )

    def zeros(self, count: int) -> NDArray[Any]:
        """`count` elements of zeros, whose fields are read and written by name."""
        return np.zeros(count, self.dtype)

    def glsl(self) -> str:
        """The struct and its conversions from and to texels."""
        members = " ".join(f"{kind} {name};" for name, kind in self.fields.items())
        texels = (
            [f"texel{number}" for number in range(self.texels)] if self.texels > 1 else ["texel"]
        )
        reads: list[str] = []
        writes: list[list[str]] = [[] for _ in texels]
        for name, kind, texel, at in self._places():
            reads.append(f"{texels[texel]}.{_CHANNELS[at : at + _SIZES[kind]]}")
            writes[texel].append(f"record.{name}")
        arguments = ", ".join(f"vec4 {texel}" for texel in texels)
        lines = [
            f"struct {self.name} {{ {members} }};",
            f"{self.name} unpack_{self.name}({arguments}) "
            f"{{ return {self.name}({', '.join(reads)}); }}",
        ]
        if self.texels == 1:
            used = sum(_SIZES[kind] for kind in self.fields.values())
            parts = ", ".join(writes[0] + ["0.0"] * (CHANNELS - used))
            lines.append(f"vec4 pack_{self.name}({self.name} record) {{ return vec4({parts}); }}")
        return "\n".join(lines) + "\n"

    def glsl_table(self, table: str, width: int) -> str:
        """`<Name> <name>_at(int index)`, which reads an element of a table `width` texels wide, a
        power of two."""
        first = f"{self.texels} * index" if self.texels > 1 else "index"
        reads = []
        for k in range(self.texels):
            at = f"{first} + {k}" if k else first
            where = f"ivec2(({at}) & {width - 1}, ({at}) >> {width.bit_length() - 1})"
            reads.append(f"texelFetch({table}, {where}, 0)")
        body = f"return unpack_{self.name}({', '.join(reads)});"
        return f"{self.name} {snake(self.name)}_at(int index) {{ {body} }}"

    def _places(self) -> Iterator[tuple[str, str, int, int]]:
        """Each field's name and type, its texel, and which of that one's channels is its first."""
        texel = at = 0
        for name, kind in self.fields.items():
            if at + _SIZES[kind] > CHANNELS:
                texel, at = texel + 1, 0
            yield name, kind, texel, at
            at += _SIZES[kind]


def snake(name: str) -> str:
    """CornerNormals -> corner_normals."""
    return "".join(f"_{c.lower()}" if c.isupper() else c for c in name).lstrip("_")
