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
from .displacement import ASKED, asking, bare
from .far import far_ends, unwarped
from .geometry import Mesh, frame_of
from .insides import alike, is_flat
from .kinds import light_kinds
from .points import asked_at
from .textures import Texels

MOST_CELLS = 128  # of a grid, along its longest side; a power of two
LEAST_CELLS = 64  # along its others
# Of what a medium has in the mean: what a coarser grid may be off in the mean.
SAME = 1e-3
NOWHERE = 1e30  # [m]
CLEAR = 1e-6  # of light; what loses less of it on its way is none
# About all, of its sides: above and below most, for fog mostly differs with height.
MARGIN = np.array((0.15, 0.15, 0.5))
LEAST_SIZE = 1.0  # [m] of what is everywhere
FLAT = 1e-5  # of its longest side, that what has an inside is thick at least
THIN = 1e-4  # of a box's longest side, that a shorter one is at least
# Objects that have media of their own; more share what nodes tell of the first in the mean.
MOST_OWN = 1000
FAR_CELLS = 48  # of what is beyond the box about all
FAR_SAMPLES = 16
MOST_VOXELS = 1 << 24  # of all grids together: floats hold their numbers
EVEN_3 = np.array((0.8191725134, 0.6710436067, 0.5497004779))  # steps of the R3 sequence
AIR, BEYOND = -1, -2  # its numbers, beside those of materials

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
    far: bool = False  # about another one of the same bounds, and beyond

    @property
    def asked(self) -> dict[str, Result]:
        """What of the medium its program tells."""
        values = {name: getattr(self.medium, name) for name in COEFFICIENTS}
        return {name: value for name, value in values.items() if isinstance(value, Result)}

    @property
    def samples(self) -> int:
        """How many of each place: far from all there is more between places than they tell."""
        return FAR_SAMPLES if self.far else 1

    def along(self, sample: int) -> tuple[Array, Array, Array]:
        """Where places are along x, y and z [m]."""
        if not self.far:
            each = zip(self.low, self.high, self.counts, strict=True)
            x, y, z = (np.linspace(*bounds) for bounds in each)
            return x, y, z
        middle, half = (self.low + self.high) / 2, (self.high - self.low) / 2
        aside = (sample + 0.5) * EVEN_3 % 1.0 - 0.5  # of the way to the next place
        x, y, z = middle[:, None] + half[:, None] * unwarped(far_ends(half), FAR_CELLS + 1, aside)
        return x, y, z

    def slices(self) -> Array:
        """(n, 3, 3): triangles that are twice as long and wide as all places, one at each height of
        each sample."""
        return np.concatenate([self._slices(*self.along(x)) for x in range(self.samples)])

    def _slices(self, x: Array, y: Array, z: Array) -> Array:
        corners = np.zeros((len(z), 3, 3))
        corners[:] = x[0], y[0], 0.0
        corners[:, :, 2] = z[:, None]
        corners[:, 1, 0] += 2.0 * (x[-1] - x[0])
        corners[:, 2, 1] += 2.0 * (y[-1] - y[0])
        return corners


def filled(scene: Scene, backend: Backend, texels: Texels | None) -> Scene:
    """The scene whose media all have values or grids: those that a program tells are asked for
    places of a box about what wears them, of each surface by itself.

    `texels`: the scene's textures. DeviceError when OpenGL fails.
    """
    if not any(medium.is_there for medium in scene.media):
        return scene
    scene, boxes, means = _apart(scene)
    if scene.air.asks:
        low, high = about_all(scene)
        boxes[AIR] = _Box(scene.air, 0, low, high, _attributes_of(scene, None))
    if not boxes:
        return scene
    boxes = _affordable(boxes)
    far: dict[int, _Box] = {}
    if AIR in boxes:
        far[BEYOND] = replace(boxes[AIR], counts=(FAR_CELLS + 1,) * 3, far=True)
    try:  # apart, for numbers of what is that far are too coarse for what is near
        media = {
            number: medium
            for some in (boxes, far)
            if some
            for number, medium in _asked(scene, some, backend, texels)
        }
    except StreamError as error:
        backend.device.trim()
        raise DeviceError(str(error)) from error
    for number, first in means.items():
        media[number] = replace(media.get(first, NO_MEDIUM), grid=None)
    materials = [
        replace(one, medium=media[number]) if number in media else one
        for number, one in enumerate(scene.materials)
    ]
    return replace(scene, materials=tuple(materials), air=_air(scene, media))


def _air(scene: Scene, media: dict[int, Medium]) -> Medium:
    """What is everywhere, with what it has beyond its box."""
    if AIR not in media:
        return scene.air
    near, beyond = media[AIR], media[BEYOND]
    if not near.grid:  # none of it is where anything is
        return NO_MEDIUM
    return replace(near, grid=replace(near.grid, beyond=beyond.grid))


def _apart(scene: Scene) -> tuple[Scene, dict[int, _Box], dict[int, int]]:
    """The scene with a material for each surface that wears one with a medium, for a ray that is in
    a thing's is not in it twice; where a program tells it, boxes about these, by the numbers of the
    materials; and of those that are too many whose means they have. What nothing wears has no
    medium."""
    materials, material = list(scene.materials), scene.material.copy()
    boxes: dict[int, _Box] = {}
    means: dict[int, int] = {}
    wearers = {
        number: _by_surface(scene, np.flatnonzero(scene.material == number))
        for number, one in enumerate(scene.materials)
        if one.medium.is_there
    }
    surfaces = {}
    if any(materials[number].medium.asks for number in wearers):
        whole = _by_surface(scene, np.arange(len(scene.surface)))
        surfaces = {int(scene.surface[own[0]]): own for own in whole}
    left = MOST_OWN
    few = sum(map(len, wearers.values())) <= left
    for number, groups in wearers.items():
        one = materials[number]
        if not (few or one.medium.asks):
            continue
        materials[number] = one if groups else replace(one, medium=NO_MEDIUM)
        count, first = max(left, 1), len(boxes)
        for place, own in enumerate(groups[:count]):
            which = len(materials) if place else number
            materials += [one] if place else []
            material[own] = which
            if not one.medium.asks:
                continue
            if box := _box_of(scene, one.medium, surfaces[int(scene.surface[own[0]])], own[0]):
                boxes[which] = box
            else:  # it has no size
                materials[which] = replace(one, medium=NO_MEDIUM)
        left = max(left - len(groups), 0)
        if groups[count:]:
            material[np.concatenate(groups[count:])] = len(materials)
            means[len(materials)] = next(iter([*boxes][first:]), number)
            materials.append(replace(one, medium=NO_MEDIUM))
    return replace(scene, materials=tuple(materials), material=material), boxes, means


def _by_surface(scene: Scene, own: NDArray[np.intp]) -> list[NDArray[np.intp]]:
    """Of some triangles those of each surface."""
    return [own[those] for those in alike(scene.surface[own])]


def _box_of(scene: Scene, medium: Medium, triangles: NDArray[np.intp], wearing: int) -> _Box | None:
    """About all triangles of a surface, one of which wears a medium; None where nothing is between
    them, for what differs is nowhere else, as in Cycles."""
    places = _somewhere(scene.vertices[scene.triangles[triangles]].reshape(-1, 3))
    low, high = _around(places)
    longest = (high - low).max()
    if not longest > 0.0 or is_flat(places, FLAT * longest):
        return None
    thin = np.where(high - low < THIN * longest, THIN * longest, 0.0)
    surface, attributes = int(scene.surface[wearing]), _attributes_of(scene, wearing)
    return _Box(medium, surface, low - thin / 2, high + thin / 2, attributes)


def _attributes_of(scene: Scene, triangle: int | None) -> NDArray[np.float32]:
    """(A, 4) at a corner of a triangle; of none 0."""
    count = scene.corner_attributes.shape[1]
    if triangle is None or not count:
        return np.zeros((count, 4), np.float32)
    found: NDArray[np.float32] = scene.corner_attributes[triangle, :, 0]
    return found


def _somewhere(places: Array) -> Array:
    """Places (n, 3) but such as are nowhere."""
    found: Array = places[(np.abs(places) < NOWHERE).all(axis=1)]
    return found


def _around(places: Array) -> Array:
    """(2, 3) the bounds of places (n, 3)."""
    return np.array((places.min(axis=0), places.max(axis=0))) if len(places) else np.zeros((2, 3))


def about_all(scene: Scene) -> Array:
    """(2, 3) the bounds of all that is there, the camera and lamps, and some way on."""
    lamps = [x.position for x in scene.lights if not light_kinds()[x.kind].is_distant]
    eye = scene.camera.matrix[None, :3, 3]
    low, high = _around(
        _somewhere(np.concatenate([scene.vertices, eye, np.reshape(lamps, (-1, 3))]))
    )
    margin = np.maximum(MARGIN * (high - low), (LEAST_SIZE - (high - low)) / 2)
    return np.array((low - margin, high + margin))


def _affordable(boxes: dict[int, _Box]) -> dict[int, _Box]:
    """With as many places each as there may be: the most have less."""
    cells = dict.fromkeys(boxes, MOST_CELLS)
    voxels = {number: _voxels(number, box, MOST_CELLS) for number, box in boxes.items()}
    while sum(voxels.values()) > MOST_VOXELS and max(cells.values()) > 2:
        most = max(voxels, key=lambda number: (cells[number] > 2, voxels[number]))
        cells[most] //= 2
        voxels[most] = _voxels(most, boxes[most], cells[most])
    return {
        number: replace(box, counts=_counts(box, cells[number])) for number, box in boxes.items()
    }


def _voxels(number: int, box: _Box, cells: int) -> int:
    """How many it has at most, and what is beyond it, if it is about all: three a place of what is
    lost, of what of that is scattered if not all is, and of what is emitted."""
    beyond = (FAR_CELLS + 1) ** 3 if number == AIR else 0
    medium = box.medium
    kinds = 1 + (medium.absorbs and medium.scatters) + medium.glows
    return 3 * kinds * (int(np.prod(_counts(box, cells))) + beyond)


def _counts(box: _Box, cells: int) -> tuple[int, int, int]:
    """Of places along each axis, a power of two and one, that are about as far apart."""
    size = box.high - box.low
    wanted = np.maximum(cells * size / size.max(), min(cells, LEAST_CELLS))
    along = 2 ** np.ceil(np.log2(wanted)).astype(int)
    x, y, z = (int(n) + 1 for n in along)
    return x, y, z


def _asked(
    scene: Scene, boxes: dict[int, _Box], backend: Backend, texels: Texels | None
) -> Iterator[tuple[int, Medium]]:
    """What media have there, by the boxes' numbers."""
    fields = [(box, result) for box in boxes.values() for result in box.asked.values()]
    slices = [box.slices() for box, _ in fields]
    heights = [*map(len, slices)]
    asked = _scene_of(
        scene,
        [Material("", program=x.medium.program, varying={ASKED: result}) for x, result in fields],
        np.concatenate(slices),
        np.repeat(np.arange(len(fields)), heights),
        np.repeat([box.surface for box, _ in fields], heights),
        np.repeat([box.attributes for box, _ in fields], heights, axis=0),
    )
    frame = frame_of(asked)
    mesh = Mesh.build(asked, frame)
    with asking(asked, backend, frame, mesh, texels) as (kernel, tables):
        place, first = mesh.places_of(np.arange(len(asked.triangles))), 0
        for number, box in boxes.items():
            x, y, z = box.counts
            values: dict[str, NDArray[np.float32]] = {}
            for name in COEFFICIENTS:
                own = getattr(box.medium, name)
                if name not in box.asked:
                    values[name] = np.broadcast_to(np.float32(own), (z, y, x, 3))
                    continue
                values[name] = np.zeros((z, y, x, 3), np.float32)
                for sample in range(box.samples):
                    along = box.along(sample)[1::-1]
                    got = _at_slices(kernel, place[first : first + z], along, tables)
                    values[name] += got / np.float32(box.samples)
                    first += z
            yield number, _medium(box, values)


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
        bare(scene),
        materials=tuple(materials),
        vertices=corners.reshape(-1, 3),
        triangles=np.arange(3 * count, dtype=np.int32).reshape(-1, 3),
        corner_normals=np.zeros((count, 3, 3), np.float32),
        material=material.astype(np.int32),
        surface=surface.astype(np.int32),
        corner_attributes=np.repeat(attributes[:, :, None], 3, axis=2),
    )


def _at_slices(
    kernel: Displace,
    places: NDArray[np.intp],
    along: tuple[Array, Array],
    tables: Mapping[str, Any],
) -> NDArray[np.float32]:
    """(z, y, x, 3) what a program gives on triangles of slices, at places along y and x, not below
    0."""
    v, u = ((axis - axis[0]) / (2.0 * (axis[-1] - axis[0])) for axis in along)
    rows, columns = map(len, along)
    found = np.zeros((len(places), rows, columns, 3), np.float32)
    step = max(TABLE_WIDTH // columns, 1)
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
    scattering, emission = values["scattering"], values["emission"]
    extinction = values["absorption"] + scattering
    unit = np.float32(1.0)  # so that the grid tells each as truly as the others
    if extinction.any() and emission.any():
        unit = np.float32(min(extinction.mean() / emission.mean(), 1e20))
    joint = np.concatenate([extinction, scattering, unit * emission], axis=-1)
    parts = np.split(joint if box.far else _coarser(joint), 3, axis=-1)
    extinction, scattering, emission = map(np.ascontiguousarray, (*parts[:2], parts[2] / unit))
    lost, turned, emitted = (
        x.mean(axis=(0, 1, 2), dtype=np.float64) for x in (extinction, scattering, emission)
    )
    if not (emitted.any() or lost.max() * (box.high - box.low).max() > CLEAR):
        return NO_MEDIUM
    grid = Grid(box.low, box.high, extinction, scattering, emission)
    absorption, scatters, emits = map(triple, (np.maximum(lost - turned, 0.0), turned, emitted))
    return Medium(absorption, scatters, box.medium.anisotropy, emits, grid=grid)


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
