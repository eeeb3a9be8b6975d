# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangles that glow, as lights."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..kernels.records import LIGHT
from ..scene import FOUND_BY, Scene
from .geometry import Mesh
from .kinds import light_kinds

TRIANGLE = "triangle"  # the kind
EVERYONE = (1 << len(FOUND_BY)) - 1  # finds them


def glowing(scene: Scene, mesh: Mesh) -> NDArray[np.intp]:
    """The numbers in the scene of the triangles that are lights: of what stands still those with
    an area, else all, so that at each instant there are as many."""
    glows = np.array([material.glows for material in scene.materials], bool)
    if not glows.any():
        return np.zeros(0, np.intp)
    if scene.moving:
        return np.flatnonzero(glows[scene.material])
    shown = mesh.triangles["material"].astype(int)
    return np.sort(mesh.triangles["number"][glows[shown]].astype(np.intp))


def triangle_lights(scene: Scene, mesh: Mesh) -> NDArray[Any]:
    """(n,) of LIGHT, of those that glow; which of them photons start at is not said yet. Those that
    have no area in the mesh are dark."""
    numbers = glowing(scene, mesh)
    table = LIGHT.zeros(len(numbers))
    if not len(numbers):
        return table
    order = np.argsort(mesh.triangles["number"])
    there = mesh.triangles["number"][order]
    at = np.minimum(np.searchsorted(there, numbers), max(len(there) - 1, 0))
    is_there = there[at] == numbers if len(there) else np.zeros(len(numbers), bool)
    table["kind"], table["parameters"][:, 3] = light_kinds()[TRIANGLE].number, numbers
    table["axis"], table["across"] = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)
    table["found_by"] = EVERYONE
    table[is_there] = _of_each(table[is_there], mesh.triangles[order[at[is_there]]], scene)
    return table


def _of_each(table: NDArray[Any], triangles: NDArray[Any], scene: Scene) -> NDArray[Any]:
    """The lights of triangles of a mesh."""
    a, b, c = (triangles[corner].astype(np.float64) for corner in "abc")
    across, normal = b - a, np.cross(b - a, c - a)
    table["position"] = a
    table["axis"] = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    table["across"] = across / np.linalg.norm(across, axis=1, keepdims=True)
    emission = np.array([material.emission for material in scene.materials])
    table["power"] = emission[triangles["material"].astype(int)]
    table["parameters"][:, :3], table["more"][:, :3] = b, c
    return table
