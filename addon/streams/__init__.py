# SPDX-License-Identifier: GPL-3.0-or-later
"""A stream programming framework over OpenGL (Marino & Abbate, sec. 3). Knows no rendering.

A `Stream` is a fixed-size 2D array of records; a `Kernel` is a GLSL function that runs once an
element, reads streams and writes up to four. How that happens is the physical layer's business.
"""

from .compute import Compaction, Program, Scan
from .device import Device
from .host import HostKernel
from .kernel import TABLE_WIDTH, Items, Kernel, Table, Uniform
from .readback import Reading
from .source import StreamError
from .stream import TEXEL, PingPong, Record, Stream
from .tally import Tally

__all__ = [
    "TABLE_WIDTH",
    "TEXEL",
    "Compaction",
    "Device",
    "HostKernel",
    "Items",
    "Kernel",
    "PingPong",
    "Program",
    "Reading",
    "Record",
    "Scan",
    "Stream",
    "StreamError",
    "Table",
    "Tally",
    "Uniform",
]
