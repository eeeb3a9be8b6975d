# SPDX-License-Identifier: GPL-3.0-or-later
"""What tests of shaders share: nodes, colours, and how an exported lobe is compared."""

from __future__ import annotations

from functools import partial
from typing import Any

import bpy
import pytest

from addon.blender.export import SpecularModel
from addon.photon.scene import MIRROR, RGB, Lobe, Material

from .build import add_node, finish, new_material

GGX, PHONG = SpecularModel
BLACK = (0.0, 0.0, 0.0)
RED = (0.8, 0.2, 0.1, 1.0)
GOLD = (0.9, 0.6, 0.2, 1.0)
DIFFUSE, GLOSSY = "ShaderNodeBsdfDiffuse", "ShaderNodeBsdfGlossy"
PRINCIPLED, GLASS = "ShaderNodeBsdfPrincipled", "ShaderNodeBsdfGlass"
METALLIC, REFRACTION = "ShaderNodeBsdfMetallic", "ShaderNodeBsdfRefraction"
needs_metallic = pytest.mark.skipif(
    bpy.app.version < (4, 3), reason="Metallic BSDF came with Blender 4.3"
)
near = partial(pytest.approx, rel=1e-5, abs=1e-6)  # sockets hold float32


def microfacets(roughness: float, compensated: float = 1.0) -> dict[str, float]:
    alpha = roughness**2
    return {"alpha_x": alpha, "alpha_y": alpha, "turn": 0.0, "compensated": compensated}


def assert_lobe(lobe: Lobe, kind: str, colour: Any, parameters: Any, **others: Any) -> None:
    assert lobe.kind == kind
    assert lobe.colour == near(tuple(colour))
    assert lobe.parameters.keys() == parameters.keys()
    for name, value in parameters.items():
        assert lobe.parameters[name] == near(value), name
    assert lobe.weight == near(others.get("weight", 1.0))
    assert lobe.covered == near(tuple(others.get("covered", BLACK)))


def specular(material: Material) -> RGB:
    """The reflectance of the paper's only lobe."""
    return material.lobes[0].colour if material.lobes else BLACK


def exponent(material: Material) -> float:
    (lobe,) = material.lobes
    if lobe.kind == "mirror":
        assert not lobe.parameters
        return MIRROR
    assert lobe.kind == "phong" and list(lobe.parameters) == ["exponent"]
    return lobe.parameters["exponent"]


def joined(kind: str, first: dict, second: dict, factor: float | None = None) -> bpy.types.Material:
    """Two shaders in a Mix or Add Shader."""
    material, tree = new_material()
    node = tree.nodes.new(kind)
    sockets = list(node.inputs)[-2:]
    if factor is not None:
        node.inputs[0].default_value = factor
    for shader, socket in zip((first, second), sockets, strict=True):
        tree.links.new(add_node(tree, **shader).outputs[0], socket)
    finish(tree, node)
    return material


mixed = partial(joined, "ShaderNodeMixShader")
added = partial(joined, "ShaderNodeAddShader")
