# SPDX-License-Identifier: GPL-3.0-or-later
"""Shader nodes become lobes: a reader a kind, found by the node's Blender type."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import bpy

from ..graph import Graph
from ..links import Scope
from ..programs import ONE
from . import (
    diffuse,
    emission,
    glass,
    glossy,
    hair,
    metallic,
    mix,
    principled,
    sheen,
    subsurface,
    toon,
)
from .bsdf import BLACK, CLEAR, Bsdf, ShaderLobe, SpecularModel, as_diffuse
from .normals import with_normal

__all__ = [
    "BLACK",
    "CLEAR",
    "Bsdf",
    "ShaderLobe",
    "SpecularModel",
    "principled",
    "read_shader",
]

Reader = Callable[[Graph, bpy.types.Node, Scope, SpecularModel], Bsdf | None]


def read_shader(
    graph: Graph,
    node: bpy.types.Node | None,
    output: bpy.types.NodeSocket | None,
    scope: Scope,
    model: SpecularModel,
) -> Bsdf | None:
    """Return the lobes of the shader that ends in an output of `node`; CLEAR if it is no surface at
    all. A colour or a number is emitted."""
    if node is None:
        return BLACK
    reader = READERS.get(node.type)
    if reader is None and node.type in graph.readers:
        return emission.emitted(graph.output_value(node, output, scope))
    if reader is None:
        graph.notes.ignored(graph.owner, f"{node.bl_label} '{node.name}'", "reflects nothing")
        return BLACK
    if (node, scope) in graph.shaders:
        what = "its links go in a circle: black"
        graph.notes.approximated(graph.owner, f"'{node.name}'", what)
        return BLACK
    graph.shaders.append((node, scope))
    found = reader(graph, node, scope, model)
    graph.shaders.pop()
    return found if found is CLEAR else with_normal(graph, node, scope, found)


def _scattering(graph: Graph, node: bpy.types.Node, scope: Scope, model: SpecularModel) -> Bsdf:
    return as_diffuse(graph, node, scope)


def _holdout(graph: Graph, node: bpy.types.Node, scope: Scope, model: SpecularModel) -> Bsdf:
    return Bsdf(holdout=ONE)


READERS: dict[str, Reader] = {
    "ADD_SHADER": partial(mix.read_add, read=read_shader),
    "BACKGROUND": emission.read,
    "BSDF_DIFFUSE": diffuse.read,
    "BSDF_GLASS": glass.read,
    "BSDF_GLOSSY": glossy.read,
    "BSDF_METALLIC": metallic.read,
    "BSDF_HAIR": _scattering,
    "BSDF_HAIR_PRINCIPLED": hair.read,
    "BSDF_PRINCIPLED": principled.read,
    "BSDF_REFRACTION": glass.read_refraction,
    "BSDF_SHEEN": sheen.read,
    "BSDF_TOON": toon.read,
    "BSDF_TRANSLUCENT": diffuse.read_translucent,
    "BSDF_TRANSPARENT": mix.read_transparent,
    "EMISSION": emission.read,
    "HOLDOUT": _holdout,
    "MIX_SHADER": partial(mix.read_mix, read=read_shader),
    "SUBSURFACE_SCATTERING": subsurface.read,
}
