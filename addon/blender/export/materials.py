# SPDX-License-Identifier: GPL-3.0-or-later
"""Export materials as a diffuse albedo and other lobes."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import bpy
import numpy as np
from numpy.typing import NDArray

from ...photon.scene import Material
from .nodes import Colour, Graph, colour_text
from .report import Notes
from .shaders import BLACK, CLEAR, Bsdf, SpecularModel, principled, read_shader, triple
from .tangents import Tangent

NO_SURFACE = -1
# Cycles' default surface before Blender 5.0, for slots without a material.
DEFAULT_GREY = (0.8, 0.8, 0.8)
# Albedos of colours stored in float32 may pass 1 by this much without being worth a warning.
ROUNDING = 1e-5


@dataclass
class MaterialTable:
    """The materials met so far, each converted once."""

    notes: Notes
    model: SpecularModel = SpecularModel.GGX
    override: bpy.types.Material | None = None  # the view layer's
    materials: list[Material] = field(default_factory=list)
    tangents: list[Tangent | None] = field(default_factory=list)  # None: they need none
    _numbers: dict[str | None, int] = field(default_factory=dict)
    _averages: dict[str, Colour | None] = field(default_factory=dict)

    def index_of(self, material: bpy.types.Material | None, object_name: str) -> int:
        """Return the number of a Blender material, NO_SURFACE if it has none."""
        material = self.override or material
        if material is None:
            self.notes.exact(f"Object '{object_name}'", "No material", "Cycles' default surface")
        key = material.name_full if material else None
        if key not in self._numbers:
            exported = self._export(material)
            self._numbers[key] = NO_SURFACE if exported is None else len(self.materials)
            if exported is not None:
                self.materials.append(exported[0])
                self.tangents.append(exported[1] if exported[0].is_anisotropic else None)
        return self._numbers[key]

    def black(self) -> int:
        """Return the number of a material that reflects nothing."""
        black = Material("", (0.0, 0.0, 0.0))
        if black not in self.materials:
            self.materials.append(black)
            self.tangents.append(None)
        return self.materials.index(black)

    def _export(
        self, material: bpy.types.Material | None
    ) -> tuple[Material, Tangent | None] | None:
        if material is None:
            if self.model is SpecularModel.PHONG or bpy.app.version < (5, 0, 0):
                return Material("", DEFAULT_GREY), None
            return bounded(principled.default(), "", "No material", self.notes), None
        owner = f"Material '{material.name}'"
        lobes = self._lobes(material, owner)
        if lobes is CLEAR:
            self.notes.ignored(owner, "No surface", "objects or faces that wear it are left out")
            return None
        exported = bounded(lobes, material.name, owner, self.notes)
        if not self.notes.mention(owner):
            self.notes.exact(owner, "Shader")
        return exported, lobes.tangent

    def _lobes(self, material: bpy.types.Material, owner: str) -> Bsdf | None:
        if not has_nodes(material):
            self.notes.exact(owner, "Viewport colour", "it has no nodes")
            return Bsdf(np.array(material.diffuse_color[:3], np.float64))
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
        return read_shader(graph, node, scope, self.model)


def has_nodes(owner: bpy.types.Material | bpy.types.World) -> bool:
    """Whether the nodes of a material or world are in use; from Blender 5.0 they always are."""
    if owner.node_tree is None:
        return False
    return bpy.app.version >= (5, 0, 0) or owner.use_nodes


def bounded(bsdf: Bsdf, name: str, owner: str, notes: Notes) -> Material:
    """Return the material, with reflectances within [0, 1] that add up to 1 at most in each
    channel; note what had to give."""
    diffuse = _clamped(bsdf.diffuse, "Diffuse colour", owner, notes)
    lobes = tuple(
        replace(
            lobe,
            colour=triple(_clamped(np.array(lobe.colour), "Specular colour", owner, notes)),
            covered=triple(_clamped(np.array(lobe.covered), "Diffuse colour", owner, notes)),
        )
        for lobe in bsdf.lobes
    )
    held_out = bsdf.holdout >= 1.0 - ROUNDING
    if bsdf.holdout > 0.0 and not held_out:
        what = f"{bsdf.holdout:.3g} of it is rendered black and opaque"
        notes.approximated(owner, "Partly holdout", what)
    own = tuple(lobe for lobe in lobes if lobe.reflects)
    glow = np.nan_to_num(bsdf.emission, nan=0.0, posinf=0.0)
    material = Material(name, triple(diffuse), own, triple(glow), held_out)
    total = material.head_on()
    if total.max() > 1.0 + ROUNDING:
        text = _text(total)
        what = f"diffuse + specular = {text} is scaled down to 1"
        notes.approximated(owner, "Albedo above 1", what)
    return material.conserving()


def _clamped(
    colour: NDArray[np.float64], feature: str, owner: str, notes: Notes
) -> NDArray[np.float64]:
    valid = np.where(np.isnan(colour), 0.0, colour).clip(0.0, 1.0)
    if not np.allclose(valid, colour, rtol=0.0, atol=ROUNDING):
        notes.approximated(owner, feature, f"{_text(colour)} is clamped to {_text(valid)}")
    return valid


def _text(values: NDArray[np.float64]) -> str:
    return colour_text(triple(values))
