# SPDX-License-Identifier: GPL-3.0-or-later
"""Export hair curves as tubes and point clouds as balls, of triangles."""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
# Vertices, normals of vertices, and triangles of them.
Parts = tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.int32]]

STRANDS = ("CURVES", "POINTCLOUD")
SIDES = 8  # of a tube
SUBDIVISIONS = 2  # pieces between two points of a curve
MOST_POINTS = 100_000  # of 32 triangles; if curves have more, these have 6
RADIUS = {"CURVES": 0.005, "POINTCLOUD": 0.01}  # [m] without an attribute, as in Cycles
MOST_BALLS = 20_000  # of 80 triangles; if there are more they have 20


def strand_parts(obj: bpy.types.Object) -> Parts:
    """The triangles of an evaluated object of STRANDS."""
    data, count = obj.data, len(obj.data.points)
    if not count:
        none = np.zeros((0, 3), np.float32)
        return none, none, np.zeros((0, 3), np.int32)
    points = _attribute(data, "position", "vector", 3 * count).reshape(-1, 3)
    radii = np.full(count, RADIUS[obj.type])
    if "radius" in data.attributes:
        radii = _attribute(data, "radius", "value", count)
    if obj.type == "POINTCLOUD":
        return balls(points, radii)
    firsts = np.empty(len(data.curves) + 1, np.int32)
    data.curve_offset_data.foreach_get("value", firsts)
    return tubes(points, radii, firsts)


def balls(points: Floats, radii: Floats) -> Parts:
    """Balls about points (N, 3) of radii (N,): as wide, in the mean over all sides, as spheres."""
    unit, triangles = _ball(len(points) <= MOST_BALLS)
    corners = unit[triangles]
    sides = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = 0.5 * np.linalg.norm(sides, axis=1).sum()
    wide = np.sqrt(4.0 * np.pi / area)  # a convex body is seen as a quarter of its area (Cauchy)
    vertices = points[:, None] + (wide * radii)[:, None, None] * unit
    normals = np.broadcast_to(unit, vertices.shape)
    numbers = len(unit) * np.arange(len(points), dtype=np.int32)[:, None, None] + triangles
    return _flat(vertices), _flat(normals), numbers.reshape(-1, 3).astype(np.int32)


def tubes(points: Floats, radii: Floats, firsts: NDArray[np.int32]) -> Parts:
    """Tubes along curves, each of which has points (P, 3) from its first one, (C + 1,), to the next
    one's: as wide, in the mean over all sides, as round ones."""
    lengths = np.diff(firsts)
    sides, pieces = (SIDES, SUBDIVISIONS) if len(points) <= MOST_POINTS else (3, 1)
    found: list[Parts] = []
    first = 0
    for length in np.unique(lengths[lengths > 1]):  # all of one length at once
        at = firsts[:-1][lengths == length][:, None] + np.arange(length)
        smooth = _smooth(np.concatenate([points[at], radii[at][..., None]], axis=2), pieces)
        radius = np.maximum(smooth[..., 3], 0.0)
        vertices, normals, triangles = _rings(smooth[..., :3], radius, sides)
        found.append((vertices, normals, triangles + np.int32(first)))
        first += len(vertices)
    if not found:
        return balls(np.zeros((0, 3)), np.zeros(0))
    vertices, normals, triangles = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return vertices, normals, triangles


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


def _rings(points: Floats, radii: Floats, sides: int) -> Parts:
    """Tubes about lines (C, P, 3)."""
    curves, count = radii.shape
    ways = _unit(np.gradient(points, axis=1))
    least = np.eye(3)[np.abs(ways[:, 0]).argmin(axis=1)]
    carried = [_unit(np.cross(ways[:, 0], least))]
    for here in ways.transpose(1, 0, 2)[1:]:  # carried along without a twist
        carried.append(_unit(carried[-1] - (carried[-1] * here).sum(axis=1, keepdims=True) * here))
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


def _ball(is_fine: bool) -> tuple[Floats, NDArray[np.int32]]:
    """An icosahedron's vertices on the unit sphere and its triangles, each maybe cut into four."""
    golden = (1.0 + 5.0**0.5) / 2.0
    flat = [(0.0, x, y * golden) for x in (-1.0, 1.0) for y in (-1.0, 1.0)]
    vertices = _unit(np.array([np.roll(p, k) for k in range(3) for p in flat]))
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
        vertices = np.concatenate([vertices, _unit(np.array(middles))])
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


def _attribute(data: bpy.types.ID, name: str, field: str, count: int) -> Floats:
    values = np.empty(count, np.float32)
    data.attributes[name].data.foreach_get(field, values)
    return values.astype(np.float64)


def _flat(values: Floats) -> NDArray[np.float32]:
    return np.ascontiguousarray(values.reshape(-1, 3), np.float32)


def _unit(vectors: Floats) -> Floats:
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.divide(vectors, lengths, out=np.zeros_like(vectors), where=lengths > 0.0)
