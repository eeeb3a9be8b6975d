# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of images as other programs write them; the first row is the lowest."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
from numpy.typing import NDArray

KINDS = {1: 0, 2: 4, 3: 2, 4: 6}  # of PNG's colours, by the number of channels


def write_png(path: Path, pixels: NDArray[Any]) -> Path:
    """uint8 or uint16 (height, width, 1 to 4)."""
    height, width, channels = pixels.shape
    rows = pixels[::-1].astype(f">u{pixels.itemsize}")
    raw = b"".join(b"\0" + row.tobytes() for row in rows)
    head = struct.pack(">IIBBBBB", width, height, 8 * pixels.itemsize, KINDS[channels], 0, 0, 0)
    parts = ((b"IHDR", head), (b"IDAT", zlib.compress(raw)), (b"IEND", b""))
    path.write_bytes(
        b"\x89PNG\r\n\x1a\n"
        + b"".join(
            struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
            for name, data in parts
        )
    )
    return path


def write_exr(path: Path, pixels: NDArray[Any]) -> Path:
    """float16 or float32 (height, width, 1, 3 or 4)."""
    top = np.ascontiguousarray(pixels[::-1])
    names = {1: "Y", 3: "RGB", 4: "RGBA"}
    channels = {names[pixels.shape[2]]: top[..., 0].copy() if pixels.shape[2] == 1 else top}
    OpenEXR.File({"type": OpenEXR.scanlineimage}, channels).write(str(path))
    return path


def write(path: Path, pixels: NDArray[Any]) -> Path:
    """Either, by the type of numbers."""
    kind = write_exr if pixels.dtype.kind == "f" else write_png
    return kind(path.with_suffix(".exr" if pixels.dtype.kind == "f" else ".png"), pixels)
