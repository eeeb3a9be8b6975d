# SPDX-License-Identifier: GPL-3.0-or-later
"""Read an Environment Texture: its pixels as they are, turned by the nodes that feed its vector."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np
from mathutils import Euler, Matrix
from numpy.typing import NDArray

from .colour_spaces import Space, colour_space_of, decoded
from .finer import finer, times_finer
from .links import Scope, is_given, source
from .pixels import check_memory, floats_of, is_multiplied_once

MOST_PIXELS = 8192 * 4096
ROWS_AT_ONCE = 64
ASSOCIATED = ("STRAIGHT", "PREMUL")  # modes in which Cycles multiplies colours by alpha


@dataclass(frozen=True)
class EnvironmentMap:
    """An image of all directions, and the rotation from the world's into it."""

    pixels: NDArray[np.float32]  # (height, width, 3)
    rows: NDArray[np.float64]  # (3, 3): what is the middle, a quarter to the left, and up in it
    downsampling: int = 1  # how many pixels, each way, became one
    is_finer: bool = False  # it stands for one that is not linear between its pixels


def read_environment_map(node: bpy.types.Node, scope: Scope) -> EnvironmentMap | None:
    """The image of an Environment Texture that is there; None if its pixels need more than a turn,
    are not linear colours or sRGB, or bytes that let something through: what becomes of those
    depends on their alpha mode."""
    image = node.image
    linear = image.is_float or colour_space_of(image.colorspace_settings) is not Space.OTHER
    if node.projection != "EQUIRECTANGULAR" or image.source not in ("FILE", "GENERATED"):
        return None
    matrix = _direction(node, scope)
    if matrix is None or not linear or min(image.size) < 1:
        return None
    lengths = np.linalg.norm(matrix, axis=1)
    if lengths.min() <= 0.0:
        return None
    rows = matrix / lengths.mean()
    if np.abs(rows @ rows.T - np.eye(3)).max() > 1e-5:
        return None
    linear_pixels = _linear_pixels(image, node.interpolation)
    if linear_pixels is None:
        return None
    pixels, downsampling, is_finer = linear_pixels
    if np.linalg.det(rows) < 0.0:  # a mirror image
        pixels, rows = np.ascontiguousarray(pixels[:, ::-1]), rows * [[1.0], [-1.0], [1.0]]
    return EnvironmentMap(pixels, rows, downsampling, is_finer)


def _linear_pixels(
    image: bpy.types.Image, interpolation: str
) -> tuple[NDArray[np.float32], int, bool] | None:
    """(height, width, 3), finite and not negative, the lowest row first; of large images the mean
    of so many pixels each way; whether there are more of them than the image has, as it is looked
    up. None: of bytes that let something through."""
    width, height = image.size
    step = 1
    while width * height > MOST_PIXELS * step * step:
        step += 1
    is_coded = not image.is_float and colour_space_of(image.colorspace_settings) is Space.SRGB
    # Cycles decodes what it has found between coded pixels.
    between = step == 1 and (interpolation != "Linear" or is_coded)
    times = times_finer(width, height) if between else 1
    between &= interpolation != "Linear" or times > 1
    rows, columns = times * (height // step), times * (width // step)
    spare = 4 * image.channels + 12 if between else 0
    check_memory(image, 4 * width * height * image.channels + (12 + spare) * rows * columns)
    pixels = floats_of(image)
    if _is_multiplied(image) and not pixels[..., 3].min() >= 1.0:
        return None
    if between:
        known = np.nan_to_num(pixels[..., :3], nan=0.0, posinf=0.0, neginf=0.0)
        pixels = finer(known, interpolation, times)
    found = np.empty((rows, columns, 3), np.float32)
    for low in range(0, rows, ROWS_AT_ONCE):  # large images are of gigabytes
        high = min(low + ROWS_AT_ONCE, rows)
        part = pixels[low * step : high * step, : columns * step]
        mean = _downsampled(_rgb(part, is_coded), step)
        finite = np.nan_to_num(mean, nan=0.0, posinf=0.0, neginf=0.0)
        np.maximum(finite, 0.0, out=found[low:high])
    return found, step, between


def _is_multiplied(image: bpy.types.Image) -> bool:
    """Whether Cycles multiplies what Blender tells by an alpha, before it decodes that."""
    has_alpha = image.channels == 4 and not (image.source == "FILE" and image.depth in (8, 24))
    if image.is_float:
        return has_alpha and not is_multiplied_once(image)
    return has_alpha and image.alpha_mode in ASSOCIATED


def _downsampled(pixels: NDArray[np.float32], step: int) -> NDArray[np.float32]:
    """Means of so many pixels each way: row by row, as numpy's own of two axes takes long."""
    if step == 1:
        return pixels
    height, width, channels = pixels.shape
    rows = pixels.reshape(height // step, step, width, channels)
    low = sum((rows[:, i] for i in range(1, step)), rows[:, 0])
    columns = low.reshape(height // step, width // step, step, channels)
    return np.asarray(sum((columns[:, :, i] for i in range(1, step)), columns[:, :, 0]) / step**2)


def _rgb(pixels: NDArray[np.float32], is_coded: bool) -> NDArray[np.float32]:
    """Linear colours (..., 3) of pixels of any channels; `is_coded`: of sRGB."""
    colours = pixels[..., :3] if pixels.shape[2] >= 3 else np.repeat(pixels[..., :1], 3, axis=2)
    if is_coded:
        colours = decoded(colours)
    return np.ascontiguousarray(colours, np.float32)


def _direction(node: bpy.types.Node, scope: Scope) -> NDArray[np.float64] | None:
    """What takes the world's directions to those that a texture looks up, if it is linear."""
    feeding, end, inner = source(node.inputs["Vector"], scope)
    if feeding is None:
        # A vector of its own, of a group's input, say, or of a Mapping, is the same everywhere.
        is_free = node.type != "MAPPING" and not is_given(node.inputs["Vector"], scope)
        return np.eye(3) if is_free else None
    if feeding.type == "TEX_COORD" and end.name == "Generated":
        return np.eye(3)
    if feeding.type == "MAPPING":
        before, own = _direction(feeding, inner), _mapping(feeding, inner)
        return None if before is None or own is None else own @ before
    return None


def _mapping(node: bpy.types.Node, scope: Scope) -> NDArray[np.float64] | None:
    """A Mapping node's matrix, if it moves nothing and scales all alike."""
    values = {}
    for name in ("Location", "Rotation", "Scale"):
        socket = node.inputs[name]
        feeding, end, _ = source(socket, scope)
        if feeding is not None or not hasattr(end, "default_value"):
            return None
        values[name] = np.array(end.default_value[:], np.float64)
    if node.vector_type in ("POINT", "TEXTURE") and values["Location"].any():
        return None
    turn = np.array(Matrix(Euler(values["Rotation"]).to_matrix()), np.float64)
    scale = np.diag(values["Scale"])
    if np.ptp(np.abs(values["Scale"])) > 1e-6 * np.abs(values["Scale"]).max():
        return None
    if node.vector_type == "TEXTURE":
        return np.asarray(scale @ turn.T)  # of equal lengths, the inverse but for the length
    return np.asarray(turn @ scale)
