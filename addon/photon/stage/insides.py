# SPDX-License-Identifier: GPL-3.0-or-later
"""What is inside meshes: their parts, how large these are, and which of many places are in them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

INSIDE = 0.5  # of a turn
NUDGE = np.array((1.3e-7, 2.9e-7))  # of a box, by which columns miss edges
MOST_PARTS = 512  # of a mesh, that are looked at whether they overlap
AT_ONCE = 1 << 20  # pairs of triangles and columns, each of which takes some 130 bytes meanwhile

Array = NDArray[np.float64]


def parts_of(triangles: NDArray[np.integer[Any]]) -> NDArray[np.intp]:
    """(n,) which part each triangle (n, 3) of vertices' numbers is of, from 0 on: those that share
    vertices are of one."""
    _, corners = np.unique(triangles, return_inverse=True)
    corners = corners.reshape(-1, 3)
    label = np.arange(corners.max() + 1)
    while True:
        least = label[corners].min(axis=1)
        before = label.copy()
        for corner in corners.T:
            np.minimum.at(label, corner, least)
        label = label[label]
        if (label == before).all():
            break
    found: NDArray[np.intp] = np.unique(label[corners[:, 0]], return_inverse=True)[1]
    return found


def alike(numbers: NDArray[np.integer[Any]]) -> list[NDArray[np.intp]]:
    """Where equal ones of numbers (n,) stand, by these."""
    order = np.argsort(numbers, kind="stable")
    ends = np.flatnonzero(np.diff(numbers[order])) + 1
    return np.split(order, ends) if len(order) else []


def apart(
    triangles: NDArray[np.integer[Any]], corners: Array
) -> list[tuple[NDArray[np.intp], bool]]:
    """Triangles (n, 3) with corners (n, 3, 3) by parts whose boxes do not overlap, for one may be
    hollow by another, and whether each is one; of more than MOST_PARTS each is taken by itself."""
    part = parts_of(triangles)
    parts = alike(part)
    if not 1 < len(parts) <= MOST_PARTS:
        return [(one, True) for one in parts]
    low, high = (
        np.array([f(corners[one], axis=(0, 1)) for one in parts]) for f in (np.min, np.max)
    )
    meet = ((low[:, None] <= high[None]) & (high[:, None] >= low[None])).all(axis=2)
    group = np.arange(len(parts))
    while True:
        least = np.where(meet, group[None], len(parts)).min(axis=1)
        if (least == group).all():
            several = np.bincount(group)[group[part]] > 1
            return [(one, not several[one[0]]) for one in alike(group[part])]
        group = least


def is_flat(places: Array, least: float) -> bool:
    """Whether places (n, 3) are in a plane, but for so much."""
    normal = np.linalg.eigh(np.cov(places, rowvar=False))[1][:, 0]
    return bool(np.ptp(places @ normal) < least)


def is_closed(triangles: NDArray[np.integer[Any]]) -> bool:
    """Whether each edge has two triangles (n, 3)."""
    ends = [triangles[:, [x, (x + 1) % 3]] for x in range(3)]
    edges = np.sort(np.concatenate(ends))
    _, counts = np.unique(edges, axis=0, return_counts=True)
    return bool((counts == 2).all())


def volume_of(corners: Array) -> float:
    """Of what closed triangles (n, 3, 3) are about."""
    a, b, c = np.moveaxis(corners - corners[0, 0], 1, 0)
    return abs(float((a * np.cross(b, c)).sum())) / 6.0


def inside_box(
    corners: Array, low: Array, size: Array, counts: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """(x, y, z) whether triangles (n, 3, 3) are about the middles of the cells of a box, seen along
    two axes at least: so they may be open."""
    seen = np.zeros(tuple(counts), np.int8)
    for axis in range(3):
        order = np.roll(np.arange(3), 2 - axis)  # the axis last
        found = _about(corners[..., order], low[order], size[order], counts[order])
        seen += np.transpose(found, np.argsort(order))
    there: NDArray[np.bool_] = seen >= 2
    return there


def _about(corners: Array, low: Array, size: Array, counts: NDArray[np.int64]) -> NDArray[np.bool_]:
    """The same along z: of all that are above one as many face up as down, and one more."""
    cell = size / counts
    a, b, c = (corners[:, x] for x in range(3))
    area = _cross(b - a, c - a)
    first, last = (
        np.clip(np.floor((end[:, :2] - low[:2]) / cell[:2] - 0.5).astype(int), -1, counts[:2] - 1)
        for end in (corners.min(axis=1) - NUDGE[0] * size, corners.max(axis=1))
    )
    wide = np.where((area != 0.0)[:, None], np.maximum(last - first, 0), 0)
    pairs = wide.prod(axis=1)
    turns = np.zeros((counts[0], counts[1], counts[2] + 1))
    steps = np.cumsum(pairs) // AT_ONCE
    for step in np.unique(steps[pairs > 0]):
        some = np.flatnonzero((steps == step) & (pairs > 0))
        which = np.repeat(some, pairs[some])
        ends = np.cumsum(pairs[some])
        within = np.arange(len(which)) - np.repeat(ends - pairs[some], pairs[some])
        column = first[which] + 1 + np.stack(np.divmod(within, wide[which, 1]), axis=-1)
        at = low[:2] + cell[:2] * (column + 0.5) + NUDGE * size[:2]
        met, height = _met(at, a[which], (b - a)[which], (c - a)[which], area[which])
        which, column, height = which[met], column[met], height[met]
        below = np.clip(np.ceil((height - low[2]) / cell[2] - 0.5).astype(int), 0, counts[2])
        np.add.at(turns, (column[:, 0], column[:, 1], below), np.sign(area[which]))
    above = turns.sum(axis=2, keepdims=True) - np.cumsum(turns, axis=2)
    found: NDArray[np.bool_] = np.abs(above[:, :, :-1]) > INSIDE
    return found


def below_backs(places: Array, corners: Array) -> NDArray[np.bool_]:
    """(n,) above which places (n, 3) the first of triangles (t, 3, 3) faces up."""
    found = np.zeros(len(places), bool)
    area = _cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    corners, area = corners[area != 0.0], area[area != 0.0]
    if not len(corners):
        return found
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    at = places + np.append(NUDGE * (high - low)[:2], 0.0)
    under = (at[:, 2] <= high[2]) & ((at >= low) & (at <= high))[:, :2].all(axis=1)
    a, to_b, to_c = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    step = max(AT_ONCE // len(corners), 1)
    for first in range(0, int(under.sum()), step):
        some = np.flatnonzero(under)[first : first + step]
        met, height = _met(at[some, None, :2], a, to_b, to_c, area)
        met &= height > at[some, None, 2]
        nearest = np.where(met, height, np.inf).argmin(axis=1)
        found[some] = met.any(axis=1) & (area[nearest] > 0.0)
    return found


def _met(
    at: Array, a: Array, to_b: Array, to_c: Array, area: Array
) -> tuple[NDArray[np.bool_], Array]:
    """Whether lines along z through places (..., 2) meet triangles, each by a corner, its sides
    (..., 3) and twice its area seen so; and how high these are there."""
    away = at - a[..., :2]
    u, v = _cross(away, to_c) / area, _cross(to_b, away) / area
    met = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0)
    return met, a[..., 2] + u * to_b[..., 2] + v * to_c[..., 2]


def _cross(a: Array, b: Array) -> Array:
    """(..., n) z of the product of such as lie in xy."""
    found: Array = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return found
