# SPDX-License-Identifier: GPL-3.0-or-later
"""What media emit as lamps, which diffuse surfaces, photons and what media scatter know it by: rays
of the eye and of lobes find it on their way (lib/glow.glsl)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..scene import RAY_BITS, Grid, Light, Medium, Scene, glow_light, triple

MOST_LAMPS = 4096  # of all media together, but one each at least
MOST_CELLS = 64  # of a medium's lamps, along the longest side of its box
# By so many cells along each axis a lamp's flux is summed up, and along the longest of a box.
FINER, LEAST_FINE = 4, 16
# Of a lamp, over the root of the mean squared distance of what it stands for from its middle: that
# of a ball.
RADIUS = (5 / 3) ** 0.5
NEGLIGIBLE = 1e-4  # of what a medium emits: lamps that bring less in all are none
INSIDE = 0.5  # of a turn
NUDGE = np.array((1.3e-7, 2.9e-7))  # of a box, by which columns miss edges

Array = NDArray[np.float64]


def lit_by_media(scene: Scene) -> Scene:
    """The scene with lamps in all media that emit, which have values or grids."""
    found = list(_glowing(scene))
    if not found:
        return scene
    most = max(MOST_LAMPS // len(found), 1)
    lamps = [
        replace(lamp, group=scene.surface_groups[surface] if scene.surface_groups else "")
        for medium, surface, corners in found
        for lamp in _lamps_of(scene.surfaces[surface], medium, corners, most)
    ]
    return replace(scene, lights=(*scene.lights, *lamps))


def _glowing(scene: Scene) -> Iterator[tuple[Medium, int, Array]]:
    """Media that emit, with the number of a surface that wears each and its corners (n, 3, 3); but
    such as diffuse rays do not meet."""
    for number, material in enumerate(scene.materials):
        if not material.medium.glows:
            continue
        wearing = scene.material == number
        for surface in np.unique(scene.surface[wearing]).tolist():
            if len(scene.visible) and not scene.visible[surface] & RAY_BITS["diffuse"]:
                continue
            own = scene.triangles[wearing & (scene.surface == surface)]
            corners = scene.vertices[own].astype(np.float64)
            if np.isfinite(corners).all():
                yield material.medium, surface, corners


def _lamps_of(name: str, medium: Medium, corners: Array, most: int) -> list[Light]:
    """In the cells of a box about triangles, so many at most."""
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    size = high - low
    if not size.min() > 0.0:
        return []
    for cells in range(MOST_CELLS, 0, -1):
        along = np.maximum(np.round(cells * size / size.max()), 1).astype(int)
        if along.prod() <= most:
            break
    finer = max(FINER, LEAST_FINE // cells)
    counts = along * finer
    middles = [low[x] + size[x] * (np.arange(counts[x]) + 0.5) / counts[x] for x in range(3)]
    inside = is_inside(corners, low, size, counts)  # (x, y, z)
    emission = np.zeros((*counts, 3))
    emission[inside] = medium.coefficients[2]
    if medium.grid:
        places = np.stack(np.meshgrid(*middles, indexing="ij"), axis=-1)[inside]
        emission[inside] = _between(medium.grid, places)
    flux = 4.0 * np.pi * emission * (size / counts).prod()
    blocks = [n for pair in zip(along, [finer] * 3, strict=True) for n in pair]

    def sums(values: Array) -> Array:
        found: Array = values.reshape(*blocks, -1).sum(axis=(1, 3, 5))
        return found.reshape(-1, values.shape[-1])

    of_lamps = sums(flux)
    weight = flux.mean(axis=-1, keepdims=True)
    whole = of_lamps.mean(axis=1)
    if not whole.sum() > 0.0:
        return []
    grid = np.stack(np.meshgrid(*middles, indexing="ij"), axis=-1)
    kept = whole > NEGLIGIBLE * whole.sum() / len(whole)
    mean = sums(weight * grid)[kept] / whole[kept, None]
    squares = sums(weight * (grid - (low + high) / 2) ** 2)[kept] / whole[kept, None]
    spread = np.maximum(squares - (mean - (low + high) / 2) ** 2, (size / counts) ** 2 / 12)
    radii = RADIUS * np.sqrt(spread.sum(axis=1))
    lost = whole.sum() / whole[kept].sum()
    return [
        glow_light(name, triple(place), triple(power * lost), float(radius))
        for place, power, radius in zip(mean, of_lamps[kept], radii, strict=True)
    ]


def is_inside(
    corners: Array, low: Array, size: Array, counts: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """(x, y, z) whether triangles (n, 3, 3), closed, are about the middles of the cells of a box:
    of all that are above one along z as many face up as down, and one more."""
    cell = size / counts
    a, b, c = (corners[:, x] for x in range(3))
    area = _cross(b - a, c - a)
    first, last = (
        np.clip(np.floor((end[:, :2] - low[:2]) / cell[:2] - 0.5).astype(int), -1, counts[:2] - 1)
        for end in (corners.min(axis=1) - NUDGE[0] * size, corners.max(axis=1))
    )
    wide = np.where((area != 0.0)[:, None], np.maximum(last - first, 0), 0)
    pairs = wide.prod(axis=1)
    which = np.repeat(np.arange(len(corners)), pairs)
    within = np.arange(len(which)) - np.repeat(np.cumsum(pairs) - pairs, pairs)
    column = first[which] + 1 + np.stack(np.divmod(within, wide[which, 1]), axis=-1)
    at = low[:2] + cell[:2] * (column + 0.5) + NUDGE * size[:2]
    v = _cross((b - a)[which], at - a[which, :2]) / area[which]
    u = _cross(at - a[which, :2], (c - a)[which]) / area[which]
    met = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0)
    which, column, u, v = which[met], column[met], u[met, None], v[met, None]
    height = (a[which] + u * (b - a)[which] + v * (c - a)[which])[:, 2]
    below = np.clip(np.ceil((height - low[2]) / cell[2] - 0.5).astype(int), 0, counts[2])
    turns = np.zeros((counts[0], counts[1], counts[2] + 1))
    np.add.at(turns, (column[:, 0], column[:, 1], below), np.sign(area[which]))
    above = turns.sum(axis=2, keepdims=True) - np.cumsum(turns, axis=2)
    found: NDArray[np.bool_] = np.abs(above[:, :, :-1]) > INSIDE
    return found


def _cross(a: Array, b: Array) -> Array:
    """(n,) z of the product of such as lie in xy."""
    found: Array = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return found


def _between(grid: Grid, places: Array) -> Array:
    """(n, 3) what a grid emits at places (n, 3), evenly between its own."""
    last = np.array(grid.emission.shape[2::-1]) - 1
    at = np.clip((places - grid.low) / (grid.high - grid.low), 0.0, 1.0) * last
    below = np.minimum(at.astype(int), last - 1)
    part = at - below
    found = np.zeros((len(places), 3))
    for corner in np.ndindex(2, 2, 2):
        x, y, z = (below + corner).T
        weight = np.where(corner, part, 1.0 - part).prod(axis=1)
        found += weight[:, None] * grid.emission[z, y, x]
    return found
