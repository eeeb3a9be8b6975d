# SPDX-License-Identifier: GPL-3.0-or-later
"""What a shader reflects, and what its readers share."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import Enum

import bpy

from ....photon.scene import NO_MEDIUM, Displacement, Medium
from ..graph import Graph
from ..links import Scope
from ..programs import ONE, ZERO, Value, math
from ..tangents import Tangent

# A Phong lobe narrower than this is beyond float32 cosines on the GPU; roughness 0.038.
SHARPEST_EXPONENT = 1e6
# alpha_x alpha_y up to which Cycles' microfacets are a perfect mirror; roughness 0.0038.
SMOOTH = 2e-10
# An index this close to 1 reflects nothing.
NO_INTERFACE = 1e-4
# Fac sockets that Blender draws with a slider from 0 to 1 can still be fed anything.
UNIT = (0.0, 1.0)


class SpecularModel(Enum):
    """What stands for Cycles' glossy closures: themselves, or the lobes of the paper."""

    GGX = "GGX"
    PHONG = "PHONG"


@dataclass(frozen=True)
class ShaderLobe:
    """A lobe as the scene's Lobe, of values."""

    kind: str
    colour: Value
    parameters: Mapping[str, Value]
    weight: Value = ONE
    covered: Value = ZERO
    over: int | None = None

    @property
    def is_anisotropic(self) -> bool:
        return self.parameters.get("alpha_x") != self.parameters.get("alpha_y")


@dataclass(frozen=True)
class Bsdf:
    """The albedo of a diffuse lobe that nothing covers, other lobes, and what it emits."""

    diffuse: Value = ZERO
    lobes: tuple[ShaderLobe, ...] = ()
    tangent: Tangent | None = None  # of those that are anisotropic
    holdout: Value = ZERO  # the share through which the eye sees nothing
    emission: Value = ZERO  # radiance [W/(m^2 sr)]
    # In world space: the shading normal, if nodes give one, and that of the smooth surface about
    # it, if it is not the mesh's.
    normal: Value | None = None
    base: Value | None = None
    medium: Medium = NO_MEDIUM  # inside the mesh
    shades_lamps: bool = False  # what is transparent of it stops light straight from lamps
    adds: bool = False  # some of its lobes take all that others do, too
    displacement: Displacement | None = None

    @property
    def reflects(self) -> bool:
        return bool(self.lobes) or self.diffuse.may_exceed(0.0)

    def scaled(self, factor: Value) -> Bsdf:
        """As much of it as a Mix Shader takes. What nodes make brighter than 1 is clamped after
        that, and may leave others too little."""
        colours = [self.diffuse, *(x.covered for x in self.lobes)]
        colours += [x.colour for x in self.lobes if x.kind in _PLAIN]
        return replace(
            self,
            adds=self.adds or not all(x.is_constant or x.is_unit for x in colours),
            diffuse=self.diffuse * factor,
            lobes=tuple(_scaled(lobe, factor) for lobe in self.lobes),
            holdout=self.holdout * factor,
            emission=self.emission * factor,
        )

    def plus(self, other: Bsdf) -> Bsdf:
        """Both; lobes of one shape become one."""
        lobes = list(self.lobes)
        # What lies over others, or under them, stays apart.
        apart = {lobe.over for lobe in (*self.lobes, *other.lobes)}
        places: list[int] = []  # where the other's lobes are
        for number, lobe in enumerate(other.lobes):
            lobe = lobe if lobe.over is None else replace(lobe, over=places[lobe.over])
            alone = number not in apart and lobe.over is None
            at = next((i for i, own in enumerate(self.lobes) if _joins(own, lobe)), None)
            if at is None or at in apart or not alone:
                places.append(len(lobes))
                lobes.append(lobe)
            else:
                places.append(at)
                lobes[at] = _joined(lobes[at], lobe)
        return Bsdf(
            self.diffuse + other.diffuse,
            tuple(lobes),
            self.tangent or other.tangent,
            self.holdout + other.holdout,
            self.emission + other.emission,
            self.normal or other.normal,
            self.base or other.base,
            adds=self.adds or other.adds,
        )

    def beneath(self, layer: ShaderLobe) -> Bsdf:
        """It all, but for what it emits, and a lobe over it."""
        below = (replace(x, over=0 if x.over is None else x.over + 1) for x in self.lobes)
        over = replace(layer, covered=self.diffuse)
        return replace(self, diffuse=ZERO, lobes=(over, *below))


BLACK = Bsdf()
# A shader that lets all light pass straight through: there is no surface.
CLEAR = None


def transparent(passed: Value) -> Bsdf | None:
    """What lets a part of light pass straight through, the rest of it absorbed."""
    if passed.is_just(1.0):
        return CLEAR
    return Bsdf(lobes=(ShaderLobe("transparent", clipped(passed), {}),))


def surface_of(bsdf: Bsdf | None) -> Bsdf:
    """A shader's lobes, and what is CLEAR as one that lets light pass."""
    return Bsdf(lobes=(ShaderLobe("transparent", ONE, {}),)) if bsdf is CLEAR else bsdf


# Kinds whose colour times weight is all that there is to them.
_PLAIN = ("mirror", "phong", "transparent")


def _scaled(lobe: ShaderLobe, factor: Value) -> ShaderLobe:
    if lobe.kind in _PLAIN:
        return replace(lobe, colour=lobe.colour * factor)
    return replace(lobe, weight=lobe.weight * factor, covered=lobe.covered * factor)


def _joins(one: ShaderLobe, other: ShaderLobe) -> bool:
    same = (one.kind, one.parameters, one.over) == (other.kind, other.parameters, other.over)
    return same and (one.kind in _PLAIN or one.colour == other.colour)


def _joined(one: ShaderLobe, other: ShaderLobe) -> ShaderLobe:
    if one.kind in _PLAIN:
        return replace(one, colour=one.colour + other.colour)
    covered = one.covered + other.covered
    return replace(one, weight=one.weight + other.weight, covered=covered)


def note_anisotropy(graph: Graph, node: bpy.types.Node, scope: Scope) -> None:
    """Say that reflections are not stretched."""
    for name in ("Anisotropy", "Anisotropic"):
        if not graph.input(node, name, scope, 0.0).is_just(0.0):
            graph.notes.approximated(graph.owner, name, "its reflections are round")


def note_thin_film(graph: Graph, node: bpy.types.Node, scope: Scope) -> None:
    """Say that there is none."""
    if graph.input(node, "Thin Film Thickness", scope, 0.0).may_exceed(0.0):
        graph.notes.ignored(graph.owner, "Thin Film", "left out")


def as_diffuse(graph: Graph, node: bpy.types.Node, scope: Scope) -> Bsdf:
    """Scattering of other kinds, as a diffuse surface of the same colour."""
    graph.notes.approximated(graph.owner, f"{node.bl_label}", "rendered as diffuse")
    return Bsdf(graph.input(node, "Color", scope))


def roughness_of(graph: Graph, node: bpy.types.Node, scope: Scope) -> Value:
    """A node's roughness, in [0, 1], as Cycles has it: Refraction squares it before it clamps."""
    roughness = graph.input(node, "Roughness", scope)
    return (math("ABSOLUTE", roughness) if node.type == "BSDF_REFRACTION" else roughness).clamp()


def phong_of(graph: Graph, node: bpy.types.Node, k_s: Value, scope: Scope) -> ShaderLobe:
    """The paper's lobe of a node's roughness: exponent n = 2 / alpha^2 - 2, alpha = roughness^2."""
    roughness = roughness_of(graph, node, scope)
    mirror = ShaderLobe("mirror", k_s, {})
    if roughness.is_just(0.0):
        return mirror
    steep = math("POWER", math("MAXIMUM", roughness, 1e-6), 4.0)
    exponent = math("MAXIMUM", 2.0 / steep - 2.0, 0.0)
    if not roughness.is_constant:
        stands = "Phong lobes stand for Cycles' microfacets"
        graph.notes.approximated(graph.owner, "Roughness", stands)
        return ShaderLobe("phong", k_s, {"exponent": exponent.clamp(0.0, SHARPEST_EXPONENT)})
    what = f"Roughness {roughness.number:.4g}"
    if exponent.number > SHARPEST_EXPONENT:
        graph.notes.approximated(graph.owner, what, "rendered as a mirror")
        return mirror
    stands = f"a Phong lobe of exponent {exponent.number:.4g} stands for Cycles' microfacets"
    graph.notes.approximated(graph.owner, what, stands)
    return ShaderLobe("phong", k_s, {"exponent": exponent})


def is_smooth(parameters: Mapping[str, Value]) -> bool:
    """Whether these are a perfect mirror's."""
    return not (parameters["alpha_x"] * parameters["alpha_y"]).may_exceed(SMOOTH)


def head_on(ior: Value) -> Value:
    """A dielectric's reflectance at normal incidence (Fresnel)."""
    root = (ior - 1.0) / (ior + 1.0)
    return root * root


def clipped(colour: Value) -> Value:
    """Colours as Cycles clamps reflectances."""
    return colour.clamp(*UNIT)
