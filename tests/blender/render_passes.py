# SPDX-License-Identifier: GPL-3.0-or-later
"""Render the open scene by Blender, and read all passes of the picture."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
import OpenEXR
from numpy.typing import NDArray


def render_exr(scene: bpy.types.Scene, path: Path) -> dict[str, NDArray[np.float32]]:
    """Render; return every pass by name, row 0 at the top."""
    image = scene.render.image_settings
    if hasattr(image, "media_type"):
        image.media_type = "MULTI_LAYER_IMAGE"
    image.file_format, image.color_depth = "OPEN_EXR_MULTILAYER", "32"
    bpy.ops.render.render()
    bpy.data.images["Render Result"].save_render(str(path), scene=scene)
    passes: dict[str, dict[str, NDArray[np.float32]]] = {}
    for part in OpenEXR.File(str(path), separate_channels=True).parts:
        for name, channel in part.channels.items():
            layer, entry, component = name.rsplit(".", 2)
            key = entry if layer == "ViewLayer" else f"{layer}.{entry}"
            passes.setdefault(key, {})[component] = channel.pixels
    order = "RGBAXYZV"
    return {
        name: np.stack([found[key] for key in sorted(found, key=order.index)], axis=-1)
        for name, found in passes.items()
    }
