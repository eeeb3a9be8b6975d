# SPDX-License-Identifier: GPL-3.0-or-later
"""Images of noise, and squares that show them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from .build import add_mesh, add_node, finish, new_material

SPAN = (-0.5, 1.5)  # of UV coordinates: texels' and pixels' edges meet for WIDTH x HEIGHT texels
WIDTH, HEIGHT = 4, 2
RANDOM = np.random.default_rng(1)


def noise(dtype: Any, channels: int, low: float = 0.6, high: float = 0.85) -> NDArray[Any]:
    found = RANDOM.uniform(low, high, (HEIGHT, WIDTH, channels))
    return (found * np.iinfo(dtype).max if np.dtype(dtype).kind == "u" else found).astype(dtype)


def load(path: Path, **settings: Any) -> bpy.types.Image:
    image = bpy.data.images.load(str(path))
    if name := settings.pop("space", None):
        image.colorspace_settings.name = name
    if settings.pop("packed", False):
        image.pack()
    for key, value in settings.items():
        setattr(image, key, value)
    return image


def textured(
    image: bpy.types.Image | None, kind: str = "ShaderNodeTexImage", **settings: Any
) -> tuple[Any, Any]:
    """A material whose diffuse colour is an image, and its Image Texture."""
    material, tree = new_material()
    node = tree.nodes.new(kind)
    node.image = image
    for key, value in settings.items():
        setattr(node, key, value)
    finish(tree, add_node(tree, "ShaderNodeBsdfDiffuse", Color=node.outputs["Color"]))
    return material, node


def quad(material: bpy.types.Material, at: tuple[float, float], span: Any) -> None:
    obj = add_mesh("Panel", location=(*at, 0.0))
    low, high = span
    layer = obj.data.uv_layers.new(name="UVMap")
    corners = [low, low, high, low, high, high, low, high]
    layer.uv.foreach_set("vector", np.array(corners, np.float32))
    obj.data.materials.append(material)
