# SPDX-License-Identifier: GPL-3.0-or-later
"""Compare two pictures by the means of 8x8 blocks away from edges."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from addon.photon.scene import Camera

BLOCK = 8  # [px]
# A neighbour pixel that lies this many pixels' width off the tangent plane is another surface.
OFF_PLANE = 0.5
BENT = 0.9  # cosine between neighbours' normals across a crease

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Difference:
    """Relative differences of block means, per block and channel."""

    signed: Floats  # (blocks, blocks, 3); NaN in blocks that were left out
    share: float  # of all blocks, those compared

    @property
    def sizes(self) -> Floats:
        """The absolute differences of the blocks compared."""
        return np.abs(self.signed[np.isfinite(self.signed)])

    @property
    def median(self) -> float:
        return float(np.median(self.sizes))

    @property
    def high(self) -> float:
        """The 95th percentile."""
        return float(np.percentile(self.sizes, 95))

    @property
    def bias(self) -> float:
        """The mean of the signed differences."""
        return float(np.nanmean(self.signed))


def compare(ours: Any, reference: Any, keep: Mask) -> Difference:
    """Differences relative to the reference (h, w, 3) in the blocks that `keep` marks."""
    return compare_means(block_means(ours), block_means(reference), keep)


def compare_means(a: Any, b: Any, keep: Mask) -> Difference:
    """The same of pictures of which only the means of blocks are there."""
    signed = np.where(keep[..., None] & (b > 0), a / np.where(b > 0, b, 1.0) - 1.0, np.nan)
    return Difference(signed, float(keep.mean()))


def block_means(image: Any) -> Floats:
    """(h, w, c) to (h / BLOCK, w / BLOCK, c)."""
    h, w, c = image.shape
    grid = np.asarray(image, np.float64).reshape(h // BLOCK, BLOCK, w // BLOCK, BLOCK, c)
    return grid.mean(axis=(1, 3))


def smooth_blocks(images: dict[str, Any], camera: Camera, margin: int) -> Mask:
    """Blocks without discontinuities, `margin` pixels around included."""
    edge = grown(discontinuities(images, camera), margin)
    h, w = edge.shape
    return ~edge.reshape(h // BLOCK, BLOCK, w // BLOCK, BLOCK).any(axis=(1, 3))


def discontinuities(images: dict[str, Any], camera: Camera) -> Mask:
    """Pixels at silhouettes or creases.

    From the passes Depth and Normal of a perspective camera. Cosines below BENT mark creases,
    neighbours off the tangent plane silhouettes, and so do normals that passes disagree about.
    """
    depth, normal = images["Depth"][..., 0].astype(float), images["Normal"].astype(float)
    h, w = depth.shape
    left, right, bottom, top = camera.window
    x = np.linspace(left, right, w, endpoint=False) + (right - left) / (2 * w)
    y = np.linspace(bottom, top, h, endpoint=False) + (top - bottom) / (2 * h)
    rays = np.stack([*np.meshgrid(x, y), -np.ones((h, w))], axis=-1)
    places = (rays * depth[..., None]) @ camera.matrix[:3, :3].T
    length = np.linalg.norm(normal, axis=-1)
    edge = length < BENT  # also where nothing is seen
    unit = normal / np.maximum(length, 1e-6)[..., None]
    pixel = depth * (right - left) / w
    for axis in (0, 1):
        first, second = _pairs(axis)
        step = places[second] - places[first]
        off = np.maximum(
            np.abs((step * unit[first]).sum(-1)), np.abs((step * unit[second]).sum(-1))
        )
        bent = (unit[first] * unit[second]).sum(-1) < BENT
        broken = bent | (off > OFF_PLANE * np.minimum(pixel[first], pixel[second]))
        edge[first] |= broken
        edge[second] |= broken
    return edge


def _pairs(axis: int) -> tuple[Any, Any]:
    """Indices of neighbours along an axis."""
    if axis == 0:
        return np.s_[:-1], np.s_[1:]
    return np.s_[:, :-1], np.s_[:, 1:]


def grown(mask: Mask, pixels: int) -> Mask:
    """The pixels within a square of `pixels` around those of the mask."""
    for axis in (0, 1):
        wider = mask.copy()
        for shift in range(1, pixels + 1):
            low, high = (np.s_[:-shift], np.s_[shift:])
            if axis == 1:
                low, high = (np.s_[:, :-shift], np.s_[:, shift:])
            wider[low] |= mask[high]
            wider[high] |= mask[low]
        mask = wider
    return mask
