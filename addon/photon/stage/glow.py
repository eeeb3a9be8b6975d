# SPDX-License-Identifier: GPL-3.0-or-later
"""What media emit as lamps, which diffuse surfaces, photons and what media scatter know it by: rays
of the eye and of lobes find it on their way (lib/glow.glsl)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..scene import RAY_BITS, Grid, Light, Medium, Scene, glow_light, triple
from .insides import alike, apart, inside_box, is_closed, is_flat, volume_of

MOST_LAMPS = 4096  # of all media together, but one at least for each part of a mesh
MOST_CELLS = 64  # of a part's lamps, along the longest side of its box
# By so many cells along each axis a lamp's flux is summed up, and along the longest of a box.
FINER, LEAST_FINE = 4, 16
# Of a lamp, over the root of the mean squared distance of what it stands for from its middle: that
# of a ball.
RADIUS = (5 / 3) ** 0.5
NEGLIGIBLE = 1e-4  # of what a part emits: lamps that bring less in all are none
FLAT = 1e-5  # of its longest side: so thick at least is what has an inside

Array = NDArray[np.float64]


@dataclass(frozen=True)
class _Part:
    """Triangles that hang together, with what is inside them."""

    medium: Medium
    surface: int
    corners: Array  # (n, 3, 3)
    volume: float  # 0: they are open, or several
    size: float  # of it, or of their box

    @staticmethod
    def of(medium: Medium, surface: int, corners: Array, is_whole: bool) -> _Part:
        """`is_whole`: they are one, and closed."""
        volume = volume_of(corners) if is_whole else 0.0
        box = float(np.prod(np.ptp(corners, axis=(0, 1))))
        return _Part(medium, surface, corners, volume, volume or box)


def lit_by_media(scene: Scene) -> Scene:
    """The scene with lamps in all media that emit, which have values or grids."""
    found = list(_glowing(scene))
    whole = sum(part.size for part in found)
    if not whole > 0.0:
        return scene
    groups = scene.surface_groups or ("",) * len(scene.surfaces)
    lamps = [
        replace(lamp, group=groups[part.surface])
        for part in found
        for lamp in _lamps_of(
            scene.surfaces[part.surface], part, max(int(MOST_LAMPS * part.size / whole), 1)
        )
    ]
    return replace(scene, lights=(*scene.lights, *lamps))


def _glowing(scene: Scene) -> Iterator[_Part]:
    """Parts of surfaces that wear media that emit; but such as diffuse rays do not meet."""
    glows = np.array([material.medium.glows for material in scene.materials], bool)
    if not glows.any():
        return
    own = np.flatnonzero(glows[scene.material])
    both = scene.material[own].astype(np.int64) * len(scene.surfaces) + scene.surface[own]
    for those in alike(both):
        some = own[those]
        surface = int(scene.surface[some[0]])
        medium = scene.materials[scene.material[some[0]]].medium
        if len(scene.visible) and not scene.visible[surface] & RAY_BITS["diffuse"]:
            continue
        corners = scene.vertices[scene.triangles[some]].astype(np.float64)
        if not np.isfinite(corners).all():
            continue
        _, places = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
        triangles = places.reshape(-1, 3)  # also of such as share places alone
        for one, is_one in apart(triangles, corners):
            own_corners = corners[one]
            longest = np.ptp(own_corners, axis=(0, 1)).max()
            if longest > 0.0 and not is_flat(own_corners.reshape(-1, 3), FLAT * longest):
                is_whole = is_one and is_closed(triangles[one])
                yield _Part.of(medium, surface, own_corners, is_whole)


def _lamps_of(name: str, part: _Part, most: int) -> list[Light]:
    """In the cells of a box about it, so many at most."""
    low, high = part.corners.min(axis=(0, 1)), part.corners.max(axis=(0, 1))
    size, middle = high - low, (low + high) / 2
    for cells in range(MOST_CELLS, 0, -1):
        along = np.maximum(np.round(cells * size / size.max()), 1).astype(int)
        if along.prod() <= most:
            break
    finer = max(FINER, LEAST_FINE // cells)
    counts = along * finer
    inside = inside_box(part.corners, low, size, counts)  # (x, y, z)
    if not inside.any():
        return _lamp_of(name, part)
    middles = [low[x] + size[x] * (np.arange(counts[x]) + 0.5) / counts[x] for x in range(3)]
    places = np.stack(np.meshgrid(*middles, indexing="ij"), axis=-1)
    emission = np.zeros((*counts, 3))
    emission[inside] = emitted_at(part.medium, places[inside])
    cell = (size / counts).prod()
    if part.volume:  # what is cut by its faces is in it or not
        cell = part.volume / inside.sum()
    flux = 4.0 * np.pi * emission * cell
    blocks = [n for pair in zip(along, [finer] * 3, strict=True) for n in pair]

    def sums(values: Array) -> Array:
        found: Array = values.reshape(*blocks, -1).sum(axis=(1, 3, 5))
        return found.reshape(-1, values.shape[-1])

    of_lamps, weight = sums(flux), flux.mean(axis=-1, keepdims=True)
    whole = of_lamps.mean(axis=1)
    kept = whole > NEGLIGIBLE * whole.sum() / len(whole)
    if not kept.any():
        return []
    mean = sums(weight * (places - middle))[kept] / whole[kept, None]
    squares = sums(weight * (places - middle) ** 2)[kept] / whole[kept, None]
    spread = np.maximum(squares - mean**2, (size / counts) ** 2 / 12)
    radii = RADIUS * np.sqrt(spread.sum(axis=1))
    powers = of_lamps[kept] * (whole.sum() / whole[kept].sum())
    return [
        glow_light(name, triple(place), triple(power), float(radius), part.surface)
        for place, power, radius in zip(mean + middle, powers, radii, strict=True)
    ]


def _lamp_of(name: str, part: _Part) -> list[Light]:
    """One as large as it, of what is thinner than cells are."""
    if not part.volume:
        return []
    place = part.corners.mean(axis=(0, 1))
    power = 4.0 * np.pi * emitted_at(part.medium, place[None])[0] * part.volume
    radius = float((part.volume * 3.0 / (4.0 * np.pi)) ** (1 / 3))
    found = glow_light(name, triple(place), triple(power), radius, part.surface)
    return [found] if power.any() else []


def emitted_at(medium: Medium, places: Array) -> Array:
    """(n, 3) what a medium emits at places (n, 3) in it."""
    if medium.grid:
        return _between(medium.grid, places)
    return np.broadcast_to(medium.coefficients[2], places.shape)


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
