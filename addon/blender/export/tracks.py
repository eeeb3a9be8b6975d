# SPDX-License-Identifier: GPL-3.0-or-later
"""Export how objects move and bend while the shutter is open."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field

import bpy
import numpy as np
from numpy.typing import NDArray

from ...photon.scene import Moving
from .meshes import Shape, placed_normals, placed_points, read_mesh, shape_of
from .motion import Shutter, Views, bends, steps_of, times_of
from .report import Notes

FLAT = 1e-9  # of its longest axis: what is flatter has no inverse


@dataclass
class Track:
    """Where one object or instance is, and its shape, at instants."""

    owner: str
    times: tuple[float, ...]
    matrices: dict[float, NDArray[np.float64]] = field(default_factory=dict)
    shapes: dict[float, Shape] = field(default_factory=dict)


class Tracks:
    """Where everything is at the instants at which Cycles looks."""

    def __init__(self, depsgraph: bpy.types.Depsgraph, notes: Notes) -> None:
        self._depsgraph, self._notes = depsgraph, notes
        self._tracks: dict[Hashable, Track] = {}

    def follow(self, shutter: Shutter, views: Views) -> None:
        """Go through the exposure, and leave Blender in its middle: it is where everything that
        stands still within a frame is seen."""
        times = {*views.times}
        for instance in self._depsgraph.object_instances:
            if instance.object.type == "MESH":
                times |= {*times_of(steps_of(*_owners(instance)))}
        for time in sorted(times - {0.5}):
            shutter.go(time)
            if time in views.times:
                views.look(time)
            self._look(time)
        shutter.go(0.5)
        views.look(0.5)

    def moving(
        self,
        instance: bpy.types.DepsgraphObjectInstance,
        matrix: NDArray[np.float64],
        shape: Shape,
        vertices: tuple[int, int],
        corners: NDArray[np.int32],
    ) -> Moving | None:
        """How an instance moves that is here in the middle of the exposure; None if it does not.

        `vertices` are its first one of the scene and that after its last, `corners` (T, 3) those
        of its triangles into the shape's normals.
        """
        track = self._tracks.get(_key(instance))
        if track is None:
            return None
        matrices = [track.matrices.get(time, matrix) for time in track.times]
        shapes = [track.shapes.get(time, shape) for time in track.times]
        if any(not shape.fits(other) for other in shapes):
            what = "it has other vertices than in the middle of the exposure, whose shape it keeps"
            self._notes.approximated(track.owner, "Motion Blur", what)
            shapes = [shape] * len(shapes)
        bent = any(not np.array_equal(shape.vertices, other.vertices) for other in shapes)
        moved = any(not np.array_equal(matrix, other) for other in matrices)
        if not bent and not moved:
            return None
        self._notes.exact(track.owner, "Motion Blur")
        if moved and not _has_inverse(matrix):
            return _as_bent(vertices, matrix, matrices, shape, shapes, corners)
        found = Moving(vertices)
        if bent:
            found = _as_bent(vertices, matrix, [matrix] * len(shapes), shape, shapes, corners)
        if not moved:
            return found
        of_shape = found.offsets, found.normals, found.corners
        return Moving(vertices, np.array(matrices), matrix, *of_shape)

    def _look(self, time: float) -> None:
        """See where everything is now that has such an instant."""
        shapes: dict[int, Shape] = {}  # by the address of a mesh, which holds till the next instant
        for instance in self._depsgraph.object_instances:  # its items do not outlive an iteration
            obj, owner = _owners(instance)
            times = times_of(steps_of(obj, owner))
            if not instance.show_self or obj.type != "MESH" or time not in times:
                continue
            track = self._tracks.setdefault(_key(instance), Track(f"Object '{owner.name}'", times))
            track.matrices[time] = np.array(instance.matrix_world, np.float64)
            if not bends(obj, owner):
                continue
            address = obj.data.as_pointer()
            if address not in shapes:
                shapes[address] = read_mesh(obj, shape_of)
            last = next(reversed(track.shapes.values()), None)
            shape = shapes[address]
            track.shapes[time] = last if last is not None and last.same(shape) else shape


def _owners(
    instance: bpy.types.DepsgraphObjectInstance,
) -> tuple[bpy.types.Object, bpy.types.Object]:
    """What is shown, and what it is an instance of."""
    obj = instance.object
    return obj, instance.parent if instance.is_instance else obj


def _key(instance: bpy.types.DepsgraphObjectInstance) -> Hashable:
    """What tells an instance apart at all instants."""
    obj, owner = _owners(instance)
    return obj.name, owner.name, tuple(instance.persistent_id)


def _has_inverse(matrix: NDArray[np.float64]) -> bool:
    stretches = np.linalg.svd(matrix[:3, :3], compute_uv=False)
    return bool(stretches[-1] > FLAT * stretches[0])


def _as_bent(
    vertices: tuple[int, int],
    matrix: NDArray[np.float64],
    matrices: list[NDArray[np.float64]],
    shape: Shape,
    shapes: list[Shape],
    corners: NDArray[np.int32],
) -> Moving:
    """A change of shape, of what matrices place."""
    here = placed_points(shape.vertices, matrix)
    offsets = [placed_points(s.vertices, m) - here for s, m in zip(shapes, matrices, strict=True)]
    normals = np.zeros((len(shapes), 0, 3), np.float32)
    if not shape.is_flat:
        turned = [placed_normals(s.normals, m) for s, m in zip(shapes, matrices, strict=True)]
        normals = np.array(turned, np.float32)
    return Moving(
        vertices,
        offsets=np.array(offsets, np.float32),
        normals=normals,
        corners=corners if not shape.is_flat else np.zeros((0, 3), np.int32),
    )
