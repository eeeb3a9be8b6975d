# SPDX-License-Identifier: GPL-3.0-or-later
"""Glass that lets light of the sun and the world straight on where two faces are parallel."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..scene import MOST_BOUNCES, RAY_BITS, RGB, Light, Material, Scene, reflecting
from .geometry import Mesh
from .kinds import light_kinds
from .normals import unit

FLAT = 1.0 - 1e-6  # cosine between a flat face's normals: glsl/lib/pane.glsl
OPPOSITE = -0.998  # cosine between rounded normals of faces back to back
MET_BY = sum(RAY_BITS[name] for name in ("shadow", "diffuse", "glossy", "transmission"))
MOST_WAYS = 1024  # of flat faces that are compared; of more some will be


def pane_of(material: Material) -> tuple[float, RGB] | None:
    """The index and the colour of clear glass, if a material is smooth glass alone, the same
    everywhere."""
    lobes = reflecting(material.lobes)
    if [lobe.kind for lobe in lobes] != ["glass"] or max(material.diffuse) > 0.0:
        return None
    (lobe,), varying = lobes, material.varying
    parameters: Mapping[str, Any] = lobe.parameters
    plain = not lobe.varying and not any(x in varying for x in ("diffuse", "normal", "base"))
    body = parameters["open"] == 0.0 and parameters["reflects"] > 0.0
    if not (plain and body and lobe.weight == 1.0 and parameters["tint"] == (1.0, 1.0, 1.0)):
        return None
    return float(parameters["ior"]), lobe.colour


def has_panes(scene: Scene, mesh: Mesh, lights: Collection[Light]) -> bool:
    """Whether light of one of these may come straight through such glass: some of it has flat faces
    back to back. Never if the scene shall not have what glass refracts, or where shadow rays and
    photons might differ: surfaces are hidden from some of them, or such a light is limited."""
    afar = [light for light in lights if light_kinds()[light.kind].is_distant]
    if "refractive" not in scene.caustics or not afar:
        return False
    if any(light.cares_who_is_lit or light.max_bounces < MOST_BOUNCES for light in afar):
        return False
    if bool((mesh.visible & MET_BY != MET_BY).any()):
        return False
    ours = np.array([pane_of(material) is not None for material in scene.materials], bool)
    if not ours.any():
        return False
    worn = mesh.triangles["material"].astype(int)
    which = np.flatnonzero(ours[worn])
    corners, normals = mesh.triangles[which], mesh.normals[which]
    faces = np.cross(corners["b"] - corners["a"], corners["c"] - corners["a"]).astype(float)
    faces /= np.maximum(np.linalg.norm(faces, axis=1, keepdims=True), 1e-30)
    flat = np.minimum.reduce([np.abs((unit(normals[x]) * faces).sum(axis=1)) for x in "abc"]) > FLAT
    return any(_back_to_back(faces[flat & (worn[which] == x)]) for x in np.flatnonzero(ours))


def _back_to_back(faces: NDArray[np.float64]) -> bool:
    """Whether two of these unit normals are opposite."""
    ways = np.unique(np.round(faces, 3), axis=0)
    if len(ways) > MOST_WAYS:
        return True
    return len(ways) > 0 and bool((ways @ ways.T).min() < OPPOSITE)
