# SPDX-License-Identifier: GPL-3.0-or-later
"""Media as tables, and which of them a place is in."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import SceneError
from ..kernels.records import BEAM, GLOW, GRID, INTERIOR, LIGHT_START, VOXEL
from ..scene import RAY_BITS, Grid, Light, Material, Medium, Scene, triple
from .emissive import TRIANGLE
from .far import far_ends
from .geometry import Frame, Mesh
from .insides import below_backs
from .kinds import light_kinds
from .light_tree import Bounds, is_of_media

NUMBERS = 4096  # of media: two share a float (lib/media.glsl)
MOST_MEDIA = 4  # that a place is in
SEVERAL = -1  # surfaces wear a material
SAME = 1e-4  # in the mean, of a mean of 1
MOST_BEAMS = 16
MOST_PLACES = 64  # of an emissive surface, each of which is looked at

Array = NDArray[np.float64]


@dataclass(frozen=True)
class MediaThere:
    """Whether a scene has media, and such as scatter or emit light."""

    any: bool
    scattering: bool  # or such as differ from place to place, where ways are gone along
    varying: bool
    glowing: bool

    @staticmethod
    def of(scene: Scene, materials: Iterable[Material]) -> MediaThere:
        """With these of its materials."""
        media = [scene.air, *(material.medium for material in materials)]
        varying = any(x.varies for x in media)
        scattering = varying or any(x.scatters for x in media)
        glowing = any(x.glows for x in media)
        return MediaThere(any(x.is_there for x in media), scattering, varying, glowing)


class Media:
    """A scene's, each of a surface by a number above 0; that which is everywhere is the first."""

    def __init__(self, scene: Scene, frame: Frame) -> None:
        """SceneError if there are too many."""
        scale = frame.scale
        wearers = _wearers(scene)
        of_each = {
            number: (material.medium, wearers[number])
            for number, material in enumerate(scene.materials)
            if material.medium.is_there
        }
        if len(set(of_each.values())) + scene.air.is_there >= NUMBERS:
            # Those that are alike have one number then.
            of_each = {number: (medium, SEVERAL) for number, (medium, _) in of_each.items()}
        found = list(dict.fromkeys(of_each.values()))
        there = [scene.air] * scene.air.is_there + [medium for medium, _ in found]
        if len(there) >= NUMBERS:
            text = f"scene.materials: {len(there)} different media, {NUMBERS - 1} are possible"
            raise SceneError(text)
        self.air = int(scene.air.is_there)
        numbers = {one: number for number, one in enumerate(found, 1 + self.air)}
        self.of_materials = np.zeros(len(scene.materials), np.int64)
        for number, one in of_each.items():
            self.of_materials[number] = numbers[one]
        self.count = len(there)
        self.scatters = any(medium.scatters or medium.varies for medium in there)
        self.glows = GLOW.zeros(len(there) if any(x.glows for x in there) else 0)
        self._visible = scene.visible
        self.table = INTERIOR.zeros(max(len(there), 1))
        for row, medium in zip(self.table, there, strict=False):
            absorbed, scattered, _ = scale * medium.coefficients
            row["scattering"], row["extinction"] = scattered, scattered + absorbed
            row["anisotropy"] = medium.anisotropy
        if len(scene.visible):
            shadowing = scene.visible[scene.surface] & RAY_BITS["shadow"] > 0
            shown = self.of_materials[np.unique(scene.material[shadowing])]
            met = {*range(1, 1 + self.air), *shown.tolist()}
            hidden = [number not in met for number in range(1, 1 + len(there))]
            self.table["unshadowing"][: len(there)] = hidden
        varying = [number for number, medium in enumerate(there) if medium.grid]
        grids = _GridTables.of([there[x] for x in varying], frame)
        self.grids, self.voxels = grids.grids, grids.voxels
        self.table["grid"][varying] = grids.numbers
        for row, medium in zip(self.glows, there, strict=False):
            row["emission"], row["first"] = scale * medium.coefficients[2], -1.0
        if len(self.glows):
            self.glows["first"][varying] = grids.emission

    def around(self, places: Array, mesh: Mesh, ray: str) -> NDArray[np.float32]:
        """Which media places (n, 3) are in, (n, 2) as MEDIUM has it, for rays of a name, to which
        some surfaces are not visible: of a surface in whose box they are, and which a ray upward
        meets from behind first. (Cycles asks for the box of any that holds a medium.)"""
        inside = np.zeros((len(places), MOST_MEDIA), np.int64)
        inside[:, 0] = self.air
        triangles = mesh.triangles
        numbers = self.of_materials[triangles["material"].astype(np.int64)]
        surfaces = np.unique(triangles["surface"][numbers > 0]).astype(np.int64)
        low, high = _boxes(triangles, surfaces)
        for number in np.unique(numbers[numbers > 0]):
            of_number = triangles[numbers == number]
            for surface in np.unique(of_number["surface"]).astype(np.int64):
                if self._visible.size and not self._visible[surface] & RAY_BITS[ray]:
                    continue
                at = np.searchsorted(surfaces, surface)
                there = ((places >= low[at]) & (places <= high[at])).all(axis=1)
                if not there.any():
                    continue
                own = of_number[of_number["surface"] == surface]
                there[there] = below_backs(places[there], _corners(own))
                free = inside.argmin(axis=1)
                there &= inside[np.arange(len(places)), free] == 0
                there &= (inside != number).all(axis=1)
                inside[there, free[there]] = number
        both: NDArray[np.float32] = (inside.reshape(-1, 2, 2) @ (1, NUMBERS)).astype(np.float32)
        return both

    def starts(self, scene: Scene, lights: NDArray[Any], distant: int, mesh: Mesh) -> NDArray[Any]:
        """(L,) of LIGHT_START, of a table of lights, of which the first ones are `distant`: what
        comes from there starts outside of all. Of emissive surfaces of many triangles all are
        where the first is, and so are many lamps of one medium."""
        table = LIGHT_START.zeros(len(lights))
        table["inside"][:, 0] = self.air
        near = lights[distant:]
        _, first, group, counts = np.unique(
            _groups(scene, near), return_index=True, return_inverse=True, return_counts=True
        )
        whose = np.where(counts[group] > MOST_PLACES, first[group], np.arange(len(near)))
        asked, back = np.unique(whose, return_inverse=True)
        table["inside"][distant:] = self.around(_middles(near[asked]), mesh, "shadow")[back]
        return table


def _boxes(triangles: NDArray[Any], surfaces: NDArray[np.int64]) -> tuple[Array, Array]:
    """The lowest and highest corners (s, 3) of the boxes about all triangles of surfaces (s,), in
    order."""
    own = triangles[np.isin(triangles["surface"], surfaces)]
    which, corners = np.searchsorted(surfaces, own["surface"]), _corners(own)
    low, high = (np.full((len(surfaces), 3), x) for x in (np.inf, -np.inf))
    np.minimum.at(low, which, corners.min(axis=1))
    np.maximum.at(high, which, corners.max(axis=1))
    return low, high


def _corners(triangles: NDArray[Any]) -> Array:
    """(t, 3, 3) of a table's rows."""
    found: Array = np.stack([triangles[x] for x in "abc"], axis=1).astype(np.float64)
    return found


def _wearers(scene: Scene) -> list[int]:
    """Of each material the surface that wears it; SEVERAL also where none does."""
    count = len(scene.materials)
    low, high = np.full(count, len(scene.surfaces)), np.full(count, SEVERAL)
    np.minimum.at(low, scene.material, scene.surface)
    np.maximum.at(high, scene.material, scene.surface)
    found: list[int] = np.where(low == high, low, SEVERAL).tolist()
    return found


@dataclass(frozen=True)
class _GridTables:
    """What media that have grids have on these."""

    numbers: list[float]  # of each the number of its grid, above 0; what is beyond it follows it
    emission: list[float]  # and which voxel is the first of what it emits, below 0: none
    grids: NDArray[Any]  # (G,) of GRID
    voxels: NDArray[Any]  # (n,) of VOXEL

    @staticmethod
    def of(media: Sequence[Medium], frame: Frame) -> _GridTables:
        """In their order."""
        numbers: list[float] = []
        emission: list[float] = []
        grids: list[Any] = []
        blocks: list[NDArray[np.float32]] = []
        first = 0
        for medium in media:
            assert medium.grid
            numbers.append(len(grids) + 1.0)
            for grid in (medium.grid, medium.grid.beyond):
                if grid:
                    row, own = _grid_of(medium, grid, frame)
                    if grid is not medium.grid:
                        ends = far_ends((grid.high - grid.low) / 2)
                        row["finer"] = (row["count"] - 1.0) / (2.0 * ends)
                    row["first"] += first
                    row["first_scattering"] += first * (row["first_scattering"] >= 0.0)
                    grids.append(row)
                    blocks += own
                    first += sum(map(len, own))
            emission.append(float(first) if medium.glows else -1.0)
            if medium.glows:
                blocks.append(_quads(_over(medium.grid.emission, medium.coefficients[2])))
                first += len(blocks[-1])
        table, voxels = GRID.zeros(len(grids)), VOXEL.zeros(first)
        for number, row in enumerate(grids):
            table[number] = row
        if blocks:
            voxels["values"] = np.concatenate(blocks)
        return _GridTables(numbers, emission, table, voxels)


def _grid_of(
    medium: Medium, grid: Grid, frame: Frame
) -> tuple[NDArray[Any], list[NDArray[np.float32]]]:
    """Its row of GRID, whose voxels are the first ones, and these."""
    row = GRID.zeros(1)[0]
    row["low"], row["high"] = (frame.points(place) for place in (grid.low, grid.high))
    row["count"] = grid.extinction.shape[2::-1]
    row["finer"] = (row["count"] - 1.0) * frame.scale / (grid.high - grid.low)
    row["goes_on"] = grid.beyond is not None
    absorbed, scattered, _ = medium.coefficients
    lost = _over(grid.extinction, absorbed + scattered)
    turned = _over(grid.scattering, scattered)
    goes_with = _same(turned, lost * (scattered > 0.0))
    row["channels"] = channels = 1 if goes_with and _same(lost, lost[..., :1]) else 3
    blocks = [_quads(lost[..., :channels])]
    row["first_scattering"] = -1.0 if goes_with else len(blocks[0])
    return row, blocks if goes_with else [*blocks, _quads(turned)]


def _over(values: NDArray[np.float32], mean: Array) -> NDArray[np.float32]:
    """Values (z, y, x, 3) over their means; 0 where these are."""
    over = np.divide(1.0, mean, out=np.zeros(3), where=mean > 0.0)
    return values * over.astype(np.float32)


def _same(one: NDArray[np.float32], other: NDArray[np.float32]) -> bool:
    """Whether two are, of a mean of 1."""
    return bool(np.abs(one - other).mean() <= SAME)


def _quads(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """(n, 4) as VOXEL has them, of values (z, y, x, channels), one channel after the other."""
    along_x = np.concatenate([values[:, :, 1:], values[:, :, -1:]], axis=2)
    pairs = np.stack([values, along_x], axis=-1)
    along_y = np.concatenate([pairs[:, 1:], pairs[:, -1:]], axis=1)
    quads = np.moveaxis(np.concatenate([pairs, along_y], axis=-1), 3, 0)
    return np.ascontiguousarray(quads).reshape(-1, 4)


def beams(scene: Scene, lights: NDArray[Any], bounds: Bounds, distant: int) -> NDArray[Any]:
    """(B,) of BEAM, none perhaps, of a table of lights and where they shine, of which the first
    ones are `distant`: lamps, and emissive surfaces, MOST_BEAMS of them at most."""
    is_near = (np.arange(len(lights)) >= distant) & (bounds.flux > 0.0)
    is_near &= ~is_of_media(lights)  # all about those is bright
    if not is_near.any():
        return BEAM.zeros(0)
    near, flux = lights[is_near], bounds.flux[is_near]
    places = _middles(near)
    _, first, group = np.unique(_groups(scene, near), return_index=True, return_inverse=True)
    sums = np.bincount(group, flux)
    means = [np.bincount(group, flux * place) / sums for place in places.T]
    brightest = np.argsort(-sums, kind="stable")[:MOST_BEAMS]
    table = BEAM.zeros(len(brightest))
    table["position"] = np.stack(means, axis=1)[brightest]
    table["up_to"] = np.cumsum(sums[brightest]) / sums[brightest].sum()
    whose = np.flatnonzero(is_near)[first[brightest]]
    table["axis"] = bounds.axis[whose]
    is_cone = (bounds.reach[whose] == 1.0) & (bounds.spread[whose] > 0.0)  # none beside it
    table["cosine"] = np.where(is_cone, bounds.spread[whose], 0.0)
    return table


def _groups(scene: Scene, lights: NDArray[Any]) -> NDArray[np.int64]:
    """A number for each light: one for all of an emissive surface, or of what is inside it."""
    of_mesh = _is_of_mesh(lights)
    group = np.arange(len(lights))
    surfaces = scene.surface[lights["parameters"][of_mesh, 3].astype(np.int64)]
    group[of_mesh] = len(lights) + surfaces
    glows = is_of_media(lights)
    of_surface = lights["parameters"][glows, 1].astype(np.int64)
    group[glows] = len(lights) + len(scene.surfaces) + of_surface
    return group


def _is_of_mesh(lights: NDArray[Any]) -> NDArray[np.bool_]:
    found: NDArray[np.bool_] = lights["kind"] == light_kinds()[TRIANGLE].number
    return found


def _middles(lights: NDArray[Any]) -> Array:
    """Of lights, (n, 3)."""
    places: Array = lights["position"].astype(np.float64)
    of_mesh = _is_of_mesh(lights)
    others = lights["parameters"][of_mesh, :3] + lights["more"][of_mesh, :3]
    places[of_mesh] = (places[of_mesh] + others) / 3.0
    return places


def from_afar(lights: Iterable[Light], air: Medium) -> tuple[Light, ...]:
    """What is left of lights where a medium is everywhere: of what comes from afar nothing, but of
    channels that it does not touch. One that differs may end somewhere."""
    if not air.is_there or air.varies:
        return tuple(lights)
    is_clear = air.coefficients[:2].sum(axis=0) == 0.0
    found = []
    for light in lights:
        if light_kinds()[light.kind].is_distant:
            light = replace(light, power=triple(np.where(is_clear, light.power, 0.0)))
        found += [light] * (max(light.power) > 0.0)
    return tuple(found)
