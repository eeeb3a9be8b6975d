# SPDX-License-Identifier: GPL-3.0-or-later
"""Picture files without Blender: 8-bit PNG and multilayer OpenEXR."""

from __future__ import annotations

import os
import struct
import tempfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import RenderError
from .blocks import in_blocks

LAYER = "ViewLayer"  # Blender's default view layer, so that readers find the same channel names
_CHANNELS = {"Depth": "Z", "Error": "X", "Illuminance": "X", "Mist": "Z"}
_CHANNELS |= {"Normal": "XYZ", "Denoising Normal": "XYZ"}


def check_writable(path: Path) -> None:
    """Raise RenderError now if `path` can't be written later."""
    if path.suffix.lower() not in (".png", ".exr"):
        raise RenderError(f"{path}: the name must end in .png or .exr")
    if path.is_dir():
        raise RenderError(f"{path}: is a folder")
    folder = path.parent
    if not folder.is_dir():
        raise RenderError(f"{path}: no folder {folder}")
    try:
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise RenderError(f"{path}: cannot be written ({error.strerror})") from error


def write_picture(
    path: Path, images: Mapping[str, NDArray[np.float32]], metadata: Mapping[str, Any]
) -> None:
    """Write a .png (sRGB of Combined) or .exr (float32, every pass) in one step or not at all."""
    partial = path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")
    try:
        if path.suffix.lower() == ".exr":
            _write_exr(partial, images, metadata)
        else:
            partial.write_bytes(_png(images["Combined"]))
        os.replace(partial, path)
    except (OSError, RuntimeError) as error:  # OpenEXR raises the latter
        raise RenderError(f"{path}: cannot be written ({error})") from error
    finally:
        partial.unlink(missing_ok=True)


def _png(combined: NDArray[np.float32]) -> bytes:
    """RGBA with straight alpha under the sRGB transfer function (Blender's Standard view)."""
    pixels, flipped = np.empty(combined.shape, np.uint8), combined[::-1]

    def work(rows: slice) -> None:
        pixels[rows] = _srgb(flipped[rows].astype(np.float64))

    in_blocks(combined.shape, work)
    return encode_png(pixels)


def _srgb(rgba: NDArray[np.float64]) -> NDArray[np.uint8]:
    alpha = np.clip(rgba[..., 3:], 0.0, 1.0)
    linear = np.clip(
        np.divide(rgba[..., :3], alpha, where=alpha > 0, out=np.zeros_like(rgba[..., :3])), 0, 1
    )
    encoded = np.where(linear <= 0.0031308, linear * 12.92, 1.055 * linear ** (1 / 2.4) - 0.055)
    srgb: NDArray[np.uint8] = (np.concatenate([encoded, alpha], -1) * 255.0 + 0.5).astype(np.uint8)
    return srgb


def encode_png(pixels: NDArray[np.uint8]) -> bytes:
    """A PNG file of (h, w, 3) or (h, w, 4) sRGB bytes, row 0 at the top."""
    height, width, channels = pixels.shape
    rows = np.zeros((height, 1 + width * channels), np.uint8)  # a row's first byte: no filter
    rows[:, 1:] = pixels.reshape(height, -1)
    kind = {3: 2, 4: 6}[channels]

    def chunk(name: bytes, data: bytes) -> bytes:
        return (
            struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
        )

    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, kind, 0, 0, 0))
        + chunk(b"IDAT", zlib.compress(rows.tobytes(), 6))
        + chunk(b"IEND", b"")
    )


def _write_exr(
    path: Path, images: Mapping[str, NDArray[np.float32]], metadata: Mapping[str, Any]
) -> None:
    import OpenEXR  # only EXR output needs it

    channels = {}
    for name, image in images.items():
        for at, letter in enumerate(_CHANNELS.get(name, "RGBA")[: image.shape[2]]):
            channels[f"{LAYER}.{name}.{letter}"] = np.ascontiguousarray(np.flipud(image[..., at]))
    header: dict[str, Any] = {
        "compression": OpenEXR.ZIP_COMPRESSION,
        "type": OpenEXR.scanlineimage,
    }
    header |= {f"photon_stream.{name}": str(value) for name, value in metadata.items()}
    OpenEXR.File(header, channels).write(str(path))
