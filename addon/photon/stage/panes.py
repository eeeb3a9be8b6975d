# SPDX-License-Identifier: GPL-3.0-or-later
"""Glass that lets light of the sun and the world straight on where two faces are parallel."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np

from ..scene import RGB, Material, Scene, reflecting
from .geometry import Mesh
from .kinds import light_kinds

FLAT = 1.0 - 1e-6  # cosine between a flat face's normals: glsl/lib/pane.glsl


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


def has_panes(scene: Scene, mesh: Mesh, lights: Collection[str]) -> bool:
    """Whether light of one of these kinds may come through such glass with flat faces; never if
    the scene shall not have what glass refracts."""
    if "refractive" not in scene.caustics or not any(light_kinds()[x].is_distant for x in lights):
        return False
    ours = np.array([pane_of(material) is not None for material in scene.materials], bool)
    which = np.flatnonzero(ours[mesh.triangles["material"].astype(int)]) if ours.any() else ()
    if not len(which):
        return False
    corners, normals = mesh.triangles[which], mesh.normals[which]
    flat = np.cross(corners["b"] - corners["a"], corners["c"] - corners["a"]).astype(float)
    flat /= np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-30)
    cosines = [np.abs((normals[x] * flat).sum(axis=1)) for x in "abc"]
    return bool((np.minimum.reduce(cosines) > FLAT).any())
