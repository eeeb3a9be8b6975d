# SPDX-License-Identifier: GPL-3.0-or-later
"""Shading normals that nodes give: a material has one."""

from __future__ import annotations

from dataclasses import replace

import bpy
import numpy as np

from ....photon.scene import TRANSPARENT
from ..graph import Graph
from ..links import Scope, linked
from ..nodes.attributes import smooth
from ..programs import Value
from .bsdf import Bsdf, ShaderLobe


def with_normal(graph: Graph, node: bpy.types.Node, scope: Scope, bsdf: Bsdf) -> Bsdf:
    """What a shader reflects, about the normal that its node's Normal is linked to."""
    if bsdf.normal is not None or not linked(node, "Normal", scope) or not _reflects(bsdf):
        return bsdf
    normal = graph.input(node, "Normal", scope)
    if normal == smooth(graph) or normal.is_just(0.0):  # as groups have it that are given none
        return bsdf
    if normal.is_constant:
        parts = {name: normal.part(name) for name in "xyz"}
        normal = graph.program.emit("combine", **parts, w=Value.of(0.0))
    return replace(bsdf, normal=normal)


def about_one_normal(graph: Graph, first: Bsdf, second: Bsdf) -> tuple[Bsdf, Bsdf]:
    """Two shaders of one material, about the normal of the one that reflects more."""
    same = first.normal == second.normal or not _reflects(first) or not _reflects(second)
    if same:
        normal = first.normal if _reflects(first) else second.normal
    else:
        normal = (first if _weight(first) >= _weight(second) else second).normal
        what = "a material has one: that of the shader that reflects more"
        graph.notes.approximated(graph.owner, "Different normals", what)
    return replace(first, normal=normal), replace(second, normal=normal)


def _reflects(bsdf: Bsdf) -> bool:
    return bool(_turned(bsdf)) or bsdf.diffuse.may_exceed(0.0)


def _turned(bsdf: Bsdf) -> list[ShaderLobe]:
    """Those of its lobes to which it matters how the normal is turned."""
    return [lobe for lobe in bsdf.lobes if lobe.kind != TRANSPARENT]


def _weight(bsdf: Bsdf) -> float:
    """About how much it reflects; half of what it may, where it varies."""
    turned = _turned(bsdf)
    lobes = [(x.weight, x.colour) for x in turned] + [(x.weight, x.covered) for x in turned]
    return _mean(bsdf.diffuse) + sum(_mean(weight) * _mean(colour) for weight, colour in lobes)


def _mean(value: Value) -> float:
    return 0.5 if value.constant is None else float(np.mean(value.colour))
