# SPDX-License-Identifier: GPL-3.0-or-later
"""Export materials as a diffuse albedo and other lobes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import bpy
import numpy as np
from numpy.typing import NDArray

from ...photon.scene import RGB, ROUNDING, Instruction, Lobe, Material, Result, reflecting, triple
from ...photon.stage.kinds import lobe_kinds
from ...photon.stage.programs import MOST_REGISTERS, width_of
from ...photon.stage.spectrum import BANDS
from .displacement import bump_of, displacement_of
from .graph import Context, colour_text, many_calls
from .links import is_given
from .nodes import graph_of
from .nodes.views import PATHS
from .programs import Program, Value
from .report import Notes
from .shaders import (
    BLACK,
    CLEAR,
    Bsdf,
    ShaderLobe,
    SpecularModel,
    principled,
    read_shader,
)
from .shaders.bsdf import surface_of
from .shaders.glass import dispersing
from .shaders.volume import medium_of
from .tangents import Tangent
from .textures import TextureTable
from .unsupported import note_material

NO_SURFACE = -1
# Cycles' default surface before Blender 5.0, for slots without a material.
DEFAULT_GREY = (0.8, 0.8, 0.8)
DISPERSION_OF_ABBE = 20.0  # its Dispersion is so much over the Abbe number, as in glTF
COLOURS = {"albedo", "tint"}  # parameters of lobes that are
# Kinds of instructions that give the same everywhere on an object, of what is the same.
UNIFORM = {
    *("arithmetic", "functions", "combine", "vector", "rotate", "matrix", "ramp", "curves"),
    *("blend", "blend_hue", "hsv", "hue_saturation", "blackbody", "wavelength"),
    *("object", "light_path"),
}
# What light_path is asked: whether the ray is the eye's own, and how long it is.
CAMERA_ALONE, LENGTH = PATHS["Is Camera Ray"], PATHS["Ray Length"]


@dataclass(frozen=True)
class _Exported:
    """A material as it is on bodies."""

    material: Material
    tangent: Tangent | None
    context: Context


@dataclass
class MaterialTable:
    """The materials met so far, each converted once."""

    notes: Notes
    model: SpecularModel = SpecularModel.GGX
    override: bpy.types.Material | None = None  # the view layer's
    context: Context = field(default_factory=Context)  # of all, before one asks for attributes
    textures: TextureTable | None = None  # None: of images the mean is used
    materials: list[Material] = field(default_factory=list)
    tangents: list[Tangent | None] = field(default_factory=list)  # None: they need none
    contexts: list[Context] = field(default_factory=list)  # of each of the materials
    _exported: dict[str | None, _Exported | None] = field(default_factory=dict)
    _numbers: dict[tuple[str | None, bool], int] = field(default_factory=dict)
    _still: dict[int, int] = field(default_factory=dict)
    _averages: dict[str, RGB | None] = field(default_factory=dict)

    def index_of(
        self,
        material: bpy.types.Material | None,
        object_name: str,
        has_open_mesh: Callable[[], bool],
    ) -> int:
        """Return the number of a Blender material, NO_SURFACE if it has none. Of glass it matters
        whether the object is a sheet."""
        material = self.override or material
        if material is None:
            self.notes.exact(f"Object '{object_name}'", "No material", "Cycles' default surface")
        key, exported = self._found(material)
        if exported is None:
            return NO_SURFACE
        made = exported.material
        is_open = is_glass(made) and lets_through(made)
        if is_glass(made) and not is_open and has_open_mesh():
            self.notes.exact(f"Object '{object_name}'", "Glass", "an open mesh: as in Cycles")
            is_open = True
        if (key, is_open) not in self._numbers:
            self._numbers[key, is_open] = len(self.materials)
            self.materials.append(opened(made) if is_open else made)
            self.contexts.append(exported.context)
            self.tangents.append(exported.tangent if made.is_anisotropic else None)
        return self._numbers[key, is_open]

    def is_gap(self, material: bpy.types.Material | None) -> bool:
        """Whether light goes through faces that wear it as through none, or by other ways than
        glass."""
        _, exported = self._found(self.override or material)
        return exported is None or lets_through(exported.material)

    def _found(self, material: bpy.types.Material | None) -> tuple[str | None, _Exported | None]:
        """Its key, and what it becomes; None: no surface."""
        key = material.name_full if material else None
        if key not in self._exported:
            index = material.pass_index if material else 0
            context = replace(self.context, attributes=[], index=index)
            with many_calls():
                found = self._export(material, context)
            self._exported[key] = None if found is None else _Exported(*found, context)
        return key, self._exported[key]

    def still(self, number: int) -> int:
        """Return the number of the same material that moves no surface, as on hair."""
        if number == NO_SURFACE or not self.materials[number].displacement:
            return number
        if number not in self._still:
            self._still[number] = len(self.materials)
            self.materials.append(replace(self.materials[number], displacement=None))
            self.contexts.append(self.contexts[number])
            self.tangents.append(self.tangents[number])
        return self._still[number]

    def is_local(self, number: int) -> bool:
        """Whether Cycles keeps meshes that wear it in the spaces of their objects."""
        if number == NO_SURFACE:
            return False
        material = self.materials[number]
        return material.displacement is not None or material.scatters_below

    def black(self) -> int:
        """Return the number of a material that reflects nothing."""
        black = Material("", (0.0, 0.0, 0.0))
        if black not in self.materials:
            self.materials.append(black)
            self.contexts.append(Context())
            self.tangents.append(None)
        return self.materials.index(black)

    def _export(
        self, material: bpy.types.Material | None, context: Context
    ) -> tuple[Material, Tangent | None] | None:
        if material is None:
            if self.model is SpecularModel.PHONG or bpy.app.version < (5, 0, 0):
                return Material("", DEFAULT_GREY), None
            return bounded(principled.default(), Program(), "", "No material", self.notes), None
        owner, program = f"Material '{material.name}'", Program()
        lobes = self._lobes(material, owner, program, context)
        if lobes is CLEAR:
            self.notes.ignored(owner, "No surface", "objects or faces that wear it are left out")
            return None
        exported = bounded(lobes, program, material.name, owner, self.notes)
        if (width := width_of(exported)) > MOST_REGISTERS:
            what = f"they hold {width} values at a time, {MOST_REGISTERS} are possible: left out"
            self.notes.approximated(owner, "Nodes", what)
            lobes = replace(principled.default(), tangent=None, displacement=lobes.displacement)
            exported = bounded(lobes, Program(), material.name, owner, self.notes)
        if exported.filters_no_lamps:
            what = "off: it stops light straight from lamps, and lets the world's through"
            self.notes.approximated(owner, "Transparent Shadows", what)
        if not self.notes.mentions(owner):
            self.notes.exact(owner, "Shader")
        return exported, lobes.tangent

    def _lobes(
        self, material: bpy.types.Material, owner: str, program: Program, context: Context
    ) -> Bsdf | None:
        note_material(material, owner, self.notes)
        if not has_nodes(material):
            self.notes.exact(owner, "Viewport colour", "it has no nodes")
            return Bsdf(Value.of(material.diffuse_color[:3]))
        graph = graph_of(material, owner, self.notes, self._averages, context)
        graph.program, graph.textures = program, self.textures
        output = graph.output("OUTPUT_MATERIAL")
        if output is None:
            self.notes.exact(owner, "No Material Output", "black, as in Cycles")
            return BLACK
        graph.displaced = bump_of(graph, output, material)
        node, end, scope = graph.surface("OUTPUT_MATERIAL")
        holds_volume = is_given(output.inputs["Volume"], ())
        if node is None and not holds_volume:
            self.notes.approximated(owner, "Surface", "no shader is linked to it: rendered black")
        lobes = read_shader(graph, node, end, scope, self.model)
        if node is None and holds_volume:
            lobes = CLEAR
        stops, medium = shades_lamps(material, output), medium_of(graph, output, "mesh")
        if lobes is CLEAR and (stops or medium.is_there):
            lobes = surface_of(CLEAR)
        if lobes is CLEAR:
            return CLEAR
        lobes = self._dispersed(lobes, material, owner)
        moves = displacement_of(graph, output, material)
        lobes = replace(lobes, base=graph.displaced, medium=medium, shades_lamps=stops)
        return replace(lobes, displacement=moves)

    def _dispersed(self, bsdf: Bsdf, material: bpy.types.Material, owner: str) -> Bsdf:
        """What a material's own Dispersion makes of its glass."""
        dispersion = dispersion_of(material)
        if not dispersion > 0.0:
            return bsdf
        found = dispersing(bsdf, dispersion)
        if found == bsdf:
            self.notes.ignored(owner, "Dispersion", "nothing of it refracts")
        else:
            what = f"Abbe number {1.0 / dispersion:.4g}, {BANDS} bands of wavelengths"
            self.notes.exact(owner, "Dispersion", what)
        return found


def has_nodes(owner: bpy.types.Material | bpy.types.World) -> bool:
    """Whether the nodes of a material or world are in use; from Blender 5.0 they always are."""
    if owner.node_tree is None:
        return False
    return bpy.app.version >= (5, 0, 0) or owner.use_nodes


def shades_lamps(material: bpy.types.Material, output: bpy.types.Node) -> bool:
    """Whether its Transparent Shadows are off; Cycles has them on where a volume is linked."""
    off = not getattr(material, "use_transparent_shadow", True)
    return off and not is_given(output.inputs["Volume"], ())


def dispersion_of(material: bpy.types.Material) -> float:
    """1 / Abbe number; 0 if it disperses nothing, or the add-on is not registered."""
    settings = getattr(material, "photon_stream", None)
    return settings.dispersion / DISPERSION_OF_ABBE if settings else 0.0


def is_glass(material: Material) -> bool:
    """Whether it refracts."""
    return any("open" in lobe.parameters for lobe in material.lobes)


def lets_through(material: Material) -> bool:
    """Whether light goes through it otherwise than by glass."""
    return material.is_transparent or any(
        lobe_kinds()[lobe.kind].transmits and "open" not in lobe.parameters
        for lobe in material.lobes
    )


def opened(material: Material) -> Material:
    """The same glass of a sheet."""
    lobes = (
        replace(lobe, parameters={**lobe.parameters, "open": 1.0})
        if "open" in lobe.parameters
        else lobe
        for lobe in material.lobes
    )
    return replace(material, lobes=tuple(lobes))


def bounded(bsdf: Bsdf, program: Program, name: str, owner: str, notes: Notes) -> Material:
    """Return the material, with the constant reflectance of each lobe within [0, 1]; note what had
    to give. What varies the renderer bounds where it is used."""
    found = _Fields(owner, notes)
    diffuse = found.colour(bsdf.diffuse, "Diffuse colour", "diffuse")
    lobes = reflecting(tuple(_lobe(lobe, owner, notes) for lobe in bsdf.lobes))
    for whose, normal in (("base", bsdf.base), ("normal", bsdf.normal)):
        if normal is not None:
            found.number(normal, whose, 0.0)
    emission = (0.0, 0.0, 0.0)
    if bsdf.emission.is_constant:
        emission = triple(np.nan_to_num(bsdf.emission.colour, nan=0.0, posinf=0.0))
    else:
        found.number(bsdf.emission, "emission", 0.0)
        _note_emission(bsdf.emission, program, owner, notes)
    instructions, numbers = program.pruned(
        result
        for varying in (found.varying, *(x.varying for x in lobes))
        for result in varying.values()
    )
    if bsdf.emission.may_exceed(0.0) and any("open" in lobe.parameters for lobe in lobes):
        what = "its inner side is dimmer than in Cycles, by the squared index"
        notes.approximated(owner, "Emission of glass", what)
    material = Material(
        name,
        diffuse,
        tuple(replace(lobe, varying=_moved(lobe.varying, numbers)) for lobe in lobes),
        emission,
        _is_held_out(bsdf.holdout, owner, notes),
        instructions,
        _moved(found.varying, numbers),
        bsdf.medium,
        bsdf.shades_lamps,
        not bsdf.adds,
        bsdf.displacement,
    )
    if material.is_too_bright:
        what = f"{_text(material.head_on())} of what it receives: no photon gains by it"
        notes.approximated(owner, "Albedo above 1", what)
    return material


def _note_emission(emission: Value, program: Program, owner: str, notes: Notes) -> None:
    """Write down how an emission that differs from place to place lights."""
    instructions, _ = program.pruned([emission.result] if emission.result else [])
    if any(instruction.kind not in UNIFORM for instruction in instructions):
        what = "seen as it is; as a light by cells of each triangle, and all of these by the angle"
        notes.approximated(owner, "Emission by nodes", what)
    asked = {_which(one) for one in instructions if one.kind == "light_path"} - {CAMERA_ALONE}
    if LENGTH in asked:
        notes.approximated(owner, "Emission by distance", "as a light it is as from 1 m away")
    elif asked:
        what = "as a light it is taken to be found by diffuse rays"
        notes.approximated(owner, "Emission by Light Path", what)


def _which(instruction: Instruction) -> float | None:
    """The first number of its first operand, if that is constant."""
    first = instruction.operands[0]
    return float(first[0]) if isinstance(first, tuple) else None


@dataclass
class _Fields:
    """Values as a scene's record has them: constants, and results by name."""

    owner: str
    notes: Notes
    varying: dict[str, Result] = field(default_factory=dict)

    def colour(self, value: Value, feature: str, name: str) -> RGB:
        """A reflectance; of one that varies the most that it may be."""
        if value.result is not None:
            self.varying[name] = value.result
            return (1.0, 1.0, 1.0)
        return triple(_clamped(value.colour, feature, self.owner, self.notes))

    def number(self, value: Value, name: str, otherwise: float) -> float:
        """A number, `otherwise` if it varies."""
        if value.result is not None:
            self.varying[name] = value.result
            return otherwise
        return value.number


def _lobe(lobe: ShaderLobe, owner: str, notes: Notes) -> Lobe:
    found = _Fields(owner, notes)
    colour = found.colour(lobe.colour, "Specular colour", "colour")
    covered = found.colour(lobe.covered, "Diffuse colour", "covered")
    weight = found.number(lobe.weight, "weight", 1.0)
    parameters: dict[str, float | RGB] = {
        name: found.colour(value, name.capitalize(), name)
        if name in COLOURS
        else found.number(value, name, 1.0)
        for name, value in lobe.parameters.items()
    }
    return Lobe(lobe.kind, colour, parameters, weight, covered, found.varying, lobe.over)


def _moved(varying: Mapping[str, Result], numbers: Mapping[int, int]) -> dict[str, Result]:
    return {
        name: replace(result, instruction=numbers[result.instruction])
        for name, result in varying.items()
    }


def _is_held_out(share: Value, owner: str, notes: Notes) -> bool:
    if share.is_constant and (share.number >= 1.0 - ROUNDING or share.number <= 0.0):
        return share.number > 0.0
    part = f"{share.number:.3g} of it" if share.is_constant else "it"
    notes.approximated(owner, "Partly holdout", f"{part} is rendered black and opaque")
    return False


def _clamped(
    colour: NDArray[np.float64], feature: str, owner: str, notes: Notes
) -> NDArray[np.float64]:
    valid = np.where(np.isnan(colour), 0.0, colour).clip(0.0, 1.0)
    if not np.allclose(valid, colour, rtol=0.0, atol=ROUNDING):
        notes.approximated(owner, feature, f"{_text(colour)} is clamped to {_text(valid)}")
    return valid


def _text(values: NDArray[np.float64]) -> str:
    return colour_text(triple(values))
