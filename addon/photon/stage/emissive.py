# SPDX-License-Identifier: GPL-3.0-or-later
"""Emissive triangles, as lights."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..kernels.lights import EXCLUDES
from ..kernels.records import LIGHT
from ..scene import FOUND_BY, RAY_BITS, Scene
from .geometry import Mesh
from .kinds import light_kinds

Doubles = NDArray[np.float64]

TRIANGLE = "triangle"  # the kind
# Triangles are one lamp whose area is this share of the square of their box's longest side: a ball
# has 3.1 of it, a square 1, and ten balls in a row, as far apart as they are wide, 0.09.
ONE_LAMP = 0.3
EVERYONE = (1 << len(FOUND_BY)) - 1  # finds them
_OF_LOBES = ("diffuse", "glossy", "transmission")
# Who finds emissive triangles, if one of these kinds of rays meets their surface: shadow rays are
# sent for others.
FINDERS = {
    "camera": ("camera",),
    "diffuse": ("diffuse",),
    "glossy": ("glossy",),
    "transmission": ("glossy",),
    "translucent": ("diffuse",),
    "media": ("diffuse", "glossy"),
    "chains": _OF_LOBES,
    "passing": _OF_LOBES,
}


@dataclass(frozen=True)
class Emission:
    """Of emissive triangles, in order of number."""

    radiance: Doubles  # (n, 3) in the mean [W/(m^2 sr)]
    shares: NDArray[np.intp]  # (n,) texel where those of a triangle begin, + 1; 0: it has none
    table: NDArray[np.float32]  # (k, 4) of the mean, in each channel (glsl/lib/emission_share.glsl)

    @staticmethod
    def even(radiance: Doubles) -> Emission:
        """The same everywhere."""
        return Emission(radiance, np.zeros(len(radiance), np.intp), np.zeros((0, 4), np.float32))


def emissive_triangles(scene: Scene, mesh: Mesh) -> NDArray[np.intp]:
    """The numbers in the scene of the triangles that are lights: of what stands still those with
    an area, else all, so that at each instant there are as many."""
    emissive = np.array([material.is_emissive for material in scene.materials], bool)
    if not emissive.any():
        return np.zeros(0, np.intp)
    if scene.moving:
        return np.flatnonzero(emissive[scene.material])
    shown = mesh.triangles["material"].astype(int)
    return np.sort(mesh.triangles["number"][emissive[shown]].astype(np.intp))


def found_by(scene: Scene, numbers: NDArray[np.intp]) -> NDArray[np.int64]:
    """(n,) bits of who finds triangles of these numbers in the scene (lib/light.glsl)."""
    found = np.full(len(numbers), EVERYONE)
    if len(scene.excludes):
        found += EXCLUDES * scene.excludes[scene.surface[numbers]].astype(np.int64)
    if not len(scene.visible):
        return found
    rays = scene.visible[scene.surface[numbers]]
    for finder, kinds in FINDERS.items():
        met = sum(RAY_BITS[kind] for kind in kinds)
        found[rays & met == 0] &= ~(1 << FOUND_BY.index(finder))
    return found


def emits_for_some_only(scene: Scene, mesh: Mesh) -> bool:
    """Whether some emissive triangle does not light all kinds of surfaces."""
    wanted = sum(1 << FOUND_BY.index(name) for name in ("diffuse", "glossy"))
    found = found_by(scene, emissive_triangles(scene, mesh))
    return bool((found & wanted != wanted).any() or (found >= EXCLUDES).any())


def triangle_lights(scene: Scene, mesh: Mesh, emission: Emission) -> NDArray[Any]:
    """(n,) of LIGHT, of the emissive ones; which of them photons start at is not said yet. Those
    that have no area in the mesh are dark."""
    numbers = emissive_triangles(scene, mesh)
    table = LIGHT.zeros(len(numbers))
    if not len(numbers):
        return table
    places = mesh.places_of(numbers)
    is_there = places >= 0
    table["kind"], table["parameters"][:, 3] = light_kinds()[TRIANGLE].number, numbers
    table["axis"], table["across"] = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)
    table["found_by"] = found_by(scene, numbers)
    table["power"][is_there] = emission.radiance[is_there]
    table["more"][:, 3] = emission.shares
    table[is_there] = _of_each(table[is_there], mesh.triangles[places[is_there]])
    return table


def are_one_lamp(lights: NDArray[Any], some: NDArray[np.bool_]) -> bool:
    """Whether some of a table's lights (L,) are triangles that fill the box about them."""
    ours = lights[some]
    if not len(ours) or (ours["kind"] != light_kinds()[TRIANGLE].number).any():
        return False
    corners = ours["position"], ours["parameters"][:, :3], ours["more"][:, :3]
    a, b, c = (corner.astype(np.float64) for corner in corners)
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()
    longest = np.ptp(np.concatenate([a, b, c]), axis=0).max()
    return bool(area >= ONE_LAMP * longest**2)


def _of_each(table: NDArray[Any], triangles: NDArray[Any]) -> NDArray[Any]:
    """The lights of triangles of a mesh."""
    a, b, c = (triangles[corner].astype(np.float64) for corner in "abc")
    across, normal = b - a, np.cross(b - a, c - a)
    table["position"] = a
    table["axis"] = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    table["across"] = across / np.linalg.norm(across, axis=1, keepdims=True)
    table["parameters"][:, :3], table["more"][:, :3] = b, c
    return table
