# SPDX-License-Identifier: GPL-3.0-or-later
"""Export hair curves as tubes and point clouds as balls, of triangles."""

from __future__ import annotations

from dataclasses import dataclass, field

import bpy
import numpy as np
from numpy.typing import NDArray

from .triangles import read, unit

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
NO_SLOTS = np.zeros(0, np.int32)

STRANDS = ("CURVES", "POINTCLOUD")
SIDES = 8  # of a tube
SUBDIVISIONS = 2  # pieces between two points of a curve
MOST_POINTS = 100_000  # of 32 triangles; if curves have more, these have 6
RADIUS = {"CURVES": 0.005, "POINTCLOUD": 0.01}  # [m] without an attribute, as in Cycles
MOST_BALLS = 20_000  # of 80 triangles; if there are more they have 20

# By an attribute's type, what its elements call their value, and how many numbers that is.
TYPES = {
    "FLOAT": ("value", 1),
    "INT": ("value", 1),
    "INT8": ("value", 1),
    "BOOLEAN": ("value", 1),
    "FLOAT2": ("vector", 2),
    "FLOAT_VECTOR": ("vector", 3),
    "FLOAT_COLOR": ("color", 4),
    "BYTE_COLOR": ("color", 4),
    "QUATERNION": ("value", 4),
}


@dataclass(frozen=True)
class Strands:
    """Triangles that stand for curves, or for points, each of them a curve of its own."""

    vertices: NDArray[np.float32]  # (V, 3)
    normals: NDArray[np.float32]  # (V, 3)
    triangles: Ints  # (T, 3)
    place: Floats  # (V,) where on the points one is: at 2.5 between the third and the fourth
    points: Floats  # (P, 3)
    radii: Floats  # (P,)
    firsts: Ints  # (C + 1,) the first point of each curve, and how many points there are
    slots: Ints = field(default_factory=NO_SLOTS.copy)  # (C,) of materials; none: the first

    @property
    def curve(self) -> Ints:
        """(V,), whose vertices these are."""
        found = np.searchsorted(self.firsts, self.place, "right") - 1
        return found.clip(0, max(len(self.firsts) - 2, 0)).astype(np.int32)

    def along(self, values: Floats) -> Floats:
        """Numbers of points (P, n) at triangles' corners (T, 3, n)."""
        before = np.floor(self.place).astype(np.int64)
        share = (self.place - before)[:, None]
        after = np.minimum(before + 1, len(values) - 1)
        found: Floats = ((1.0 - share) * values[before] + share * values[after])[self.triangles]
        return found

    def of_curves(self, values: Floats) -> Floats:
        """Numbers of curves (C, n) at triangles' corners (T, 3, n)."""
        return values[self.curve[self.triangles]]


def strands_of(obj: bpy.types.Object) -> Strands:
    """What stands for an evaluated object of STRANDS."""
    data, count = obj.data, len(obj.data.points)
    points, radii = np.zeros((0, 3)), np.full(count, RADIUS[obj.type])
    if count:
        points = read_numbers(data, "position", "vector", 3 * count).reshape(-1, 3)
    if count and "radius" in data.attributes:
        radii = read_numbers(data, "radius", "value", count)
    if obj.type == "POINTCLOUD":
        return balls(points, radii)
    firsts = np.zeros(len(data.curves) + 1, np.int32)
    if count:
        data.curve_offset_data.foreach_get("value", firsts)
    return tubes(points, radii, firsts)


def balls(points: Floats, radii: Floats) -> Strands:
    """Balls about points (N, 3) of radii (N,): as wide, in the mean over all sides, as spheres."""
    unit, triangles = _ball(len(points) <= MOST_BALLS)
    corners = unit[triangles]
    sides = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = 0.5 * np.linalg.norm(sides, axis=1).sum()
    wide = np.sqrt(4.0 * np.pi / area)  # a convex body is seen as a quarter of its area (Cauchy)
    vertices = points[:, None] + (wide * radii)[:, None, None] * unit
    normals = np.broadcast_to(unit, vertices.shape)
    numbers = len(unit) * np.arange(len(points), dtype=np.int32)[:, None, None] + triangles
    return Strands(
        _flat(vertices),
        _flat(normals),
        numbers.reshape(-1, 3).astype(np.int32),
        np.repeat(np.arange(float(len(points))), len(unit)),
        points,
        radii,
        np.arange(len(points) + 1, dtype=np.int32),
    )


def tubes(points: Floats, radii: Floats, firsts: Ints, pieces: int = SUBDIVISIONS) -> Strands:
    """Tubes along curves, each of which has points (P, 3) from its first one, (C + 1,), to the next
    one's, of `pieces` between two: as wide, in the mean over all sides, as round ones."""
    lengths = np.diff(firsts)
    sides, pieces = (SIDES, pieces) if len(points) <= MOST_POINTS else (3, 1)
    none = np.zeros((0, 3), np.float32)
    found = [(none, none, np.zeros((0, 3), np.int32), np.zeros(0))]
    first = 0
    for length in np.unique(lengths[lengths > 1]):  # all of one length at once
        at = firsts[:-1][lengths == length][:, None] + np.arange(length)
        smooth = _smooth(np.concatenate([points[at], radii[at][..., None]], axis=2), pieces)
        radius = np.maximum(smooth[..., 3], 0.0)
        vertices, normals, triangles = _rings(smooth[..., :3], radius, sides)
        place = at[:, :1] + np.arange(smooth.shape[1]) / pieces
        place = np.repeat(place.reshape(-1), sides)
        found.append((vertices, normals, triangles + np.int32(first), place))
        first += len(vertices)
    vertices, normals, triangles, place = (
        np.concatenate(parts) for parts in zip(*found, strict=True)
    )
    return Strands(vertices, normals, triangles, place, points, radii, firsts)


def _smooth(values: Floats, pieces: int) -> Floats:
    """Curves (C, P, 4) with points between theirs, by Catmull and Rom."""
    before = np.concatenate([2.0 * values[:, :1] - values[:, 1:2], values[:, :-1]], axis=1)
    after = np.concatenate([values[:, 1:], 2.0 * values[:, -1:] - values[:, -2:-1]], axis=1)
    slopes = 0.5 * (after - before)
    found = []
    for t in np.arange(pieces) / pieces:
        a, b = values[:, :-1], values[:, 1:]
        found.append(
            (2.0 * t**3 - 3.0 * t**2 + 1.0) * a
            + (t**3 - 2.0 * t**2 + t) * slopes[:, :-1]
            + (3.0 * t**2 - 2.0 * t**3) * b
            + (t**3 - t**2) * slopes[:, 1:]
        )
    between = np.stack(found, axis=2).reshape(len(values), -1, values.shape[2])
    return np.concatenate([between, values[:, -1:]], axis=1)


def _rings(
    points: Floats, radii: Floats, sides: int
) -> tuple[NDArray[np.float32], NDArray[np.float32], Ints]:
    """Tubes about lines (C, P, 3)."""
    curves, count = radii.shape
    ways = unit(np.gradient(points, axis=1))
    least = np.eye(3)[np.abs(ways[:, 0]).argmin(axis=1)]
    carried = [unit(np.cross(ways[:, 0], least))]
    for here in ways.transpose(1, 0, 2)[1:]:  # carried along without a twist
        carried.append(unit(carried[-1] - (carried[-1] * here).sum(axis=1, keepdims=True) * here))
    across = np.stack(carried, axis=1)
    up = np.cross(ways, across)
    turns = 2.0 * np.pi * np.arange(sides) / sides
    normals = np.cos(turns)[:, None] * across[:, :, None] + np.sin(turns)[:, None] * up[:, :, None]
    # A polygon's mean width is its perimeter over pi.
    wide = np.pi / (sides * np.sin(np.pi / sides))
    vertices = points[:, :, None] + wide * radii[..., None, None] * normals
    ring, side = np.meshgrid(np.arange(count - 1), np.arange(sides), indexing="ij")
    following = (side + 1) % sides
    a, b = ring * sides + side, ring * sides + following
    c, d = a + sides, b + sides
    one = np.stack([np.stack([a, b, d], -1), np.stack([a, d, c], -1)], axis=2).reshape(-1, 3)
    numbers = count * sides * np.arange(curves)[:, None, None] + one
    return _flat(vertices), _flat(normals), numbers.reshape(-1, 3).astype(np.int32)


def _ball(is_fine: bool) -> tuple[Floats, Ints]:
    """An icosahedron's vertices on the unit sphere and its triangles, each maybe cut into four."""
    golden = (1.0 + 5.0**0.5) / 2.0
    flat = [(0.0, x, y * golden) for x in (-1.0, 1.0) for y in (-1.0, 1.0)]
    vertices = unit(np.array([np.roll(p, k) for k in range(3) for p in flat]))
    near = np.linalg.norm(vertices[:, None] - vertices, axis=2)
    edge = near[near > 1e-6].min() * 1.01
    touching = [(i, j) for i in range(12) for j in range(i + 1, 12) if near[i, j] < edge]
    triangles = [
        (i, j, k)
        for i, j in touching
        for k in range(j + 1, 12)
        if max(near[i, k], near[j, k]) < edge
    ]
    if is_fine:
        numbers = {pair: 12 + number for number, pair in enumerate(touching)}
        middles = [vertices[i] + vertices[j] for i, j in touching]
        vertices = np.concatenate([vertices, unit(np.array(middles))])
        cut = []
        for i, j, k in triangles:
            ij, jk, ik = numbers[i, j], numbers[j, k], numbers[i, k]
            cut += [(i, ij, ik), (j, jk, ij), (k, ik, jk), (ij, jk, ik)]
        triangles = cut
    found = np.array(triangles, np.int32)
    corners = vertices[found]
    outwards = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    turned = (outwards * corners.sum(axis=1)).sum(axis=1) < 0.0
    found[turned] = found[turned][:, ::-1]
    return vertices, found


def read_numbers(data: bpy.types.ID, name: str, field: str, count: int) -> Floats:
    """Return `count` numbers of an attribute, of what its elements call `field`."""
    return read(data.attributes[name].data, field, count).astype(np.float64)


def _flat(values: Floats) -> NDArray[np.float32]:
    return np.ascontiguousarray(values.reshape(-1, 3), np.float32)
