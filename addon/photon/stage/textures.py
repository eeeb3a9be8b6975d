# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene's textures on a device: all as one list of words, which one sampler reads
(glsl/lib/image.glsl).

The list is rows of ROW words in the layers of an array, so its length is bounded by memory alone.
First come four words a texture: its first row, width and height, kind, and tile. Each texture's
texels begin a row.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...streams import Device
from ..errors import SceneError
from ..scene import Scene, Texture
from ..scene.snapshot import same

WORD = 4  # [bytes]
ROW, PAGE = 4096, 2048  # words of a row, rows of a layer; lib/image.glsl
HEAD = 4  # words
MOST_ROWS = 1 << 19  # words of more have no number in 31 bits
# Bits of a texture's kind (lib/image.glsl).
HAS_FOUR, IS_FLOAT, IS_SRGB = 4, 8, 16
TEXTURE_NODE = "image"  # whose instructions refer to textures, by their third operand


def rows_of(textures: Sequence[Texture]) -> list[int]:
    """The row that each begins, and the number of rows in all."""
    rows = [-(-HEAD * len(textures) // ROW)]
    rows += [-(-texture.pixels.nbytes // (WORD * ROW)) for texture in textures]
    return [int(row) for row in np.cumsum(rows)]


def bytes_of(textures: Sequence[Texture]) -> int:
    """What they take on a device; none: nothing."""
    if not textures:
        return 0
    rows = rows_of(textures)[-1]
    layers = -(-rows // PAGE)
    return WORD * ROW * (rows if layers == 1 else layers * PAGE)


def heads_of(textures: Sequence[Texture]) -> NDArray[np.uint32]:
    """(HEAD n,) the first words."""
    heads = np.zeros((len(textures), HEAD), np.uint32)
    for head, texture, first in zip(heads, textures, rows_of(textures), strict=False):
        height, width, channels = texture.pixels.shape
        kind = texture.pixels.itemsize.bit_length() - 1
        kind |= HAS_FOUR if channels == 4 else 0
        kind |= IS_FLOAT if texture.pixels.dtype.kind == "f" else 0
        head[:] = first, width | height << 16, kind | (IS_SRGB * texture.is_srgb), texture.tile
    return heads.reshape(-1)


class Texels:
    """Textures on a device."""

    def __init__(self, device: Device, textures: tuple[Texture, ...]) -> None:
        """`textures`: one at least; nothing is on the device before `upload`."""
        self._device, self._textures = device, textures
        self.array: Any = None  # moderngl.TextureArray

    @staticmethod
    def of(device: Device, scene: Scene, before: Texels | None) -> Texels | None:
        """Those of a scene, if it has any: the ones from before, if they are the same. What is
        `before` must not be used after that."""
        if before and before.are_of(scene):
            return before
        if before:
            before.release()
        if not scene.textures:
            return None
        texels = Texels(device, scene.textures)
        texels.upload()
        return texels

    def are_of(self, scene: Scene) -> bool:
        """Whether they are those of a scene."""
        return same(self._textures, scene.textures)

    def upload(self) -> None:
        """Send them; SceneError names the largest one if the device cannot hold so many."""
        rows, device = rows_of(self._textures), self._device
        layers = -(-rows[-1] // PAGE)
        if rows[-1] >= MOST_ROWS or layers > device.layer_limit:
            raise SceneError(
                f"the textures take {bytes_of(self._textures) / 1e9:.3g} GB, more than a texture "
                f"array of {device.name} holds: {advice(self._textures)}"
            )
        size = (ROW, rows[-1] if layers == 1 else PAGE, layers)
        self.array = device.texture_array(size, "u4")
        self._write(0, heads_of(self._textures))
        for texture, first in zip(self._textures, rows, strict=False):
            self._write(first, np.ascontiguousarray(texture.pixels).reshape(-1).view(np.uint8))

    def _write(self, first: int, data: NDArray[Any]) -> None:
        """Write words or bytes from the beginning of a row on."""
        for row, part in _parts(first, data.view(np.uint8)):
            height = part.size // (WORD * ROW)
            place = (0, row % PAGE, row // PAGE, ROW, height, 1)
            self.array.write(part, viewport=place)

    def release(self) -> None:
        """Free what they take: rarely are two lists of one size."""
        if self.array:
            self._device.free(self.array)
        self.array = None


def _parts(first: int, data: NDArray[np.uint8]) -> Iterator[tuple[int, NDArray[np.uint8]]]:
    """Whole rows of one layer each, by the first one's number; what is left of the last row is
    0."""
    row_bytes = WORD * ROW
    row, at = first, 0
    while data.size - at >= row_bytes:
        rows = min((data.size - at) // row_bytes, PAGE - row % PAGE)
        yield row, data[at : at + rows * row_bytes]
        row, at = row + rows, at + rows * row_bytes
    if at < data.size:
        rest = np.zeros(row_bytes, np.uint8)
        rest[: data.size - at] = data[at:]
        yield row, rest


def advice(textures: Sequence[Texture]) -> str:
    """What to do where they are too large."""
    largest = max(textures, key=lambda texture: texture.pixels.nbytes)
    height, width, _ = largest.pixels.shape
    return (
        f"set a texture limit (Simplify); the largest is {largest.name!r} with {width}x{height} "
        "texels"
    )


def check_textures(scene: Scene) -> None:
    """Raise SceneError naming whose program reads a texture that is not there."""
    for owner, program in scene.programs:
        for number, instruction in enumerate(program):
            if instruction.kind != TEXTURE_NODE:
                continue
            who = f"{owner}: instruction {number}, {TEXTURE_NODE}"
            operand = instruction.operands[2]
            if not isinstance(operand, tuple):
                raise SceneError(f"{who}: the number of its texture is no constant")
            first, last = int(operand[0]), int(operand[0]) + max(int(operand[1]), 1) - 1
            if first < 0 or last >= len(scene.textures):
                raise SceneError(f"{who}: texture {last} is none of {len(scene.textures)}")
