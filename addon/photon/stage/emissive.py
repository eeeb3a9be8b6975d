# SPDX-License-Identifier: GPL-3.0-or-later
"""Emissive triangles, as lights."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...streams import TABLE_WIDTH, Device
from ...streams.device import Layer
from ..kernels.records import LIGHT
from ..kernels.surface_emission import SurfaceEmission
from ..scene import FOUND_BY, RAY_BITS, Scene
from .geometry import Mesh
from .kinds import light_kinds
from .normals import unit
from .points import asked_at
from .programs import ProgramNeeds, of_emission

TRIANGLE = "triangle"  # the kind
POINTS = 64  # of a triangle that tell what it radiates in the mean, half of them on its back
EVERYONE = (1 << len(FOUND_BY)) - 1  # finds them
# Who finds emissive triangles, if one of these kinds of rays meets their surface: shadow rays are
# sent for others.
FINDERS = {
    "camera": ("camera",),
    "diffuse": ("diffuse",),
    "glossy": ("glossy",),
    "chains": ("diffuse", "glossy", "transmission"),
}


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
    return bool((found_by(scene, emissive_triangles(scene, mesh)) & wanted != wanted).any())


def triangle_lights(scene: Scene, mesh: Mesh, radiance: NDArray[np.float64]) -> NDArray[Any]:
    """(n,) of LIGHT, of the emissive ones, of a radiance (n, 3); which of them photons start at is
    not said yet. Those that have no area in the mesh are dark."""
    numbers = emissive_triangles(scene, mesh)
    table = LIGHT.zeros(len(numbers))
    if not len(numbers):
        return table
    places = mesh.places_of(numbers)
    is_there = places >= 0
    table["kind"], table["parameters"][:, 3] = light_kinds()[TRIANGLE].number, numbers
    table["axis"], table["across"] = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)
    table["found_by"] = found_by(scene, numbers)
    table["power"][is_there] = radiance[is_there]
    table[is_there] = _of_each(table[is_there], mesh.triangles[places[is_there]])
    return table


def _of_each(table: NDArray[Any], triangles: NDArray[Any]) -> NDArray[Any]:
    """The lights of triangles of a mesh."""
    a, b, c = (triangles[corner].astype(np.float64) for corner in "abc")
    across, normal = b - a, np.cross(b - a, c - a)
    table["position"] = a
    table["axis"] = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    table["across"] = across / np.linalg.norm(across, axis=1, keepdims=True)
    table["parameters"][:, :3], table["more"][:, :3] = b, c
    return table


def mean_emission(
    device: Device, layer: Layer, mesh: Mesh, scene: Scene, textures: Mapping[str, Any]
) -> NDArray[np.float64]:
    """What emissive triangles radiate in the mean (n, 3): of those whose program tells, of POINTS
    places, looked at from either side; `textures` are the tables that programs read."""
    numbers = emissive_triangles(scene, mesh)
    number = scene.material[numbers]
    emission = np.array([material.emission for material in scene.materials]).reshape(-1, 3)
    found: NDArray[np.float64] = emission[number]
    varying = [at for at, material in enumerate(scene.materials) if "emission" in material.varying]
    if not varying:
        return found
    needs = ProgramNeeds.of_some(scene, of_emission)
    kernel = SurfaceEmission(device, layer, needs.defines, made=needs.made)
    tables = {name: textures[name] for name in kernel.tables}
    places = mesh.places_of(numbers)
    wanted = np.flatnonzero(np.isin(number, varying) & (places >= 0))
    for first in range(0, len(wanted), TABLE_WIDTH):
        some = wanted[first : first + TABLE_WIDTH]
        found[some] = _emission_of(kernel, mesh.triangles[places[some]], places[some], tables)
    kernel.release()
    return found


def _to_them(across: NDArray[np.float64], normals: NDArray[np.float64]) -> NDArray[np.float64]:
    """(POINTS, n, 3): as often from a direction as what emits evenly sends light there, from either
    side in turn; what emits by the direction lights as much as all of them see."""
    number = np.arange(POINTS)[:, None]
    squared, turn = ((number // 2 + 0.5) * (0.8191725134, 0.6710436067)).T % 1.0
    sine, angle = np.sqrt(1.0 - squared)[:, None, None], 2.0 * np.pi * turn[:, None, None]
    level = np.cos(angle) * across + np.sin(angle) * np.cross(normals, across)
    sides = np.where(number % 2, 1.0, -1.0)[..., None]
    found: NDArray[np.float64] = sides * np.sqrt(squared)[:, None, None] * normals + sine * level
    return found


def _emission_of(
    kernel: SurfaceEmission,
    triangles: NDArray[Any],
    places: NDArray[np.intp],
    tables: Mapping[str, Any],
) -> NDArray[np.float64]:
    a, b, c = (triangles[corner].astype(np.float64) for corner in "abc")
    normals = unit(np.cross(b - a, c - a))
    # Points of a sequence that covers the square evenly (Roberts 2018), folded to the triangle.
    u, v = ((np.arange(POINTS)[:, None] + 0.5) * (0.7548776662, 0.5698402909)).T % 1.0
    folded = u + v > 1.0
    u, v = np.where(folded, 1.0 - u, u), np.where(folded, 1.0 - v, v)
    weights = np.stack([u, v], axis=1)[:, None]
    found = asked_at(kernel, places, weights, _to_them(unit(b - a), normals), tables)
    mean: NDArray[np.float64] = found.mean(axis=0, dtype=float)
    return mean
