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
ANGLES = 17  # off the normal, of equal steps of the cosine from 0 to 1
GRAZING = 0.01  # a cosine, in place of 0
ANGLE_POINTS = 8  # of a side that tell what hangs on the angle; fewer where there are many
PROBED = 8  # triangles of a material that tell whether anything does
EVEN = 0.01  # what differs by less from the mean does not differ
AT_ONCE = 1 << 18  # samples
WIDTH = 1024  # of the streams that they are in
MOST_SHARES = 1 << 20  # texels: of more triangles first the angles are left out, then all
MOST_OF_ONE = 1 + 2 * (MOST_CELLS**2 + ANGLES)  # and of a triangle

_STEP = 1.0 / (ANGLES - 1)
_COSINES = np.arange(ANGLES) * _STEP
_SQUARED_SINES = 1.0 - np.maximum(_COSINES, GRAZING) ** 2
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
    radiance: Doubles = constant[of_triangle]
    varying = np.array([material.emits_by_program for material in scene.materials], bool)
    places = mesh.places_of(numbers)
    wanted = np.flatnonzero(varying[of_triangle] & (places >= 0))
    if not len(wanted):
        return Emission.even(radiance)
    needs = ProgramNeeds.of_some(scene, of_emission)
    kernel = SurfaceEmission(device, layer, needs.defines, made=needs.made)
    asked = _Asked(kernel, {name: textures[name] for name in kernel.tables}, mesh)
    worn = np.unique(of_triangle[wanted])
    room, parts = MOST_SHARES // len(worn), []
    for material in worn:
        own = wanted[of_triangle[wanted] == material]
        found = asked.radiated(places[own], Grid.of(len(own), samples // len(worn), room))
        radiance[own] = found.mean
        parts.append((own, found))
    kernel.release()
    return _joined(radiance, parts)


def _joined(radiance: Doubles, parts: list[tuple[NDArray[np.intp], _Radiated]]) -> Emission:
    """With all shares, one after the other."""
    shares, tables, end = np.zeros(len(radiance), np.intp), [], 0
    for own, found in parts:
        table, which = found.table(), found.differs
        shares[own[which]] = end + 1 + table.shape[1] * np.arange(which.sum())
        tables.append(table.reshape(-1, 4))
        end += len(tables[-1])
    return Emission(radiance, shares, np.concatenate(tables))


@dataclass(frozen=True)
class _Radiated:
    """What triangles of one material radiate."""

    mean: Doubles  # (n, 3)
    cells: Doubles  # (n, 2, c, 3) shares of the mean, of each cell of the front and the back
    angles: Doubles  # (n, 2, a, 3) of those, at each angle; a is 0 where all are alike
    grid: Grid

    @property
    def differs(self) -> NDArray[np.bool_]:
        """(n,) which do not radiate evenly."""
        off = [np.abs(part - 1.0) > EVEN for part in (self.cells, self.angles)]
        lit = self.mean > 0.0
        by_place, by_angle = ((part & lit[:, None, None]).any(axis=(1, 2, 3)) for part in off)
        found: NDArray[np.bool_] = by_place | by_angle
        return found if self.grid.has_room else np.zeros(len(found), bool)

    def table(self) -> NDArray[np.float32]:
        """(d, k, 4) of those: how many cells a side and angles, then the shares."""
        which, count, angles = self.differs, self.grid.count, self.angles.shape[2]
        sides = np.ones((which.sum(), 2, count**2 + angles, 4), np.float32)
        sides[:, :, self.grid.own @ (1, count), :3] = self.cells[which]
        sides[:, :, count**2 :, :3] = self.angles[which]
        head = np.tile(np.array((count, angles, 0, 0), np.float32), (len(sides), 1, 1))
        both = sides.reshape(len(sides), 2 * (count**2 + angles), 4)
        return np.concatenate([head, both], axis=1)


@dataclass(frozen=True)
class Grid:
    """Cells of a triangle, and the points in them that are asked, of so many triangles."""

    count: int  # along a side
    own: NDArray[np.intp]  # (c, 2) those that lie in the triangle, at least by half
    weights: Doubles  # (c,) the share of it that each is
    points: Doubles  # (c, s, 2)
    triangles: int
    room: int  # for the shares of all [texels]

    @staticmethod
    def of(triangles: int, samples: int, room: int = MOST_SHARES) -> Grid:
        """Of so many triangles, by so many samples of all."""
        count = min(max(math.isqrt(samples // (4 * triangles)), 1), MOST_CELLS)
        own = np.argwhere(np.add.outer(np.arange(count), np.arange(count)) < count)
        is_half = own.sum(axis=1) == count - 1
        side = max(2, -(-FEWEST // count))
        points = np.where(is_half[:, None, None], _in_half(side), _in_whole(side))
        weights = np.where(is_half, 1.0, 2.0) / count**2
        return Grid(count, own, weights, (own[:, None] + points) / count, triangles, room)

    @property
    def all_points(self) -> Doubles:
        """(c s, 2)."""
        return self.points.reshape(-1, 2)

    def of_cells(self, found: Doubles) -> Doubles:
        """The means (n, 2, c, 3) of what is found at all points (n, 2, c s, 3)."""
        cells, points, _ = self.points.shape
        means: Doubles = found.reshape(len(found), 2, cells, points, 3).mean(axis=3)
        return means

    @property
    def has_room(self) -> bool:
        """Whether the shares of all triangles' cells fit."""
        return self.triangles * (1 + 2 * self.count**2) <= self.room

    @property
    def has_room_for_angles(self) -> bool:
        """Whether those of their angles do, too."""
        return self.triangles * (1 + 2 * (self.count**2 + ANGLES)) <= self.room

    def parts(self) -> list[slice]:
        """Of the triangles, some at a time."""
        at_once = max(1, AT_ONCE // (2 * len(self.all_points)))
        return [slice(at, at + at_once) for at in range(0, self.triangles, at_once)]


def _in_whole(side: int) -> Doubles:
    """(side^2, 2) points of a square, evenly."""
    found: Doubles = (np.indices((side, side)).reshape(2, -1).T + 0.5) / side
    return found


def _in_half(side: int) -> Doubles:
    """(side^2, 2) of the triangle below its diagonal: middles of triangles alike."""
    low, high = (_in_whole(side) + (shift - 0.5) / side for shift in (1.0 / 3.0, 2.0 / 3.0))
    found: Doubles = np.concatenate([low[low.sum(axis=1) < 1.0], high[high.sum(axis=1) < 1.0]])
    return found


@dataclass(frozen=True)
class _Asked:
    """A kernel that tells what triangles of a mesh radiate."""

    kernel: Kernel
    tables: Mapping[str, Any]
    mesh: Mesh

    def radiated(self, places: NDArray[np.intp], grid: Grid) -> _Radiated:
        """What triangles of a material at places (n,) of the mesh radiate."""
        squared, azimuth = _sequence(len(grid.all_points))
        wanted = min(ANGLE_POINTS, len(squared), max(AT_ONCE // (2 * ANGLES * len(places)), 1))
        cells, bright = [], []  # and the brightest points of a side
        for some in grid.parts():
            found = self._ask(places[some], grid.all_points, squared, azimuth)
            order = np.argsort(-found.sum(axis=3), axis=2, kind="stable")
            bright.append(order[:, :, :wanted])
            cells.append(grid.of_cells(found))
        radiance, points = np.concatenate(cells), grid.all_points[np.concatenate(bright)]
        level = np.einsum("nscj,c->nsj", radiance, grid.weights)
        angles = np.ones((len(places), 2, 0, 3))
        if grid.has_room_for_angles:
            probed = np.argsort(-level.sum(axis=(1, 2)), kind="stable")[:PROBED]
            if (np.abs(self._of_angles(places[probed], points[probed]) - 1.0) > EVEN).any():
                angles = np.concatenate(
                    [self._of_angles(places[some], points[some]) for some in grid.parts()]
                )
                level, radiance = self._by_angle(places, grid, level, angles)
        mean = level.mean(axis=1)
        return _Radiated(mean, _over(radiance, mean[:, None, None]), angles, grid)

    def _by_angle(
        self, places: NDArray[np.intp], grid: Grid, level: Doubles, angles: Doubles
    ) -> tuple[Doubles, Doubles]:
        """What sides radiate in the mean (n, 2, 3), and their cells (n, 2, c, 3), where it hangs on
        the angle as `angles` say: by `level`, of points each in another direction. Cells are
        compared in the one in which most leaves."""
        squared, azimuth = _sequence(len(grid.all_points))
        of_points = np.repeat(grid.weights, grid.points.shape[1]) / grid.points.shape[1]
        expected = np.einsum("nsaj,a->nsj", angles, of_points @ _between(squared))
        level = _over(level, expected)
        cells = []
        for some in grid.parts():
            most = angles[some].sum(axis=3).argmax(axis=2)
            most_squared = _SQUARED_SINES[most][..., None]
            cells.append(
                grid.of_cells(self._ask(places[some], grid.all_points, most_squared, azimuth))
            )
        radiance = np.concatenate(cells)
        mean = np.einsum("nscj,c->nsj", radiance, grid.weights)[:, :, None]
        return level, np.where(mean > 0.0, _over(radiance, mean), 1.0) * level[:, :, None]

    def _of_angles(self, places: NDArray[np.intp], points: Doubles) -> Doubles:
        """(n, 2, ANGLES, 3): at each angle over all of a side, by points (n, 2, p, 2) of both."""
        count = points.shape[2]
        squared = np.repeat(_SQUARED_SINES, count)
        _, azimuth = _sequence(ANGLES * count)
        at = np.tile(points, (1, 1, ANGLES, 1))
        found = self._ask(places, at, squared, azimuth)
        by_angle = found.reshape(len(places), 2, ANGLES, count, 3).mean(axis=3)
        mean = np.einsum("nsaj,a->nsj", by_angle, _ANGLE_WEIGHTS)[:, :, None]
        return np.where(mean > 0.0, _over(by_angle, mean), 1.0)

    def _ask(
        self, places: NDArray[np.intp], points: Doubles, squared: Doubles, azimuth: Doubles
    ) -> Doubles:
        """(n, 2, k, 3) what the fronts and backs of triangles radiate at points (n, 2, k, 2) in
        directions off the normal by an angle of a square of the sine (n, 2, k), of an azimuth (k,);
        of the former axes may be missing or one."""
        triangles, count = self.mesh.triangles[places], len(azimuth)
        a, b, c = (triangles[corner].astype(np.float64) for corner in "abc")
        normals, across = unit(np.cross(b - a, c - a)), unit(b - a)
        turn = 2.0 * np.pi * azimuth
        sine, sides = np.sqrt(squared), np.array((1.0, -1.0))[None, :, None]
        local = np.cos(turn) * sine, np.sin(turn) * sine, np.sqrt(1.0 - squared) * sides
        axes = across, np.cross(normals, across), normals
        toward = -sum(
            x[..., None] * axis[:, None, None] for x, axis in zip(local, axes, strict=True)
        )
        shape = len(places), 2, count
        rays = np.broadcast_to(toward, (*shape, 3)).reshape(-1, 3)
        at = np.broadcast_to(points, (*shape, 2)).reshape(-1, 2)
        of_points = np.repeat(places, 2 * count)
        width = min(len(rays), WIDTH)
        whole = -(-len(rays) // width) * width  # the last one again, up to a whole row
        which = np.minimum(np.arange(whole), len(rays) - 1).reshape(-1, width)
        found = asked_at(self.kernel, of_points[which], at[which], rays[which], self.tables)
        return found.reshape(-1, 3)[: len(rays)].astype(np.float64).reshape(*shape, 3)


def _sequence(count: int) -> tuple[Doubles, Doubles]:
    """Points of one that covers the square evenly (Roberts 2018)."""
    numbers = np.arange(count)[:, None] + 0.5
    squared, azimuth = (numbers * (0.7548776662, 0.5698402909)).T % 1.0
    return squared, azimuth


def _between(squared: Doubles) -> Doubles:
    """(k, ANGLES) how much each angle counts, by squares of the sine (k,)."""
    at = np.sqrt(1.0 - squared) * (ANGLES - 1)
    found: Doubles = np.maximum(0.0, 1.0 - np.abs(at[:, None] - np.arange(ANGLES)))
    return found


def _over(a: Doubles, b: Doubles) -> Doubles:
    """a / b, or zero where b is."""
    b = np.broadcast_to(b, a.shape)
    found: Doubles = np.divide(a, b, where=b > 0.0, out=np.zeros(a.shape))
    return found
