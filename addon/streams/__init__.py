# SPDX-License-Identifier: GPL-3.0-or-later
"""A stream programming framework over OpenGL (Marino & Abbate, sec. 3). Knows no rendering.

A `Stream` is a fixed-size 2D array of records; a `Kernel` is a GLSL function that runs once an
element, reads streams and writes others; a `DrawKernel` draws items over the elements that they add
to. How that happens is the physical layer's business. Where a GPU would wait for few elements, a
stream holds several parts, one above the other, of which each may have uniforms of its own.
"""

from .by_defines import ByDefines
from .compute import Compaction, Program, Scan
from .count import Count
from .declaration import (
    MOST_PARTS,
    TABLE_WIDTH,
    Declaration,
    Defines,
    Items,
    OfParts,
    Ports,
    Table,
    Uniform,
    When,
    for_all_parts,
    in_registers,
    of_parts,
)
from .device import Device
from .draw import DrawKernel
from .host import HostKernel
from .kernel import Kernel
from .readback import Reading
from .record import Record
from .source import Made, StreamError
from .stream import TEXEL, PingPong, Stream
from .tally import Tally

__all__ = [
    "MOST_PARTS",
    "TABLE_WIDTH",
    "TEXEL",
    "ByDefines",
    "Compaction",
    "Count",
    "Declaration",
    "Defines",
    "Device",
    "DrawKernel",
    "HostKernel",
    "Items",
    "Kernel",
    "Made",
    "OfParts",
    "PingPong",
    "Ports",
    "Program",
    "Reading",
    "Record",
    "Scan",
    "Stream",
    "StreamError",
    "Table",
    "Tally",
    "Uniform",
    "When",
    "for_all_parts",
    "in_registers",
    "of_parts",
]
