# SPDX-License-Identifier: GPL-3.0-or-later
"""Read an image's pixels as a texture stores them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import bpy
import numpy as np
from numpy.typing import NDArray

from ...photon.backends.sizes import free_host_memory
from ...photon.errors import SceneError
from .colour_spaces import Space, colour_space_of, to_linear
from .texels import (
    as_floats,
    as_integers,
    associate,
    blacken_nonfinite,
    code_srgb,
    cut_to_half,
    halved,
    is_grey,
    is_opaque,
    restore,
    separate,
)

READ = 16 + 4  # [bytes] of a pixel while it is read: floats, and what becomes of them
# Formats of floats, which Cycles reads as such; others with more than 8 bits have integers.
FLOATS = ("OPEN_EXR", "OPEN_EXR_MULTILAYER", "HDR")
# Cycles multiplies by alpha what Alpha Mode says is straight, and nothing else.
BELIEVES_ALPHA_MODE = bpy.app.version >= (5, 2)
# Formats that it took before to hold colours not multiplied by alpha, whatever Alpha Mode says.
STRAIGHT = ("PNG", "TARGA", "TARGA_RAW", "DDS", "WEBP", "PSD", "BMP")


class Stored(NamedTuple):
    """What an image became."""

    pixels: NDArray[Any]
    is_srgb: bool
    nonfinite: int  # pixels that are not finite
    unknown: bool  # there was no way to convert its colours
    is_halved: bool


def read_pixels(image: bpy.types.Image, is_file: bool, clips: bool, limit: int) -> Stored:
    """Those that Blender has; `is_file`: Cycles reads the file itself; `clips`: there is nothing
    beyond its edges; `limit` [texels] of a side, 0: none. SceneError if there is no memory."""
    width, height = image.size
    check_memory(image, READ * width * height)
    floats = rgba_floats(image)
    space = colour_space_of(image.colorspace_settings)
    if image.is_float:
        nonfinite = blacken_nonfinite(floats)
        pixels, is_srgb = _of_floats(image, floats, space, is_file)
        unknown = False
    else:
        nonfinite = 0
        pixels, is_srgb, unknown = _of_bytes(image, floats, space, is_file)
    # Outside a clipped image of one channel Cycles finds opaque black, of others nothing.
    grey_file = is_file and image.depth == (32 if image.is_float else 8)
    if (grey_file or not clips) and is_grey(pixels):
        pixels = np.ascontiguousarray(pixels[..., :1])
    fewer = halved(pixels, limit) if limit else pixels
    return Stored(fewer, is_srgb, nonfinite, unknown, fewer is not pixels)


def check_memory(image: bpy.types.Image, needed: int) -> None:
    """Raise SceneError if there is no memory to read an image, which needs so much [bytes]."""
    width, height = image.size
    free = free_host_memory()
    if free is not None and needed > free:
        raise SceneError(
            f"image '{image.name}' of {width}x{height} pixels needs {needed / 1e9:.3g} GB to be "
            f"read and {free / 1e9:.3g} GB are free: give it fewer"
        )


def floats_of(image: bpy.types.Image) -> NDArray[np.float32]:
    """(height, width, channels) as Blender hands them out: bytes as they are stored, floats as
    linear colours."""
    width, height = image.size
    raw = np.empty(width * height * image.channels, np.float32)
    image.pixels.foreach_get(raw)
    return raw.reshape(height, width, image.channels)


def rgba_floats(image: bpy.types.Image) -> NDArray[np.float32]:
    """The same of four channels: one becomes grey, and alpha is 1 where there is none."""
    pixels = floats_of(image)
    height, width, channels = pixels.shape
    if channels == 4:
        return pixels
    whole = np.ones((height, width, 4), np.float32)
    if channels == 1:
        whole[..., :3] = pixels
    else:
        whole[..., 1:3] = 0.0
        whole[..., :channels] = pixels
    return whole


def file_of(image: bpy.types.Image) -> str:
    """The path of its file, with the marks of its tiles."""
    return str(bpy.path.abspath(image.filepath_raw, library=image.library))


@dataclass(frozen=True)
class _Alpha:
    """What becomes of an image's alpha."""

    ignored: bool = False
    counts: bool = False  # Blender's floats are multiplied by it; who converts colours divides them
    restored: bool = False  # Blender has divided what the file holds, and Cycles reads
    times: int = 0  # how often Cycles' colours are straight ones multiplied by it

    @staticmethod
    def of(image: bpy.types.Image, space: Space, is_file: bool) -> _Alpha:
        """As Cycles does: it reads files itself, and has its own word on those."""
        mode, kind = image.alpha_mode, image.file_format
        if mode == "NONE" or mode == "CHANNEL_PACKED" or space is Space.DATA:
            return _Alpha(mode == "NONE")
        is_multiplied = mode == "PREMUL"
        if not is_file:
            times = 1
            if BELIEVES_ALPHA_MODE:  # and not that Blender's own floats are multiplied, bytes not
                times = int(image.is_float) + int(not is_multiplied)
            return _Alpha(counts=True, times=times)
        times = 2 if is_multiplied and kind in STRAIGHT and not BELIEVES_ALPHA_MODE else 1
        is_left = kind in FLOATS and not BELIEVES_ALPHA_MODE
        if is_left or (kind == "PNG" and _has_two_channels(file_of(image))):
            times = int(is_multiplied)
        return _Alpha(counts=True, restored=is_multiplied, times=times)


def is_multiplied_once(image: bpy.types.Image) -> bool:
    """Whether floats are as Cycles has them."""
    is_file = image.source == "FILE" and not image.packed_file
    alpha = _Alpha.of(image, colour_space_of(image.colorspace_settings), is_file)
    return not alpha.counts or alpha.times == 1


def _has_two_channels(path: str) -> bool:
    """Whether a PNG file holds grey and alpha."""
    with open(path, "rb") as file:
        head = file.read(26)  # the last byte is the type of colours
    return head[25:] == b"\x04"


def _of_bytes(
    image: bpy.types.Image, floats: NDArray[np.float32], space: Space, is_file: bool
) -> tuple[NDArray[Any], bool, bool]:
    """The pixels, whether they are sRGB's, and whether they ought not to be."""
    alpha = _Alpha.of(image, space, is_file)
    if alpha.ignored:
        floats[..., 3] = 1.0
    if space is Space.OTHER:
        cut_to_half(floats, alpha.times, alpha.restored, alpha.counts, is_rounded=is_file)
        is_known = to_linear(image.colorspace_settings.name, floats.reshape(-1, 4))
        if alpha.counts:
            floats[..., :3] *= floats[..., 3:]
        if is_known:
            return as_floats(floats, exactly=False), False, False
        return as_integers(floats, np.uint8), True, True
    pixels = as_integers(floats, np.uint8)
    if alpha.times and not is_opaque(pixels):
        for time in range(alpha.times):
            associate(pixels, restores=alpha.restored and time == 0)
    return pixels, space is Space.SRGB, False


def _of_floats(
    image: bpy.types.Image, floats: NDArray[np.float32], space: Space, is_file: bool
) -> tuple[NDArray[Any], bool]:
    """The pixels, which Blender has made linear and multiplied by alpha, and whether they are coded
    as sRGB's again: files that are so are interpolated like that."""
    alpha = _Alpha.of(image, space, is_file)
    if alpha.ignored:
        floats[..., 3] = 1.0
    is_multiplied = alpha.counts
    is_srgb = is_file and space is Space.SRGB
    is_integer = is_file and image.file_format not in FLOATS and space is not Space.OTHER
    if is_multiplied and (is_srgb or is_integer or not alpha.times):
        separate(floats)
        is_multiplied = False
    if is_srgb:
        code_srgb(floats)
    times = alpha.times - is_multiplied
    if alpha.restored and times:
        restore(floats)
        times -= 1
    if is_integer and _is_within_one(floats):
        pixels = as_integers(floats, np.uint16)
        if not is_opaque(pixels):
            for _ in range(times):
                associate(pixels)
        return pixels, is_srgb
    for _ in range(times):
        floats[..., :3] *= floats[..., 3:]
    return as_floats(floats, exactly=space is Space.DATA), is_srgb


def _is_within_one(floats: NDArray[np.float32]) -> bool:
    """To rounding."""
    return bool(floats.min() >= 0.0 and floats.max() < 1.00001)
