# SPDX-License-Identifier: GPL-3.0-or-later
"""Export materials as k_d, k_s and one specular exponent."""

from __future__ import annotations

from dataclasses import dataclass, field

import bpy
import numpy as np
from numpy.typing import NDArray

from ...photon.scene import MIRROR, Material
from .nodes import Colour, Graph, colour_text
from .report import Notes
from .shaders import BLACK, CLEAR, Lobes, read_shader

NO_SURFACE = -1
# Cycles' default surface, for slots without a material.
DEFAULT_GREY = (0.8, 0.8, 0.8)
# k_d + k_s of colours stored in float32 may pass 1 by this much without being worth a warning.
ROUNDING = 1e-5


@dataclass
class MaterialTable:
    """The materials met so far, each converted once."""

    notes: Notes
    override: bpy.types.Material | None = None  # the view layer's
    materials: list[Material] = field(default_factory=list)
    _numbers: dict[str | None, int] = field(default_factory=dict)
    _averages: dict[str, Colour | None] = field(default_factory=dict)

    def index_of(self, material: bpy.types.Material | None, object_name: str) -> int:
        """Return the number of a Blender material, NO_SURFACE if it has none."""
        material = self.override or material
        if material is None:
            self.notes.exact(f"Object '{object_name}'", "No material", "the default grey, 0.8")
        key = material.name_full if material else None
        if key not in self._numbers:
            exported = self._export(material)
            self._numbers[key] = NO_SURFACE if exported is None else len(self.materials)
            if exported is not None:
                self.materials.append(exported)
        return self._numbers[key]

    def _export(self, material: bpy.types.Material | None) -> Material | None:
        if material is None:
            return Material("", DEFAULT_GREY)
        owner = f"Material '{material.name}'"
        lobes = self._lobes(material, owner)
        if lobes is CLEAR:
            self.notes.ignored(owner, "No surface", "objects or faces that wear it are left out")
            return None
        diffuse, specular, exponent = joined(lobes, owner, self.notes)
        diffuse, specular = bounded(diffuse, specular, owner, self.notes)
        if not self.notes.mention(owner):
            self.notes.exact(owner, "Shader")
        return Material(material.name, _triple(diffuse), _triple(specular), exponent)

    def _lobes(self, material: bpy.types.Material, owner: str) -> Lobes | None:
        if not has_nodes(material):
            self.notes.exact(owner, "Viewport colour", "it has no nodes")
            return Lobes(np.array(material.diffuse_color[:3], np.float64))
        graph = Graph(material.node_tree, owner, self.notes, self._averages)
        output = graph.output("OUTPUT_MATERIAL")
        if output is None:
            self.notes.exact(owner, "No Material Output", "black, as in Cycles")
            return BLACK
        if output.inputs["Volume"].is_linked:
            self.notes.ignored(owner, "Volume", "not rendered")
        if output.inputs["Displacement"].is_linked:
            self.notes.ignored(owner, "Displacement", "not rendered")
        node, scope = graph.surface("OUTPUT_MATERIAL")
        if node is None:
            if output.inputs["Volume"].is_linked:
                return CLEAR
            self.notes.approximated(owner, "Surface", "no shader is linked to it: rendered black")
        return read_shader(graph, node, scope)


def has_nodes(owner: bpy.types.Material | bpy.types.World) -> bool:
    """Whether the nodes of a material or world are in use; from Blender 5.0 they always are."""
    if owner.node_tree is None:
        return False
    return bpy.app.version >= (5, 0, 0) or owner.use_nodes


def joined(
    lobes: Lobes, owner: str, notes: Notes
) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """Return k_d, k_s and the exponent; several specular lobes become the strongest one."""
    specular = [(k_s, exponent) for k_s, exponent in lobes.specular if np.any(k_s)]
    if not specular:
        return lobes.diffuse, np.zeros(3), MIRROR
    weights: dict[float, float] = {}
    for k_s, exponent in specular:
        weights[exponent] = weights.get(exponent, 0.0) + float(np.sum(k_s))
    strongest = max(weights, key=lambda exponent: weights[exponent])
    if len(weights) > 1:
        shape = "a mirror" if strongest == MIRROR else f"a Phong lobe of exponent {strongest:.4g}"
        notes.approximated(owner, "Reflections of different roughness", f"joined to {shape}")
    return lobes.diffuse, np.sum([k_s for k_s, _ in specular], axis=0), strongest


def bounded(
    diffuse: NDArray[np.float64], specular: NDArray[np.float64], owner: str, notes: Notes
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return k_d and k_s within [0, 1] and k_d + k_s <= 1 per channel; note what had to give."""
    diffuse = _clamped(diffuse, "Diffuse colour", owner, notes)
    specular = _clamped(specular, "Specular colour", owner, notes)
    total = diffuse + specular
    if total.max() > 1.0 + ROUNDING:
        notes.approximated(
            owner, "Albedo above 1", f"diffuse + specular = {_text(total)} is scaled down to 1"
        )
    scale = 1.0 / np.maximum(total, 1.0)
    return diffuse * scale, specular * scale


def _clamped(
    colour: NDArray[np.float64], feature: str, owner: str, notes: Notes
) -> NDArray[np.float64]:
    valid = np.where(np.isnan(colour), 0.0, colour).clip(0.0, 1.0)
    if not np.allclose(valid, colour, rtol=0.0, atol=ROUNDING):
        notes.approximated(owner, feature, f"{_text(colour)} is clamped to {_text(valid)}")
    return valid


def _triple(values: NDArray[np.float64]) -> Colour:
    r, g, b = (float(value) for value in values)
    return r, g, b


def _text(values: NDArray[np.float64]) -> str:
    return colour_text(_triple(values))
