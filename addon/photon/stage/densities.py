# SPDX-License-Identifier: GPL-3.0-or-later
"""Media that nodes of their materials tell: on grids, before anything else is made of a scene."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...streams import TABLE_WIDTH, StreamError
from ..backends.backend import Backend
from ..errors import DeviceError
from ..kernels.displacement import Displace
from ..scene import COEFFICIENTS, NO_MEDIUM, Grid, Material, Medium, Result, Scene, triple
from .device_scene import DeviceScene
from .displacement import ASKED, defines_of
from .geometry import Mesh, frame_of
from .kinds import light_kinds
from .points import asked_at
from .programs import ProgramNeeds
from .textures import Texels

MOST_CELLS = 128  # of a grid, along its longest side; a power of two
MOST_PLACES = 1 << 22  # of all grids together
# Of what a medium has in the mean: what a coarser grid may be off in the mean.
SAME = 1e-3
NOWHERE = 1e30  # [m]
CLEAR = 1e-6  # of light; what loses less of it on its way is none
MARGIN = 0.15  # about all, of its longest side
AIR = -1  # its number, beside those of materials
THIN = 1e-4  # of a box's longest side, that a shorter one is at least

Array = NDArray[np.float64]


@dataclass(frozen=True)
class _Box:
    """Where a medium is asked for."""

    medium: Medium
    surface: int
    low: Array
    high: Array
    attributes: NDArray[np.float32]  # (A, 4) of what wears it
    counts: tuple[int, int, int] = (2, 2, 2)  # of places along x, y and z

    @property
    def asked(self) -> dict[str, Result]:
        """What of the medium its program tells."""
        values = {name: getattr(self.medium, name) for name in COEFFICIENTS}
        return {name: value for name, value in values.items() if isinstance(value, Result)}

    def slices(self) -> Array:
        """(z, 3, 3): triangles that are twice as long and wide as the box, one at each height."""
        size = self.high - self.low
        corners = np.zeros((self.counts[2], 3, 3))
        corners[:] = self.low
        corners[:, :, 2] += np.linspace(0.0, size[2], self.counts[2])[:, None]
        corners[:, 1, 0] += 2.0 * size[0]
        corners[:, 2, 1] += 2.0 * size[1]
        return corners


def filled(scene: Scene, backend: Backend, texels: Texels | None) -> Scene:
    """The scene whose media all have values or grids: those that a program tells are asked for
    places of a box about what wears them, of each surface by itself.

    `texels`: the scene's textures. DeviceError when OpenGL fails.
    """
    scene, boxes = _apart(scene)
    asked = list(boxes)
    if scene.air.asks:
        boxes[AIR] = _box(scene.air, 0, _about_all(scene), _attributes_of(scene, None))
    if not boxes:
        return scene
    try:
        media = dict(_asked(scene, _affordable(boxes), backend, texels))
    except StreamError as error:
        backend.device.trim()
        raise DeviceError(str(error)) from error
    materials = list(scene.materials)
    for number in asked:
        materials[number] = replace(materials[number], medium=media[number])
    return replace(scene, materials=tuple(materials), air=media.get(AIR, scene.air))


def _apart(scene: Scene) -> tuple[Scene, dict[int, _Box]]:
    """The scene with a material for each surface whose medium a program tells, for objects have
    spaces of their own; and about what wears those, by their numbers, boxes. What nothing wears has
    no medium."""
    materials, material = list(scene.materials), scene.material.copy()
    boxes: dict[int, _Box] = {}
    for number, one in enumerate(scene.materials):
        if not one.medium.asks:
            continue
        own = np.flatnonzero(scene.material == number)
        materials[number] = replace(one, medium=NO_MEDIUM)
        for surface in np.unique(scene.surface[own]):
            wear = own[scene.surface[own] == surface]
            bounds = _around(scene.vertices[scene.triangles[wear]].reshape(-1, 3))
            attributes = _attributes_of(scene, int(wear[0]))
            boxes[len(materials)] = _box(one.medium, int(surface), bounds, attributes)
            material[wear] = len(materials)
            materials.append(one)
    return replace(scene, materials=tuple(materials), material=material), boxes


def _attributes_of(scene: Scene, triangle: int | None) -> NDArray[np.float32]:
    """(A, 4) at a corner of a triangle; of none 0."""
    count = scene.corner_attributes.shape[1]
    if triangle is None or not count:
        return np.zeros((count, 4), np.float32)
    found: NDArray[np.float32] = scene.corner_attributes[triangle, :, 0]
    return found


def _around(places: Array) -> Array:
    """(2, 3) the bounds of places (n, 3), but of such as are nowhere."""
    finite = places[(np.abs(places) < NOWHERE).all(axis=1)]
    return np.array((finite.min(axis=0), finite.max(axis=0))) if len(finite) else np.zeros((2, 3))


def _about_all(scene: Scene) -> Array:
    """(2, 3) the bounds of all that is there, the camera and lamps, and some way on."""
    lamps = [x.position for x in scene.lights if not light_kinds()[x.kind].is_distant]
    eye = scene.camera.matrix[None, :3, 3]
    low, high = _around(np.concatenate([scene.vertices, eye, np.reshape(lamps, (-1, 3))]))
    margin = MARGIN * (high - low).max()
    return np.array((low - margin, high + margin))


def _box(medium: Medium, surface: int, bounds: Array, attributes: NDArray[np.float32]) -> _Box:
    size = bounds[1] - bounds[0]
    thin = max(THIN * size.max(), 1e-6) * (size < THIN * size.max())
    return _Box(medium, surface, bounds[0] - thin / 2, bounds[1] + thin / 2, attributes)


def _affordable(boxes: dict[int, _Box]) -> dict[int, _Box]:
    """With as many places each as there may be."""
    cells = MOST_CELLS
    while cells > 2:
        counted = {x: replace(box, counts=_counts(box, cells)) for x, box in boxes.items()}
        if sum(int(np.prod(box.counts)) for box in counted.values()) <= MOST_PLACES:
            return counted
        cells //= 2
    return boxes


def _counts(box: _Box, cells: int) -> tuple[int, int, int]:
    """Of places along each axis, a power of two and one, that are about as far apart."""
    size = box.high - box.low
    along = 2 ** np.ceil(np.log2(np.maximum(cells * size / size.max(), 1.0))).astype(int)
    x, y, z = (int(n) + 1 for n in along)
    return x, y, z


def _asked(
    scene: Scene, boxes: dict[int, _Box], backend: Backend, texels: Texels | None
) -> Iterator[tuple[int, Medium]]:
    """What media have there, by the boxes' numbers."""
    fields = [(box, result) for box in boxes.values() for result in box.asked.values()]
    asked = _scene_of(
        scene,
        [Material("", program=x.medium.program, varying={ASKED: result}) for x, result in fields],
        np.concatenate([box.slices() for box, _ in fields]),
        np.repeat(np.arange(len(fields)), [box.counts[2] for box, _ in fields]),
        np.concatenate([np.full(box.counts[2], box.surface) for box, _ in fields]),
        np.concatenate([np.tile(box.attributes, (box.counts[2], 1, 1)) for box, _ in fields]),
    )
    frame = frame_of(asked)
    mesh = Mesh.build(asked, frame)
    made = DeviceScene.build(asked, backend, frame, mesh, texels)
    needs = ProgramNeeds.of(asked)
    kernel = Displace(backend.device, backend.layer, defines_of(needs), made=needs.made)
    try:
        tables = {name: made.tables.textures[name] for name in kernel.tables}
        place, first = mesh.places_of(np.arange(len(asked.triangles))), 0
        for number, box in boxes.items():
            x, y, z = box.counts
            values: dict[str, NDArray[np.float32]] = {}
            for name in COEFFICIENTS:
                if name in box.asked:
                    values[name] = _at_slices(kernel, place[first : first + z], (y, x), tables)
                    first += z
                else:
                    own = np.float32(getattr(box.medium, name))
                    values[name] = np.broadcast_to(own, (z, y, x, 3))
            yield number, _medium(box, values)
    finally:
        kernel.release()
        made.tables.release()


def _scene_of(
    scene: Scene,
    materials: list[Material],
    corners: Array,
    material: NDArray[np.intp],
    surface: NDArray[np.intp],
    attributes: NDArray[np.float32],
) -> Scene:
    """Triangles (n, 3, 3) [m] in place of a scene's, with attributes (n, A, 4)."""
    count = len(corners)
    attributes = attributes[: count if attributes.shape[1] else 0]
    return replace(
        scene,
        lights=(),
        images=(),
        materials=tuple(materials),
        vertices=corners.reshape(-1, 3),
        triangles=np.arange(3 * count, dtype=np.int32).reshape(-1, 3),
        corner_normals=np.zeros((count, 3, 3), np.float32),
        corner_tangents=scene.corner_tangents[:0],
        material=material.astype(np.int32),
        surface=surface.astype(np.int32),
        corner_attributes=np.repeat(attributes[:, :, None], 3, axis=2)[
            : count * (attributes.shape[1] > 0)
        ],
        flat=scene.flat[:0],
        moving=(),
        shutter=(),
        air=NO_MEDIUM,
    )


def _at_slices(
    kernel: Displace, places: NDArray[np.intp], size: tuple[int, int], tables: Mapping[str, Any]
) -> NDArray[np.float32]:
    """(z, y, x, 3) what a program gives on triangles of so many slices, not below 0."""
    rows, columns = size
    found = np.zeros((len(places), rows, columns, 3), np.float32)
    step = max(TABLE_WIDTH // columns, 1)
    u, v = np.linspace(0.0, 0.5, columns), np.linspace(0.0, 0.5, rows)
    for first in range(0, len(places), step):
        some = places[first : first + step]
        weights = np.empty((rows, len(some) * columns, 2))
        weights[..., 0], weights[..., 1] = np.tile(u, len(some)), v[:, None]
        directions = np.broadcast_to(np.array((0.0, 0.0, -1.0)), (*weights.shape[:2], 3))
        got = asked_at(kernel, np.repeat(some, columns), weights, directions, tables)
        slices = got.reshape(rows, len(some), columns, 3).transpose(1, 0, 2, 3)
        found[first : first + step] = slices
    return np.maximum(np.nan_to_num(found, nan=0.0, posinf=0.0, neginf=0.0), np.float32(0.0))


def _medium(box: _Box, values: dict[str, NDArray[np.float32]]) -> Medium:
    """What a program gave there, on as coarse a grid as tells it."""
    scattering = values["scattering"]
    both = np.concatenate([values["absorption"] + scattering, scattering], axis=-1)
    extinction, scattering = np.split(_coarser(both), 2, axis=-1)
    lost, turned = (x.mean(axis=(0, 1, 2), dtype=np.float64) for x in (extinction, scattering))
    if not lost.max() * (box.high - box.low).max() > CLEAR:
        return NO_MEDIUM
    absorbed = np.maximum(lost - turned, 0.0)
    grid = Grid(box.low, box.high, *map(np.ascontiguousarray, (extinction, scattering)))
    return Medium(triple(absorbed), triple(turned), box.medium.anisotropy, grid=grid)


def _coarser(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Values (z, y, x, n), of every other place along axes where what is between is about the
    same."""
    most = SAME * values.mean()
    for axis in range(3):
        while values.shape[axis] > 2:
            own = np.moveaxis(values, axis, 0)
            between = (own[:-2:2] + own[2::2]) / 2
            if np.abs(own[1::2] - between).mean() > most:
                break
            values = np.moveaxis(own[::2], 0, axis)
    return values
