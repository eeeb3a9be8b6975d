# SPDX-License-Identifier: GPL-3.0-or-later
"""Principled BSDF's Thin Wall, from Blender 5.2 on: a sheet without an inside, as OpenPBR has."""

from __future__ import annotations

from functools import partial

import bpy

from ..graph import Graph
from ..links import Scope
from ..nodes.attributes import here
from ..nodes.views import reflected
from ..programs import ONE, Value, math, mix
from . import bsdf, diffuse, microfacets
from .bsdf import (
    Bsdf,
    ShaderLobe,
    SpecularModel,
    clipped,
    head_on,
    roughness_of,
    surface_of,
    transparent,
)

LEAST = 1e-6  # of a divisor


def is_thin(graph: Graph, node: bpy.types.Node, scope: Scope) -> bool:
    """Whether all of a Principled BSDF is a sheet; where nodes say so of a part it is a solid, and
    that is noted."""
    given = graph.input(node, "Thin Wall", scope, 0.0)
    if given.is_constant:
        return given.number >= 1.0
    graph.notes.approximated(graph.owner, "Thin Wall by nodes", "a solid everywhere")
    return False


def glass(graph: Graph, node: bpy.types.Node, scope: Scope, base: Value) -> Bsdf:
    """What a sheet of glass reflects and lets through, back and forth between its sides (OpenPBR,
    "Thin-walled case"); `base`: what is left of light that goes straight through it."""
    given = partial(graph.input, node, scope=scope)
    ior = math("MAXIMUM", given("IOR"), 1e-5)
    mirrored, passed = _shares(graph, node, scope, ior, base)
    _note_layers(graph, node, scope)
    alpha = roughness_of(graph, node, scope)
    alpha = alpha * alpha
    if not (alpha * alpha).may_exceed(bsdf.SMOOTH):
        return Bsdf(lobes=(ShaderLobe("mirror", mirrored, {}),)).plus(_clear(passed))
    # By two refractions (Kulla & Conty 2017, "Revisiting Physically Based Shading at Imageworks").
    wider = 3.4 * (ior - 1.0) * (ior - 0.5) * (ior - 0.5) / (ior * ior * ior)
    through = alpha * math("SQRT", math("MAXIMUM", wider, 0.0))
    found = _rough(mirrored, alpha, 0.0)
    is_smooth = not (through * through).may_exceed(bsdf.SMOOTH)
    return found.plus(_clear(passed) if is_smooth else _rough(passed, through, 1.0))


def _clear(passed: Value) -> Bsdf:
    return surface_of(transparent(passed))


def _rough(colour: Value, alpha: Value, through: float) -> Bsdf:
    parameters = {"alpha": alpha.clamp(microfacets.LEAST, 1.0), "through": Value.of(through)}
    return Bsdf(lobes=(ShaderLobe("ggx_sheet", colour, parameters),))


def _shares(
    graph: Graph, node: bpy.types.Node, scope: Scope, ior: Value, base: Value
) -> tuple[Value, Value]:
    """What is reflected and what goes through, of all turns together."""
    # On the back the instruction turns the index round; a sheet has none.
    fresnel = reflected(graph, node, scope, mix(ior, 1.0 / ior, here(graph, "backfacing")))
    at_once, cosine = fresnel.part("x"), fresnel.part("w")
    least = head_on(ior)
    tint = math("MAXIMUM", graph.input(node, "Specular Tint", scope), 0.0)
    if not tint.is_just(1.0):
        rest = math("MAXIMUM", 1.0 - least, LEAST)
        at_once = mix(least * tint, ONE, ((at_once - least) / rest).clamp())
    inside = 1.0 - (1.0 - cosine * cosine) / (ior * ior)
    kept = math("POWER", clipped(base), 1.0 / math("SQRT", math("MAXIMUM", inside, LEAST)))
    in_turn = at_once * kept
    passed = kept * (1.0 - at_once) * (1.0 - at_once)
    passed = passed / math("MAXIMUM", 1.0 - in_turn * in_turn, LEAST)
    return at_once + passed * in_turn, passed


def _note_layers(graph: Graph, node: bpy.types.Node, scope: Scope) -> None:
    given = partial(graph.input, node, scope=scope, otherwise=0.0)
    if any(given(f"{name} Weight").may_exceed(0.0) for name in ("Coat", "Sheen")):
        what = "its shadow is as without what lies over it"
        graph.notes.approximated(graph.owner, "Thin Wall", what)


def below(graph: Graph, node: bpy.types.Node, scope: Scope, base: Value, roughness: Value) -> Bsdf:
    """What a sheet scatters back and through, by its anisotropy."""
    if roughness.may_exceed(diffuse.SMOOTH):
        graph.notes.approximated(graph.owner, "Thin Wall", "what comes through it is Lambertian")
    onward = ((graph.input(node, "Subsurface Anisotropy", scope) + 1.0) * 0.5).clamp()
    back = diffuse.rough_diffuse(graph, base, roughness, SpecularModel.GGX)
    return back.scaled(ONE - onward).plus(diffuse.translucent(base).scaled(onward))
