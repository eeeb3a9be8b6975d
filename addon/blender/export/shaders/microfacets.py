# SPDX-License-Identifier: GPL-3.0-or-later
"""Microfacets: how rough they are, how far stretched, and along what."""

from __future__ import annotations

from dataclasses import replace
from math import pi

import bpy

from ..graph import Graph
from ..links import Scope, source
from ..programs import ONE, ZERO, Value, math, mix, value
from ..tangents import Tangent
from .bsdf import Bsdf, roughness_of

ROUND = 1e-4  # the Glossy BSDF's anisotropy up to which it has none
MOST = 0.99  # and what it is clamped to
LEAST = 2e-5  # alpha of what is rough at some points: sharper lobes are mirrors


def microfacets(graph: Graph, node: bpy.types.Node, scope: Scope) -> dict[str, Value]:
    """The parameters that all GGX lobes have, of a node's roughness and distribution."""
    roughness = roughness_of(graph, node, scope)
    alpha = roughness * roughness
    compensated = is_compensated(graph, node)
    alpha_x, alpha_y, turn = anisotropic(graph, node, scope, alpha)
    return {"alpha_x": alpha_x, "alpha_y": alpha_y, "turn": turn, "compensated": compensated}


def is_compensated(graph: Graph, node: bpy.types.Node) -> Value:
    """1 if a node's distribution gives back what is lost between microfacets, else 0."""
    distribution = getattr(node, "distribution", "MULTI_GGX")
    if distribution not in ("GGX", "MULTI_GGX"):
        graph.notes.approximated(graph.owner, f"Distribution {distribution}", "rendered as GGX")
    return value(float(distribution == "MULTI_GGX"))


def anisotropic(
    graph: Graph, node: bpy.types.Node, scope: Scope, alpha: Value
) -> tuple[Value, Value, Value]:
    """A node's alpha along its tangent and across, and what it is turned by [rad]."""
    if node.type == "BSDF_GLOSSY":
        amount = graph.input(node, "Anisotropy", scope).clamp(-MOST, MOST)
        # Its tangent is the smoother way, the others' the rougher.
        is_positive = math("GREATER_THAN", amount, 0.0)
        aspect = mix(1.0 / (1.0 + amount), 1.0 - amount, is_positive)
        turn = "Rotation"
        if amount.is_constant and abs(amount.number) <= ROUND:
            aspect = ONE
    else:
        principled = node.type == "BSDF_PRINCIPLED"
        name = "Anisotropic" if principled else "Anisotropy"
        amount = graph.input(node, name, scope).clamp()
        aspect = math("INVERSE_SQRT", 1.0 - amount * 0.9)
        turn = "Anisotropic Rotation" if principled else "Rotation"
    if aspect.is_just(1.0):
        return _bounded(alpha), _bounded(alpha), ZERO
    angle = graph.input(node, turn, scope) * (2.0 * pi)
    turned = math("FLOORED_MODULO", angle, pi)
    return _bounded(alpha * aspect), _bounded(alpha / aspect), turned


def _bounded(alpha: Value) -> Value:
    return alpha.clamp(0.0 if alpha.is_constant else LEAST, 1.0)


def with_tangent(graph: Graph, node: bpy.types.Node, scope: Scope, bsdf: Bsdf) -> Bsdf:
    """What a node reflects, with its tangent if that matters."""
    if not any(lobe.is_anisotropic for lobe in bsdf.lobes):
        return bsdf
    return replace(bsdf, tangent=tangent_of(graph, node, scope))


def tangent_of(graph: Graph, node: bpy.types.Node, scope: Scope) -> Tangent:
    """What a node's Tangent is linked to; by default it is radial, about the object's Z."""
    socket = node.inputs.get("Tangent")
    if socket is None:
        return Tangent()
    feeding, end, _ = source(socket, scope)
    if feeding is None or (feeding.type == "NEW_GEOMETRY" and end.name == "Tangent"):
        return Tangent()
    if feeding.type == "TANGENT":
        if feeding.direction_type == "RADIAL":
            return Tangent(feeding.axis)
        return Tangent("", feeding.uv_map)
    what = "the default is used, about the object's Z"
    graph.notes.approximated(graph.owner, f"Tangent from '{feeding.name}'", what)
    return Tangent()


def note_tangents(graph: Graph, first: Bsdf, second: Bsdf) -> None:
    """Say that two shaders' tangents become one, which is the first's."""
    if first.tangent and second.tangent and first.tangent != second.tangent:
        what = "a material has one: that of its first anisotropic shader"
        graph.notes.approximated(graph.owner, "Different tangents", what)
