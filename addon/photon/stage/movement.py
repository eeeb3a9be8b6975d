# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene at an instant of its exposure."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..scene import Moving, Scene
from .normals import longest_one, mixed

Doubles = NDArray[np.float64]

SUBSTEPS = 8  # between two matrices, of what boxes are swept by
# A corner that turns by half a turn from one to the next is so far off the chord between two
# substeps, of its distance from what it turns about.
SAGITTA = 0.02
FLAT = 1e-9  # of the longest axis: a shorter one does not tell how something is turned


class Movement:
    """Moves what moves of a scene."""

    def __init__(self, scene: Scene) -> None:
        """`scene.moving` is not empty."""
        self._scene = scene
        first = np.array([one.vertices[0] for one in scene.moving])
        order = np.argsort(first, kind="stable")
        corner = scene.triangles[:, 0]
        owner = order[np.maximum(np.searchsorted(first[order], corner, "right") - 1, 0)]
        self._parts = []
        for number, one in enumerate(scene.moving):
            own = np.flatnonzero(owner == number) if len(order) > 1 else np.arange(len(corner))
            inside = (corner[own] >= one.vertices[0]) & (corner[own] < one.vertices[1])
            self._parts.append(_Part.of(scene, one, own[inside]))

    @cached_property
    def rows(self) -> NDArray[np.intp]:
        """Of the triangles that move."""
        return np.concatenate([part.rows for part in self._parts])

    def at(self, time: float) -> Scene:
        """The scene at a time from the shutter's opening, 0, to its closing, 1."""
        scene = self._scene
        vertices, normals = scene.vertices.copy(), scene.corner_normals.copy()
        tangents, objects = scene.corner_tangents.copy(), scene.objects.copy()
        for part in self._parts:
            part.move(time, vertices, normals, tangents)
            if len(objects) and len(part.moving.matrices) and len(part.rows):
                number = scene.surface[part.rows[0]]
                objects[number] = _space(scene.objects[number], part.placing(time))
        return replace(
            scene,
            vertices=vertices,
            corner_normals=normals,
            corner_tangents=tangents,
            objects=objects,
            moving=(),
        )

    def box(self) -> tuple[Doubles, Doubles]:
        """The lowest and highest coordinates [m] that what moves may have, or a little beyond."""
        boxes = [box for part in self._parts if (box := part.box()) is not None]
        if not boxes:
            return np.full(3, np.inf), np.full(3, -np.inf)
        return np.min([low for low, _ in boxes], axis=0), np.max(
            [high for _, high in boxes], axis=0
        )


@dataclass(frozen=True)
class _Part:
    """A run of vertices, with its triangles."""

    moving: Moving
    shape: Doubles  # (n, 3) the scene's vertices
    rows: NDArray[np.intp]  # of its triangles
    normals: NDArray[np.float32]  # (T, 3, 3) the scene's
    tangents: NDArray[np.float32]  # (T, 3, 3), or (0, 3, 3): there are none
    to_local: Doubles  # (4, 4)

    @staticmethod
    def of(scene: Scene, moving: Moving, rows: NDArray[np.intp]) -> _Part:
        """Take what a scene has of it."""
        first, last = moving.vertices
        tangents = scene.corner_tangents
        return _Part(
            moving,
            scene.vertices[first:last],
            rows,
            scene.corner_normals[rows],
            tangents[rows] if len(tangents) else tangents,
            np.linalg.inv(moving.placed) if len(moving.matrices) else np.eye(4),
        )

    def move(self, time: float, vertices: Doubles, normals: Any, tangents: Any) -> None:
        """Write where its vertices are, and how its corners are turned."""
        shape, turned = self.shape, self.normals
        if self.moving.bends:
            shape = shape + _at(self.moving.offsets, time)
            turned = self._bent(time)
        if len(self.moving.matrices):
            matrix = self.placing(time)
            shape = shape @ matrix[:3, :3].T + matrix[:3, 3]
            turned = longest_one(turned @ _cofactor(matrix).T)
            if len(self.tangents):
                tangents[self.rows] = _scaled(self.tangents @ _cofactor(matrix).T)
        first, last = self.moving.vertices
        vertices[first:last] = shape
        normals[self.rows] = turned

    def placing(self, time: float) -> Doubles:
        """What places it, from where the scene has it (4, 4)."""
        return affine_between(self.moving.matrices, time) @ self.to_local

    def box(self) -> tuple[Doubles, Doubles] | None:
        """As Movement's; None if nothing of it is finite."""
        shapes = [self.shape, *(self.shape + offsets for offsets in self.moving.offsets)]
        finite = [shape[(np.abs(shape) < 1e30).all(axis=1)] for shape in shapes]
        if not any(map(len, finite)):
            return None
        lows, highs = zip(*((s.min(axis=0), s.max(axis=0)) for s in finite if len(s)), strict=True)
        ends = np.min(lows, axis=0), np.max(highs, axis=0)
        if not len(self.moving.matrices):
            return ends
        corners = np.array([[ends[i >> k & 1][k] for k in range(3)] for i in range(8)])
        local = corners @ self.to_local[:3, :3].T + self.to_local[:3, 3]
        steps = np.linspace(0.0, 1.0, SUBSTEPS * max(len(self.moving.matrices) - 1, 1) + 1)
        matrices = [affine_between(self.moving.matrices, time) for time in steps]
        turned = np.array([local @ matrix[:3, :3].T for matrix in matrices])
        swept = turned + np.array([matrix[:3, 3] for matrix in matrices])[:, None]
        spare = SAGITTA * float(np.linalg.norm(turned, axis=2).max())
        return swept.min(axis=(0, 1)) - spare, swept.max(axis=(0, 1)) + spare

    def _bent(self, time: float) -> NDArray[np.float32]:
        """The normals (T, 3, 3) of the shape; zero where triangles are flat."""
        if not self.moving.normals.shape[1]:
            return np.zeros_like(self.normals)
        normals = mixed(self.moving.normals, partial(_at, time=time))
        return longest_one(normals[self.moving.corners])


def affine_between(matrices: Doubles, time: float) -> Doubles:
    """The affine transform (4, 4) at a time in [0, 1], of those at S even instants (S, 4, 4).

    As Cycles: each is taken apart into a turn and stretches along axes that it keeps; what lies
    between two turns evenly about one axis, the rest goes straight.
    """
    first, last, part = _neighbours(matrices, time)
    result: Doubles = first + part * (last - first)
    (turn, stretch), (last_turn, last_stretch) = _apart(first), _apart(last)
    if turn is None:
        turn = np.eye(3) if last_turn is None else last_turn
        stretch = turn.T @ first[:3, :3]
    if last_turn is None:
        last_turn, last_stretch = turn, turn.T @ last[:3, :3]
    mixed = stretch + part * (last_stretch - stretch)
    result[:3, :3] = part_of_turn(last_turn @ turn.T, part) @ turn @ mixed
    return result


def part_of_turn(rotation: Doubles, part: float) -> Doubles:
    """A share of a rotation (3, 3) (Rodrigues)."""
    skew = (rotation - rotation.T) / 2.0
    axis = np.array([skew[2, 1], skew[0, 2], skew[1, 0]])
    sine, cosine = float(np.linalg.norm(axis)), (float(np.trace(rotation)) - 1.0) / 2.0
    angle = np.arctan2(sine, cosine)
    if sine > 1e-12:
        cross = skew / sine
    elif cosine > 0.0:
        return np.eye(3)
    else:  # half a turn, about the axis that it keeps
        column = int(np.argmax(np.diag(rotation)))
        kept = rotation[:, column] + np.eye(3)[column]
        x, y, z = kept / np.linalg.norm(kept)
        cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    angle *= part
    result: Doubles = np.sin(angle) * cross + (1.0 - np.cos(angle)) * (cross @ cross)
    return np.eye(3) + result


def _apart(matrix: Doubles) -> tuple[Doubles | None, Doubles]:
    """The rotation and the upper triangular matrix that its linear part is the product of; no
    rotation if it is flat."""
    linear = matrix[:3, :3]
    orthogonal, stretch = np.linalg.qr(linear)
    ends = np.diag(stretch)
    if not np.abs(ends).min() > FLAT * np.abs(linear).max():
        return None, stretch
    signs = np.sign(ends)
    orthogonal, stretch = orthogonal * signs, stretch * signs[:, None]
    if np.linalg.det(orthogonal) < 0.0:
        return -orthogonal, -stretch
    return orthogonal, stretch


def _neighbours(steps: Any, time: float) -> tuple[Any, Any, float]:
    """Of things at even instants, those before and after a time, and how far it is between."""
    place = time * (len(steps) - 1)
    number = int(place)
    return steps[number], steps[min(number + 1, len(steps) - 1)], place - number


def _at(steps: NDArray[np.float32], time: float) -> Doubles:
    """Straight between arrays at even instants."""
    first, last, part = _neighbours(steps, time)
    result: Doubles = first + part * (last.astype(np.float64) - first)
    return result


def _space(space: Doubles, matrix: Doubles) -> Doubles:
    """One of Scene.objects, once a matrix has moved the object."""
    found = space.copy()
    try:
        found[:3] = space[:3] @ np.linalg.inv(matrix)
    except np.linalg.LinAlgError:  # flat: its own space has no third dimension
        found[:3] = space[:3] @ np.linalg.pinv(matrix)
    found[4, :3] = matrix[:3, :3] @ space[4, :3] + matrix[:3, 3]
    return found


def _cofactor(matrix: Doubles) -> Doubles:
    """What normals go with (3, 3): they stay on the side of their triangles, whatever is
    mirrored."""
    x, y, z = matrix[:3, :3].T
    return np.column_stack((np.cross(y, z), np.cross(z, x), np.cross(x, y)))


def _scaled(vectors: Any) -> NDArray[np.float32]:
    """So that the longest coordinate is 1."""
    longest = np.abs(vectors).max(initial=0.0)
    return np.asarray(vectors / longest if longest > 0.0 else vectors, np.float32)
