# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables on a device: textures TABLE_WIDTH texels wide."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from ...streams import TABLE_WIDTH, Device
from ..errors import SceneError

Textures = dict[str, moderngl.Texture]


def texels_of(table: NDArray[Any]) -> NDArray[np.float32]:
    """A table's elements as float32 (..., 4)."""
    return table.view(np.float32).reshape(-1, 4)


def upload_table(device: Device, data: NDArray[Any]) -> moderngl.Texture:
    """`data` (..., 4) float32 or (n,) uint32 as a texture TABLE_WIDTH texels wide."""
    texels = data.reshape(-1, 4) if data.dtype == np.float32 else data.reshape(-1, 1)
    rows = max(1, -(-len(texels) // TABLE_WIDTH))
    if rows > device.texture_limit:
        raise SceneError(
            f"{len(texels)} table entries do not fit a texture of {device.name} "
            f"({TABLE_WIDTH * device.texture_limit} at most)"
        )
    kind = "f4" if data.dtype == np.float32 else "u4"
    texture: moderngl.Texture = device.texture((TABLE_WIDTH, rows), texels.shape[1], kind)
    write_table(texture, texels)
    return texture


def write_table(texture: moderngl.Texture, texels: NDArray[Any]) -> None:
    """Write texels (n, channels) from a table's beginning; what is left of the last row is 0."""
    whole = len(texels) // TABLE_WIDTH
    if whole:
        texture.write(texels[: whole * TABLE_WIDTH], viewport=(0, 0, TABLE_WIDTH, whole))
    if whole < texture.size[1]:
        rest = np.zeros((TABLE_WIDTH, texels.shape[1]), texels.dtype)
        rest[: len(texels) - whole * TABLE_WIDTH] = texels[whole * TABLE_WIDTH :]
        texture.write(rest, viewport=(0, whole, TABLE_WIDTH, 1))
