# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangles that glow, as lights."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..kernels.records import LIGHT
from ..scene import FOUND_BY, Material
from .geometry import Mesh
from .kinds import light_kinds

TRIANGLE = "triangle"  # the kind
EVERYONE = (1 << len(FOUND_BY)) - 1  # finds them


def glowing(mesh: Mesh, materials: tuple[Material, ...]) -> NDArray[np.intp]:
    """Where in a mesh those are that glow, in the order of their numbers in the scene."""
    glows = np.array([material.glows for material in materials], bool)
    if not glows.any():
        return np.zeros(0, np.intp)
    places = np.flatnonzero(glows[mesh.triangles["material"].astype(int)])
    return places[np.argsort(mesh.triangles["number"][places])]


def triangle_lights(mesh: Mesh, materials: tuple[Material, ...]) -> NDArray[Any]:
    """(n,) of LIGHT, of those that glow; which of them photons start at is not said yet."""
    triangles = mesh.triangles[glowing(mesh, materials)]
    table = LIGHT.zeros(len(triangles))
    if not len(triangles):
        return table
    a, b, c = (triangles[corner].astype(np.float64) for corner in "abc")
    across, normal = b - a, np.cross(b - a, c - a)
    table["position"], table["kind"] = a, light_kinds()[TRIANGLE].number
    table["axis"] = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    table["across"] = across / np.linalg.norm(across, axis=1, keepdims=True)
    emission = np.array([material.emission for material in materials])
    table["power"] = emission[triangles["material"].astype(int)]
    table["found_by"] = EVERYONE
    table["parameters"][:, :3], table["parameters"][:, 3] = b, triangles["number"]
    table["more"][:, :3] = c
    return table
