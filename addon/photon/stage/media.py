# SPDX-License-Identifier: GPL-3.0-or-later
"""Media as tables, and which of them a place is in."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import SceneError
from ..kernels.records import BEAM, INTERIOR, LIGHT_START
from ..scene import RAY_BITS, Light, Material, Medium, Scene
from .emissive import TRIANGLE
from .geometry import Mesh
from .kinds import light_kinds
from .light_tree import Bounds

NUMBERS = 4096  # of media: two share a float (lib/media.glsl)
MOST_MEDIA = 4  # that a place is in
# A closed mesh turns once about what is inside it, and half as much about what is on it.
INSIDE = 0.75
AT_ONCE = 1 << 17  # places times triangles, each of which takes some 300 bytes meanwhile
MOST_BEAMS = 16
MOST_PLACES = 64  # of an emissive surface, each of which is looked at

Array = NDArray[np.float64]


@dataclass(frozen=True)
class MediaThere:
    """Whether a scene has media, and such as scatter light."""

    any: bool
    scattering: bool

    @staticmethod
    def of(scene: Scene, materials: Iterable[Material]) -> MediaThere:
        """With these of its materials."""
        media = [scene.air, *(material.medium for material in materials)]
        return MediaThere(any(x.is_there for x in media), any(x.scatters for x in media))


class Media:
    """A scene's, each by a number above 0; that which is everywhere is the first."""

    def __init__(self, scene: Scene, scale: float) -> None:
        """`scale`: metres of a scene unit. SceneError if there are too many."""
        found: dict[Medium, int] = {}
        for medium in (scene.air, *(material.medium for material in scene.materials)):
            if medium.is_there:
                found.setdefault(medium, len(found) + 1)
        if len(found) >= NUMBERS:
            text = f"scene.materials: {len(found)} different media, {NUMBERS - 1} are possible"
            raise SceneError(text)
        self.count = len(found)
        self.scatters = any(medium.scatters for medium in found)
        self.air = found.get(scene.air, 0)
        self.of_materials = np.array([found.get(m.medium, 0) for m in scene.materials], np.int64)
        self._visible = scene.visible
        self.table = INTERIOR.zeros(max(len(found), 1))
        for row, medium in zip(self.table, found, strict=False):
            row["scattering"] = scale * np.array(medium.scattering)
            row["extinction"] = row["scattering"] + scale * np.array(medium.absorption)
            row["anisotropy"] = medium.anisotropy

    def around(self, places: Array, mesh: Mesh, ray: str) -> NDArray[np.float32]:
        """Which media places (n, 3) are in, (n, 2) as MEDIUM has it, for rays of a name, to which
        some surfaces are not visible."""
        inside = np.zeros((len(places), MOST_MEDIA), np.int64)
        inside[:, 0] = self.air
        triangles = mesh.triangles
        numbers = self.of_materials[triangles["material"].astype(np.int64)]
        for number in np.unique(numbers[numbers > 0]):
            of_number = triangles[numbers == number]
            for surface in np.unique(of_number["surface"]).astype(np.int64):
                if self._visible.size and not self._visible[surface] & RAY_BITS[ray]:
                    continue
                own = of_number[of_number["surface"] == surface]
                there = _turns(places, *(own[x].astype(np.float64) for x in "abc")) > INSIDE
                free = inside.argmin(axis=1)
                there &= inside[np.arange(len(places)), free] == 0
                inside[there, free[there]] = number
        both: NDArray[np.float32] = (inside.reshape(-1, 2, 2) @ (1, NUMBERS)).astype(np.float32)
        return both

    def left_after(self, inside: NDArray[np.float32], ways: Array) -> Array:
        """What ways (n,) [scene units] leave of light, (n, 3); `inside`: (n, 2) as MEDIUM has
        it."""
        both = inside.astype(np.int64)
        extinction = np.concatenate([np.zeros((1, 3)), self.table["extinction"]])
        sums = sum(extinction[part] for part in (*(both % NUMBERS).T, *(both // NUMBERS).T))
        with np.errstate(over="ignore", under="ignore"):
            left: Array = np.exp(-ways[:, None] * sums)
        return left

    def starts(self, scene: Scene, lights: NDArray[Any], distant: int, mesh: Mesh) -> NDArray[Any]:
        """(L,) of LIGHT_START, of a table of lights, of which the first ones are `distant`: what
        comes from there starts outside of all. Of emissive surfaces of many triangles all are
        where the first is."""
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


def beams(scene: Scene, lights: NDArray[Any], bounds: Bounds, distant: int) -> NDArray[Any]:
    """(B,) of BEAM, none perhaps, of a table of lights and where they shine, of which the first
    ones are `distant`: lamps, and emissive surfaces, MOST_BEAMS of them at most."""
    is_near = (np.arange(len(lights)) >= distant) & (bounds.flux > 0.0)
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
    """A number for each light: one for all of an emissive surface."""
    of_mesh = _is_of_mesh(lights)
    group = np.arange(len(lights))
    surfaces = scene.surface[lights["parameters"][of_mesh, 3].astype(np.int64)]
    group[of_mesh] = len(lights) + surfaces
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


def _turns(places: Array, a: Array, b: Array, c: Array) -> Array:
    """How often triangles turn about places, (n,): their solid angles over all around (Van Oosterom
    & Strackee 1983)."""
    turns = np.zeros(len(places))
    low, high = (f([f(x, axis=0) for x in (a, b, c)], axis=0) for f in (np.min, np.max))
    within = np.flatnonzero(((places >= low) & (places <= high)).all(axis=1))
    step = max(AT_ONCE // max(len(a), 1), 1)
    for first in range(0, len(within), step):
        some = within[first : first + step]
        corners = [x[None] - places[some, None] for x in (a, b, c)]
        u, v, w = (x / np.maximum(np.linalg.norm(x, axis=2, keepdims=True), 1e-30) for x in corners)
        volume = np.einsum("nti,nti->nt", u, np.cross(v, w))
        dots = [np.einsum("nti,nti->nt", x, y) for x, y in ((u, v), (v, w), (w, u))]
        turns[some] = np.arctan2(volume, 1.0 + sum(dots)).sum(axis=1) / (2.0 * np.pi)
    return np.abs(turns)


def from_afar(lights: Iterable[Light], air: Medium) -> tuple[Light, ...]:
    """What is left of lights where a medium is everywhere: of what comes from afar nothing, but of
    channels that it does not touch."""
    if not air.is_there:
        return tuple(lights)
    is_clear = np.add(air.absorption, air.scattering) == 0.0
    found = []
    for light in lights:
        if light_kinds()[light.kind].is_distant:
            red, green, blue = map(float, np.where(is_clear, light.power, 0.0))
            light = replace(light, power=(red, green, blue))
        found += [light] * (max(light.power) > 0.0)
    return tuple(found)
