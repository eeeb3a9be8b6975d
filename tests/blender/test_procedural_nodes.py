# SPDX-License-Identifier: GPL-3.0-or-later
"""What readers of procedural textures ask of the program; what they give is in test_nodes.py."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

from addon.photon.stage import straight
from addon.photon.stage.kinds import node_kinds
from tests.measure import render

from .build import add_node, features, finish, new_material
from .node_cases import CELL, lay_out
from .procedural_cases import extremes, noise, voronoi
from .test_nodes import compare

pytestmark = pytest.mark.blender


def test_straight_code(export, cycles_mean, device) -> None:
    """A sheet is for the interpreter; few nodes are not, which know their choices as constants."""
    cases = [noise("3D", "FBM", "Color", Distortion=0.6), voronoi("2D", "F2", "Color", "CHEBYCHEV")]
    compare(export, cycles_mean, device, "fragment", cases)
    assert len(straight.straight_code(export()[0].materials).shapes) == len(cases)


@pytest.mark.thorough
def test_extremes_stay_finite(export, device) -> None:
    """As light, which has no upper bound."""
    cases = extremes()
    columns, rows = lay_out(cases)
    for case in cases:
        tree = bpy.data.materials[case.name].node_tree
        paper = tree.nodes["Diffuse BSDF"]
        shown = paper.inputs["Color"].links[0].from_socket
        finish(tree, add_node(tree, "ShaderNodeEmission", Color=shown))
    size = {"width": CELL * columns, "height": CELL * rows}
    picture = render(device, export()[0], backend="fragment", photons=0, **size)["Combined"]
    assert (picture[..., :3].reshape(rows, CELL, columns, CELL, 3).max((1, 3, 4)) > 0.0).sum() > 20
    assert np.isfinite(picture).all() and picture.min() >= 0.0


def test_texture_mapping_is_noted(convert) -> None:
    """Old files may have one, which no panel shows."""
    material, tree = new_material()
    node = tree.nodes.new("ShaderNodeTexMagic")
    node.texture_mapping.translation.x = 0.5
    finish(tree, add_node(tree, "ShaderNodeBsdfDiffuse", Color=node.outputs["Color"]))
    _, report = convert(material)
    assert features(report, "approximated") == ["Texture Mapping of 'Magic Texture'"]


def test_colour_is_found_only_where_it_is_asked_for(convert) -> None:
    """It takes three times as long; both outputs take one instruction."""
    material, tree = new_material()
    node = tree.nodes.new("ShaderNodeTexNoise")
    shader = add_node(tree, "ShaderNodeBsdfPrincipled", Roughness=node.outputs[0])
    finish(tree, shader)
    (alone,) = [each for each in convert(material)[0].program if each.kind == "noise_3d"]
    tree.links.new(node.outputs["Color"], shader.inputs["Base Color"])
    (both,) = [each for each in convert(material)[0].program if each.kind == "noise_3d"]
    coloured = [names.index("coloured") for names in node_kinds()["noise_3d"].operands[-1:]]
    assert [each.operands[-1][coloured[0]] for each in (alone, both)] == [0.0, 1.0]


@pytest.mark.parametrize("kind", ["Blackbody", "Wavelength"])
def test_constants_need_no_program(convert, kind) -> None:
    material, tree = new_material()
    node = add_node(tree, f"ShaderNode{kind}")
    finish(tree, add_node(tree, "ShaderNodeBsdfDiffuse", Color=node.outputs[0]))
    material, _ = convert(material)
    assert not material.program and max(material.diffuse) > 0.0
