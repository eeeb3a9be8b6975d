# SPDX-License-Identifier: GPL-3.0-or-later
"""Principled BSDF's Thin Wall, from Blender 5.2 on: a sheet without an inside, as OpenPBR has."""

from __future__ import annotations

import bpy

from ..graph import Graph
from ..links import Scope
from ..nodes.attributes import here
from ..nodes.views import reflected
from ..programs import ONE, ZERO, Value, math, mix
from .bsdf import (
    SMOOTH,
    Bsdf,
    ShaderLobe,
    SpecularModel,
    clipped,
    roughness_of,
    surface_of,
    transparent,
)
from .diffuse import SMOOTH as EVEN
from .diffuse import rough_diffuse, translucent
from .microfacets import LEAST as FINEST

LEAST = 1e-6  # of a divisor


def is_thin(graph: Graph, node: bpy.types.Node, scope: Scope) -> bool:
    """Whether all of a Principled BSDF is a sheet; where nodes say so of a part it is a solid, and
    that is noted."""
    given = graph.input(node, "Thin Wall", scope, 0.0)
    if given.is_constant:
        return given.number > 0.0
    graph.notes.approximated(graph.owner, "Thin Wall by nodes", "a solid everywhere")
    return False


def glass(graph: Graph, node: bpy.types.Node, scope: Scope, base: Value, tint: Value) -> Bsdf:
    """What a sheet of glass reflects and lets through, back and forth between its sides (OpenPBR,
    "Thin-walled case"); `base`: what goes straight through it keeps."""
    ior = math("MAXIMUM", graph.input(node, "IOR", scope), 1e-5)
    # On the back the instruction turns the index round; a sheet has none.
    fresnel = reflected(graph, node, scope, mix(ior, 1.0 / ior, here(graph, "backfacing")))
    at_once, cosine = fresnel.part("x"), fresnel.part("w")
    inside = 1.0 - (1.0 - cosine * cosine) / (ior * ior)
    kept = math("POWER", clipped(base), 1.0 / math("SQRT", math("MAXIMUM", inside, LEAST)))
    in_turn = at_once * kept
    all_turns = math("MAXIMUM", 1.0 - in_turn * in_turn, LEAST)
    passed = kept * (1.0 - at_once) * (1.0 - at_once) / all_turns
    mirrored = (at_once + passed * in_turn) * clipped(tint)
    alpha = roughness_of(graph, node, scope)
    alpha = alpha * alpha
    if not (alpha * alpha).may_exceed(SMOOTH):
        return Bsdf(lobes=(ShaderLobe("mirror", mirrored, {}),)).plus(
            surface_of(transparent(passed))
        )
    ways = {"alpha_x": alpha, "alpha_y": alpha, "turn": ZERO, "compensated": ONE}
    # By two refractions (Kulla & Conty 2017, "Revisiting Physically Based Shading at Imageworks").
    wider = 3.4 * (ior - 1.0) * (ior - 0.5) * (ior - 0.5) / (ior * ior * ior)
    through = (alpha * math("SQRT", math("MAXIMUM", wider, 0.0))).clamp(FINEST, 1.0)
    sheet = ShaderLobe("ggx_sheet", passed, {"alpha": through})
    return Bsdf(lobes=(ShaderLobe("ggx", mirrored, ways), sheet))


def below(graph: Graph, node: bpy.types.Node, scope: Scope, base: Value, roughness: Value) -> Bsdf:
    """What a sheet scatters back and through, by its anisotropy."""
    if roughness.may_exceed(EVEN):
        graph.notes.approximated(graph.owner, "Thin Wall", "what comes through it is Lambertian")
    onward = ((graph.input(node, "Subsurface Anisotropy", scope) + 1.0) * 0.5).clamp()
    back = rough_diffuse(graph, base, roughness, SpecularModel.GGX)
    return back.scaled(ONE - onward).plus(translucent(base).scaled(onward))
