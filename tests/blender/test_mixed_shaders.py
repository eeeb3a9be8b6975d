# SPDX-License-Identifier: GPL-3.0-or-later
"""Several shaders in one material: Mix and Add Shader, and sums that are too bright."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

from addon.blender.export import SpecularModel

from .build import add_node, features, finish, new_material
from .lobes import (
    BLACK,
    DIFFUSE,
    GGX,
    GLOSSY,
    GOLD,
    PRINCIPLED,
    RED,
    added,
    assert_lobe,
    microfacets,
    mixed,
    near,
    specular,
)

pytestmark = pytest.mark.blender


def test_mix_weighs_its_shaders(convert) -> None:
    """A mirror's reflectance takes its share, of either model."""
    for model in SpecularModel:
        white = {"kind": GLOSSY, "Color": (1, 1, 1, 1), "Roughness": 0.0}
        material, report = convert(mixed({"kind": DIFFUSE, "Color": RED}, white, 0.25), model)
        assert material.diffuse == near(tuple(0.75 * c for c in RED[:3]))
        assert specular(material) == near((0.25,) * 3)
        assert features(report, "exact") == ["Shader"]
        bpy.data.objects.remove(bpy.data.objects["Plane"])


def test_mix_of_ggx(convert) -> None:
    """Weights and covered albedos take their shares; colours are what Fresnel's curves begin at."""
    plastic = {"kind": PRINCIPLED, "Base_Color": RED, "Roughness": 0.3, "Metallic": 0.5}
    gloss = {"kind": GLOSSY, "Color": GOLD, "Roughness": 0.6}
    material, report = convert(mixed(plastic, gloss, 0.25))
    metal, coat, glossy = material.lobes
    parameters = microfacets(0.3)
    white = {"tint": (1.0, 1.0, 1.0)}
    assert_lobe(metal, "ggx_metal", RED[:3], parameters | white, weight=0.375)
    under = tuple(0.375 * c for c in RED[:3])
    curve = parameters | {"ior": 1.5}
    assert_lobe(coat, "ggx_dielectric", (0.04,) * 3, curve, weight=0.375, covered=under)
    assert_lobe(glossy, "ggx", GOLD[:3], microfacets(0.6), weight=0.25)
    assert material.diffuse == BLACK
    assert features(report, "exact") == ["Shader"]


def test_mix_of_one_lobe_over_two_bases(convert) -> None:
    """Lobes of one shape become one, over what both cover."""
    red, gold = ({"kind": PRINCIPLED, "Base_Color": c, "Roughness": 0.3} for c in (RED, GOLD))
    material, _ = convert(mixed(red, gold, 0.25))
    (lobe,) = material.lobes
    covered = tuple(0.75 * a + 0.25 * b for a, b in zip(RED[:3], GOLD[:3], strict=True))
    parameters = microfacets(0.3) | {"ior": 1.5}
    assert_lobe(lobe, "ggx_dielectric", (0.04,) * 3, parameters, covered=covered)


@pytest.mark.parametrize("factor", [0.0, 1.0])
def test_mix_of_one_alone(convert, factor) -> None:
    red, gold = ({"kind": GLOSSY, "Color": c, "Roughness": 0.3} for c in (RED, GOLD))
    (lobe,) = convert(mixed(red, gold, factor))[0].lobes
    assert_lobe(lobe, "ggx", (GOLD if factor else RED)[:3], microfacets(0.3))


@pytest.mark.parametrize("model", SpecularModel)
def test_add_keeps_lobes_of_two_shapes(convert, model) -> None:
    grey, dim = (0.3, 0.3, 0.3, 1), (0.1, 0.1, 0.1, 1)
    rough = {"kind": GLOSSY, "Color": grey, "Roughness": 0.5}
    material, _ = convert(added(rough, {"kind": GLOSSY, "Color": dim, "Roughness": 0.0}), model)
    broad, mirror = material.lobes
    assert broad.colour == near((0.3,) * 3)
    assert_lobe(mirror, "mirror", dim[:3], {})
    if model is GGX:
        assert_lobe(broad, "ggx", grey[:3], microfacets(0.5))
    else:
        assert_lobe(broad, "phong", grey[:3], {"exponent": 30.0})


@pytest.mark.parametrize("model", SpecularModel)
def test_add_joins_lobes_of_one_shape(convert, model) -> None:
    grey = {"kind": GLOSSY, "Color": (0.3, 0.3, 0.3, 1), "Roughness": 0.5}
    material, _ = convert(added(grey, grey), model)
    (lobe,) = material.lobes
    assert lobe.weight * np.array(lobe.colour) == near(np.full(3, 0.6))


def test_too_bright_sums_are_named(convert) -> None:
    """The eye sees them as in Cycles."""
    for model in SpecularModel:
        diffuse = {"kind": DIFFUSE, "Color": (0.9, 0.3, 0.3, 1)}
        mirror = {"kind": GLOSSY, "Color": (0.6, 0.6, 0.6, 1), "Roughness": 0.0}
        converted, report = convert(added(diffuse, mirror), model)
        assert converted.diffuse == near((0.9, 0.3, 0.3))
        assert specular(converted) == near((0.6, 0.6, 0.6))
        assert features(report, "approximated") == ["Albedo above 1"]
        bpy.data.objects.remove(bpy.data.objects["Plane"])


def test_sums_by_nodes_may_be_too_bright(convert) -> None:
    """What mixes lobes gives each its share, what adds them does not."""
    white = {"kind": DIFFUSE, "Color": (1, 1, 1, 1)}
    glossy = {"kind": GLOSSY, "Color": (1, 1, 1, 1), "Roughness": 0.5}
    found = []
    for material in (
        mixed(white, glossy),
        added(white, glossy),
        added(white, {"kind": "ShaderNodeEmission"}),
    ):
        tree = material.node_tree
        checker = add_node(tree, "ShaderNodeTexChecker")
        ramp = add_node(tree, "ShaderNodeValToRGB", Fac=checker.outputs["Fac"])
        for node in tree.nodes:
            if node.type in ("MIX_SHADER", "BSDF_DIFFUSE"):
                tree.links.new(ramp.outputs["Color"], node.inputs[0])
        converted, _ = convert(material)
        assert converted.program
        found.append(converted.may_be_too_bright)
        bpy.data.objects.remove(bpy.data.objects["Plane"])
    assert found == [False, True, False]


@pytest.mark.parametrize("most", [1.0, 3.0])
def test_mixtures_of_what_nodes_make_brighter_than_one(convert, most) -> None:
    """Its share is clamped after it is scaled, as Cycles has more of it than that."""
    white = {"kind": GLOSSY, "Color": (1, 1, 1, 1), "Roughness": 0.5}
    material = mixed({"kind": DIFFUSE, "Color": RED}, white, 0.5)
    tree = material.node_tree
    noise, ramp = add_node(tree, "ShaderNodeTexNoise"), add_node(tree, "ShaderNodeMath")
    ramp.operation, ramp.use_clamp, ramp.inputs[1].default_value = "MULTIPLY", most == 1.0, most
    tree.links.new(noise.outputs[0], ramp.inputs[0])
    diffuse = next(node for node in tree.nodes if node.type == "BSDF_DIFFUSE")
    tree.links.new(ramp.outputs[0], diffuse.inputs["Color"])
    assert convert(material)[0].may_be_too_bright == (most > 1.0)


def test_too_bright_sums_of_ggx(convert) -> None:
    """A white dielectric and a white lobe: each is as by itself."""
    white = (1, 1, 1, 1)
    plastic = {"kind": PRINCIPLED, "Base_Color": white, "Roughness": 0.3}
    converted, report = convert(added(plastic, {"kind": GLOSSY, "Color": white, "Roughness": 0.5}))
    coat, glossy = converted.lobes
    assert glossy.colour == near((1.0,) * 3)
    assert coat.covered == near((1.0,) * 3)
    assert features(report, "approximated") == ["Albedo above 1"]


@pytest.mark.parametrize("shader", [DIFFUSE, PRINCIPLED, GLOSSY])
@pytest.mark.parametrize("is_first", [False, True])
def test_what_is_transparent_has_no_normal(convert, shader, is_first) -> None:
    """A leaf cut out by an image keeps its bumps, whatever Transparent weighs."""
    material, tree = new_material()
    leaf, clear = add_node(tree, shader), add_node(tree, "ShaderNodeBsdfTransparent")
    bump = add_node(tree, "ShaderNodeBump", Height=tree.nodes.new("ShaderNodeTexNoise").outputs[0])
    tree.links.new(bump.outputs[0], leaf.inputs["Normal"])
    cut = tree.nodes.new("ShaderNodeTexChecker").outputs["Fac"]
    both = add_node(tree, "ShaderNodeMixShader", Fac=cut)
    for socket, node in zip(both.inputs[1:], (leaf, clear)[:: 1 if is_first else -1], strict=True):
        tree.links.new(node.outputs[0], socket)
    finish(tree, both)
    found, report = convert(material)
    assert "normal" in found.varying
    assert "Different normals" not in features(report, "approximated")
