# SPDX-License-Identifier: GPL-3.0-or-later
"""What emissive triangles radiate, as lights: in the mean, and, where their programs tell
differently from place to place or in some directions, how much of that there (a table,
glsl/lib/emission_share.glsl)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...streams import Device, Kernel
from ...streams.device import Layer
from ..kernels.surface_emission import SurfaceEmission
from ..scene import Scene
from .emissive import Doubles, Emission, emissive_triangles
from .geometry import Mesh
from .normals import unit
from .points import asked_at
from .programs import ProgramNeeds, of_emission

SAMPLES = 1 << 17  # of all triangles that are asked, about; of more than that fit, 24 to 32 each
SAMPLES_OF_MOVED = 1 << 13  # at each instant
MOST_CELLS = 64  # a triangle's side has
FEWEST = 4  # samples along a side
ANGLES = 9  # off the normal, of equal steps of the cosine from 0 to 1
GRAZING = 0.01  # a cosine, in place of 0
ANGLE_POINTS = 8  # of a triangle that tell what hangs on the angle; fewer where there are many
PROBED = 8  # triangles of a material that tell whether anything does
EVEN = 0.01  # what differs by less from the mean does not differ
AT_ONCE = 1 << 18  # samples
WIDTH = 1024  # of the streams that they are in
MOST_SHARES = 1 << 22  # texels: where all triangles have more they light evenly

_STEP = 1.0 / (ANGLES - 1)
_COSINES = np.arange(ANGLES) * _STEP
# How much of what a side emits evenly leaves about each, interpolated between them.
_ANGLE_WEIGHTS = 2.0 * _COSINES * _STEP
_ANGLE_WEIGHTS[0], _ANGLE_WEIGHTS[-1] = _STEP**2 / 3.0, _STEP * (1.0 - _STEP / 3.0)


def emission_of(
    device: Device,
    layer: Layer,
    mesh: Mesh,
    scene: Scene,
    textures: Mapping[str, Any],
    samples: int = SAMPLES,
) -> Emission:
    """What emissive triangles radiate. Programs are asked at so many points, of all together, of
    either side; `textures` are the tables that they read."""
    numbers = emissive_triangles(scene, mesh)
    of_triangle = scene.material[numbers]
    constant = np.array([material.emission for material in scene.materials]).reshape(-1, 3)
    even = Emission.even(constant[of_triangle])
    varying = [at for at, material in enumerate(scene.materials) if "emission" in material.varying]
    places = mesh.places_of(numbers)
    wanted = np.flatnonzero(np.isin(of_triangle, varying) & (places >= 0))
    if not len(wanted):
        return even
    needs = ProgramNeeds.of_some(scene, of_emission)
    kernel = SurfaceEmission(device, layer, needs.defines, made=needs.made)
    asked = _Asked(kernel, {name: textures[name] for name in kernel.tables}, mesh)
    grid = _Grid.of(len(wanted), samples)
    radiance, parts = even.radiance.copy(), []
    for material in varying:
        own = wanted[of_triangle[wanted] == material]
        turns = len(own) > 0 and asked.turns(places[own[:: -(-len(own) // PROBED)]])
        for some in grid.parts(own):
            mean, shares = asked.shares(places[some], grid, turns)
            radiance[some] = mean
            differs = (np.abs(shares - 1.0) > EVEN).any(axis=(1, 2))
            parts.append((some[differs], shares[differs], ANGLES if turns else 0))
    kernel.release()
    return _joined(radiance, parts, grid)


def _joined(radiance: Doubles, parts: list[Any], grid: _Grid) -> Emission:
    """With all shares, one after the other."""
    first, cells, angles = (np.zeros(len(radiance), np.intp) for _ in range(3))
    texels = sum(shares.shape[0] * shares.shape[1] for _, shares, _ in parts)
    if texels > MOST_SHARES:
        return Emission.even(radiance)
    table, end = np.ones((texels, 4), np.float32), 0
    for which, shares, turns in parts:
        begin, end = end, end + shares.shape[0] * shares.shape[1]
        first[which] = begin + shares.shape[1] * np.arange(len(which))
        cells[which], angles[which] = grid.cells, turns
        table[begin:end, :3] = shares.reshape(-1, 3)
    return Emission(radiance, first, cells, angles, table)


@dataclass(frozen=True)
class _Grid:
    """Cells of a triangle, and the points in them that are asked."""

    cells: int  # along a side
    own: NDArray[np.intp]  # (c, 2) those that lie in the triangle, at least by half
    weights: Doubles  # (c,) how much of each does
    points: Doubles  # (c, s, 2)
    angle_points: int  # that are asked at each angle

    @staticmethod
    def of(triangles: int, samples: int) -> _Grid:
        """Of so many triangles, by so many samples of all."""
        cells = min(max(math.isqrt(samples // (4 * triangles)), 1), MOST_CELLS)
        own = np.argwhere(np.add.outer(np.arange(cells), np.arange(cells)) < cells)
        is_half = own.sum(axis=1) == cells - 1
        count = max(2, -(-FEWEST // cells))
        inside = (np.indices((count, count)).reshape(2, -1).T + 0.5) / count
        points = np.repeat(inside[None], len(own), axis=0)
        folded = is_half[:, None] & (inside.sum(axis=1) > 1.0)
        points[folded] = 1.0 - points[folded]
        angle_points = min(max(samples // (2 * ANGLES * triangles), 1), ANGLE_POINTS)
        weights = np.where(is_half, 0.5, 1.0)
        return _Grid(cells, own, weights, (own[:, None] + points) / cells, angle_points)

    def parts(self, triangles: NDArray[np.intp]) -> list[NDArray[np.intp]]:
        """Some at a time."""
        count = max(1, AT_ONCE // (2 * self.points[..., 0].size))
        return [triangles[at : at + count] for at in range(0, len(triangles), count)]


@dataclass(frozen=True)
class _Asked:
    """A kernel that tells what triangles of a mesh radiate."""

    kernel: Kernel
    tables: Mapping[str, Any]
    mesh: Mesh

    def turns(self, places: NDArray[np.intp]) -> bool:
        """Whether what triangles radiate hangs on the angle."""
        return bool((np.abs(self._of_angles(places, ANGLE_POINTS) - 1.0) > EVEN).any())

    def shares(
        self, places: NDArray[np.intp], grid: _Grid, turns: bool
    ) -> tuple[Doubles, NDArray[np.float32]]:
        """What triangles at places (n,) of the mesh radiate in the mean (n, 3), and their shares
        (n, k, 3) as of Emission; `turns`: those of angles are among them."""
        count, samples, _ = grid.points.shape
        squared, turn = _sequence(count * samples)
        points = np.tile(grid.points.reshape(-1, 2), (2, 1))
        found = self._radiated(places, points, np.tile(squared, 2), np.tile(turn, 2))
        found = found.reshape(len(places), 2, count, samples, 3)
        if turns:
            of_angles = self._of_angles(places, grid.angle_points)
            expected = _between(of_angles, squared).reshape(len(places), 2, count, samples, 3)
            of_cells = _over(found.sum(axis=3), expected.sum(axis=3))
        else:
            of_angles, of_cells = np.ones((len(places), 2, 0, 3)), found.mean(axis=3)
        mean = np.einsum("nscj,c->nj", of_cells, grid.weights) / (2.0 * grid.weights.sum())
        shares = np.zeros((len(places), 2, grid.cells**2, 3))
        shares[:, :, grid.own @ (1, grid.cells)] = _over(of_cells, mean[:, None, None])
        beside = np.setdiff1d(np.arange(grid.cells**2), grid.own @ (1, grid.cells))
        shares[:, :, beside] = 1.0  # which no place is in
        both = np.concatenate([shares, of_angles], axis=2)
        return mean, both.reshape(len(places), -1, 3).astype(np.float32)

    def _of_angles(self, places: NDArray[np.intp], count: int) -> Doubles:
        """(n, 2, ANGLES, 3): at each angle over all of a side, of either, by so many points."""
        points = np.stack(_sequence(count), axis=1)
        folded = points.sum(axis=1) > 1.0
        points[folded] = 1.0 - points[folded]
        squared = np.repeat(1.0 - np.maximum(_COSINES, GRAZING) ** 2, count)
        turn = _sequence(ANGLES * count)[1]
        points = np.tile(points, (2 * ANGLES, 1))
        found = self._radiated(places, points, np.tile(squared, 2), np.tile(turn, 2))
        by_angle = found.reshape(len(places), 2, ANGLES, count, 3).mean(axis=3)
        mean = np.einsum("nsaj,a->nsj", by_angle, _ANGLE_WEIGHTS)[:, :, None]
        return np.where(mean > 0.0, _over(by_angle, mean), 1.0)

    def _radiated(
        self, places: NDArray[np.intp], points: Doubles, squared: Doubles, turn: Doubles
    ) -> Doubles:
        """(n, k, 3) what triangles radiate at points (k, 2), of whose half the first is on their
        fronts, in directions off the normal by an angle of this square of its sine (k,), turned
        about it."""
        triangles = self.mesh.triangles[places]
        a, b, c = (triangles[corner].astype(np.float64) for corner in "abc")
        normals, across = unit(np.cross(b - a, c - a)), unit(b - a)
        beside = np.cross(normals, across)
        sides = np.where(np.arange(len(points)) < len(points) // 2, 1.0, -1.0)
        local = np.stack(
            [
                np.sqrt(squared) * np.cos(2.0 * np.pi * turn),
                np.sqrt(squared) * np.sin(2.0 * np.pi * turn),
                np.sqrt(1.0 - squared) * sides,
            ]
        )
        toward = -np.einsum("jk,jnx->nkx", local, np.stack([across, beside, normals]))
        return self._ask(
            np.repeat(places, len(points)),
            np.tile(points, (len(places), 1)),
            toward.reshape(-1, 3),
        ).reshape(len(places), len(points), 3)

    def _ask(self, places: NDArray[np.intp], points: Doubles, toward: Doubles) -> Doubles:
        """(m, 3) for rays of directions (m, 3) that end at points (m, 2) of triangles (m,)."""
        width = min(len(places), WIDTH)
        padded = -(-len(places) // width) * width
        at = np.minimum(np.arange(padded), len(places) - 1).reshape(-1, width)
        found = asked_at(self.kernel, places[at], points[at], toward[at], self.tables)
        return found.reshape(-1, 3)[: len(places)].astype(np.float64)


def _sequence(count: int) -> tuple[Doubles, Doubles]:
    """Points of one that covers the square evenly (Roberts 2018)."""
    numbers = np.arange(count)[:, None] + 0.5
    squared, turn = (numbers * (0.7548776662, 0.5698402909)).T % 1.0
    return squared, turn


def _between(of_angles: Doubles, squared: Doubles) -> Doubles:
    """(n, 2, k, 3) shares at angles, as the table of (n, 2, ANGLES, 3) has them."""
    at = np.sqrt(1.0 - squared) * (ANGLES - 1)
    low = np.minimum(at.astype(int), ANGLES - 2)
    part = (at - low)[:, None]
    found: Doubles = of_angles[:, :, low] * (1.0 - part) + of_angles[:, :, low + 1] * part
    return found


def _over(a: Doubles, b: Doubles) -> Doubles:
    """a / b, or zero where b is."""
    b = np.broadcast_to(b, a.shape)
    found: Doubles = np.divide(a, b, where=b > 0.0, out=np.zeros(a.shape))
    return found
