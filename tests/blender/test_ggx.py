# SPDX-License-Identifier: GPL-3.0-or-later
"""Glossy shaders become GGX, by the formulae of Cycles 5.0: svm/closure.h, bsdf_microfacet.h."""

from __future__ import annotations

import math
from typing import Any

import bpy
import numpy as np
import pytest

from addon.blender.export import SpecularModel

from .build import add_node, features, finish, new_material, nodes_of, shader_material
from .lobes import (
    BLACK,
    DIFFUSE,
    GLASS,
    GLOSSY,
    GOLD,
    METALLIC,
    PRINCIPLED,
    RED,
    REFRACTION,
    assert_lobe,
    microfacets,
    near,
    needs_metallic,
)

pytestmark = pytest.mark.blender


def f0_of(ior: float) -> float:
    return ((ior - 1.0) / (ior + 1.0)) ** 2


@pytest.mark.thorough("1.33", "0.25]")  # between others
@pytest.mark.parametrize("transmission", [0.0, 0.25, 1.0])
@pytest.mark.parametrize("ior", [0.75, 1.0, 1.33, 1.5, 2.0])
@pytest.mark.parametrize("level", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("metallic", [0.0, 0.5, 1.0])
def test_principled(convert, metallic, level, ior, transmission) -> None:
    """Metal by its share; the rest a dielectric's lobe over the base that is not transmitted."""
    tint, roughness = (1.0, 0.5, 0.25), 0.3
    material, report = convert(
        shader_material(
            PRINCIPLED,
            Base_Color=RED,
            Metallic=metallic,
            Roughness=roughness,
            IOR=ior,
            Specular_IOR_Level=level,
            Specular_Tint=(*tint, 1.0),
            Transmission_Weight=transmission,
        )
    )
    f0 = f0_of(ior) * 2.0 * level
    curve = (1.0 + math.sqrt(f0)) / (1.0 - math.sqrt(f0))
    curve = curve if ior >= 1.0 else 1.0 / curve
    opaque = (1.0 - metallic) * (1.0 - transmission)
    under = tuple(opaque * c for c in RED[:3])
    lobes = sorted(material.lobes, key=lambda lobe: lobe.kind == "transparent")  # which is first
    if metallic > 0.0:
        parameters = microfacets(roughness) | {"tint": tint}
        assert_lobe(lobes.pop(0), "ggx_metal", RED[:3], parameters, weight=metallic)
    if metallic < 1.0 and transmission > 0.0:
        root = tuple(math.sqrt(c) for c in RED[:3])
        share = transmission * (1.0 - metallic)
        if ior == 1.0:
            passed = tuple(share * c for c in root)
            assert_lobe(lobes.pop(0), "transparent", passed, {})
        else:
            parameters = {"alpha": roughness**2, "compensated": 1.0}
            parameters |= {"ior": ior, "tint": tint, "reflects": 1.0, "open": 1.0}
            assert_lobe(lobes.pop(0), "ggx_glass", root, parameters, weight=share)
    if opaque > 0.0 and f0 > 0.0:
        (lobe,) = lobes
        parameters = microfacets(roughness) | {"ior": curve}
        colour = tuple(f0 * channel for channel in tint)
        weighed = {"weight": opaque, "covered": under}
        assert_lobe(lobe, "ggx_dielectric", colour, parameters, **weighed)
        assert material.diffuse == BLACK
    else:
        assert not lobes
        assert material.diffuse == near(under)
    assert features(report, "exact") == ["Shader"]


@pytest.mark.parametrize(
    ("inputs", "expected"),
    [
        ({"Metallic": 2.0}, {"kind": "ggx_metal", "weight": 1.0, "colour": RED[:3]}),
        ({"Metallic": -1.0}, {"kind": "ggx_dielectric", "weight": 1.0, "colour": (0.04,) * 3}),
        ({"Roughness": 3.0}, {"alpha_x": 1.0, "alpha_y": 1.0}),
        ({"Specular_IOR_Level": 99.0}, {"colour": (1.0,) * 3, "ior": 1.99499 / 0.00501}),
        ({"Base_Color": 7.0, "Metallic": 1.0}, {"kind": "ggx_metal", "colour": (1.0,) * 3}),
        ({"Base_Color": -7.0}, {"kind": "ggx_dielectric", "covered": BLACK}),
        ({"Specular_Tint": -1.0}, {"kind": "ggx_dielectric", "colour": BLACK}),
        ({"Specular_Tint": 5.0}, {"colour": (0.2,) * 3, "ior": 1.5}),
        ({"Specular_Tint": 5.0, "Metallic": 1.0}, {"tint": (1.0,) * 3}),
    ],
    ids=str,
)
def test_principled_is_clamped_as_in_cycles(convert, inputs, expected) -> None:
    material, tree = new_material()
    node = add_node(tree, PRINCIPLED, Base_Color=RED, IOR=1.5)
    for name, value in inputs.items():
        constant = tree.nodes.new("ShaderNodeValue")  # its range is not limited as a socket's is
        constant.outputs[0].default_value = value
        tree.links.new(constant.outputs[0], node.inputs[name.replace("_", " ")])
    finish(tree, node)
    (lobe,) = convert(material)[0].lobes
    found = {**vars(lobe), **lobe.parameters}
    for name, value in expected.items():
        assert found[name] == (value if isinstance(value, str) else pytest.approx(value, rel=1e-3))


@pytest.mark.parametrize("metallic", [0.0, 1.0])
def test_black_reflects_at_grazing_angles(convert, cycles, scene, metallic) -> None:
    """Black metal, and a dielectric of black tint, are no black body in Cycles: a tenth at 20
    degrees above the surface."""
    paint = {"Base_Color": (0, 0, 0, 1), "Specular_Tint": (0, 0, 0, 1), "Metallic": metallic}
    if metallic:
        del paint["Specular_Tint"]
    material, _ = convert(shader_material(PRINCIPLED, Roughness=0.2, **paint))
    (lobe,) = material.lobes
    assert lobe.colour == BLACK and lobe.reflects
    kind = "ggx_metal" if metallic else "ggx_dielectric"
    assert lobe.kind == kind
    world = scene.world = bpy.data.worlds.new("World")
    nodes_of(world).nodes["Background"].inputs["Color"].default_value = (1, 1, 1, 1)
    tilt = math.radians(70)
    scene.camera.data.type, scene.camera.data.ortho_scale = "ORTHO", 0.1
    scene.camera.location = (0, -9 * math.sin(tilt), 9 * math.cos(tilt))
    scene.camera.rotation_euler = (tilt, 0, 0)
    assert 0.05 < cycles()[..., :3].mean() < 0.2


@pytest.mark.parametrize(
    ("inputs", "status", "feature"),
    [
        ({"Thin_Film_Thickness": 500.0}, "ignored", "Thin Film"),
    ],
)
@pytest.mark.parametrize("model", SpecularModel)
def test_principled_says_what_it_lost(convert, inputs, status, feature, model) -> None:
    report = convert(shader_material(PRINCIPLED, **inputs), model)[1]
    assert feature in features(report, status)


@pytest.mark.parametrize("kind", [METALLIC, GLASS])
def test_thin_films_are_named(convert, kind) -> None:
    """Also of shaders that are nothing else."""
    if kind == METALLIC and bpy.app.version < (4, 3):
        pytest.skip("Metallic BSDF came with Blender 4.3")
    material, tree = new_material()
    node = add_node(tree, kind)
    if "Thin Film Thickness" not in node.inputs:
        pytest.skip(f"{node.bl_label} of {bpy.app.version_string} has no thin film")
    node.inputs["Thin Film Thickness"].default_value = 400.0
    finish(tree, node)
    assert "Thin Film" in features(convert(material)[1], "ignored")


@needs_metallic
@pytest.mark.parametrize("kind", [PRINCIPLED, GLOSSY, METALLIC, GLASS, REFRACTION])
def test_negative_roughness(convert, kind) -> None:
    """As nodes that subtract give it: none, but for Refraction, whose Cycles squares it; as in
    renders of Cycles 5.0."""
    metal = {"Metallic": 1.0} if kind == PRINCIPLED else {}
    material, _ = convert(shader_material(kind, Roughness=-0.5, **metal))
    (lobe,) = (lobe for lobe in material.lobes if lobe.reflects)
    alpha = lobe.parameters.get("alpha", lobe.parameters.get("alpha_x", 0.0))
    assert alpha == (0.25 if kind == REFRACTION else 0.0)


@pytest.mark.parametrize("roughness", [0.0037, 0.0038, 0.05, 0.5, 1.0])
def test_glossy(convert, roughness) -> None:
    """As in Cycles a mirror up to a roughness between the first two."""
    material, report = convert(shader_material(GLOSSY, Color=RED, Roughness=roughness))
    assert material.diffuse == BLACK
    (lobe,) = material.lobes
    if roughness < 0.0038:
        assert_lobe(lobe, "mirror", RED[:3], {})
    else:
        assert_lobe(lobe, "ggx", RED[:3], microfacets(roughness))
    assert features(report, "exact") == ["Shader"]


@pytest.mark.parametrize("kind", [GLOSSY, PRINCIPLED, GLASS, METALLIC])
@pytest.mark.parametrize("distribution", ["GGX", "MULTI_GGX", "BECKMANN", "ASHIKHMIN_SHIRLEY"])
def test_distribution(convert, kind, distribution) -> None:
    """Only Multiscatter GGX gives back what bounces between microfacets lose."""
    if kind == METALLIC and bpy.app.version < (4, 3):
        pytest.skip("Metallic BSDF came with Blender 4.3")
    material, tree = new_material()
    node = add_node(tree, kind, Roughness=0.5)
    if distribution not in node.bl_rna.properties["distribution"].enum_items:
        pytest.skip("the node has no such distribution")
    node.distribution = distribution
    finish(tree, node)
    converted, report = convert(material)
    (lobe,) = converted.lobes
    assert lobe.parameters["compensated"] == (distribution == "MULTI_GGX")
    named = f"Distribution {distribution}" in features(report, "approximated")
    assert named == (distribution not in ("GGX", "MULTI_GGX"))


@pytest.mark.parametrize("kind", [GLOSSY, METALLIC, PRINCIPLED])
@pytest.mark.parametrize("model", SpecularModel)
def test_phong_has_no_anisotropy(convert, kind, model) -> None:
    if kind == METALLIC and bpy.app.version < (4, 3):
        pytest.skip("Metallic BSDF came with Blender 4.3")
    name = "Anisotropic" if kind == PRINCIPLED else "Anisotropy"
    report = convert(shader_material(kind, Roughness=0.5, **{name: 0.5}), model)[1]
    assert (name in features(report, "approximated")) == (model is SpecularModel.PHONG)


@needs_metallic
def test_metallic_of_edge_tint(convert) -> None:
    tint = (0.5, 0.75, 1.0)
    given = {"Base_Color": GOLD, "Edge_Tint": (*tint, 1.0), "Roughness": 0.4}
    material, report = convert(shader_material(METALLIC, **given))
    (lobe,) = material.lobes
    assert_lobe(lobe, "ggx_metal", GOLD[:3], microfacets(0.4) | {"tint": tint})
    assert material.diffuse == BLACK
    assert features(report, "exact") == ["Shader"]


# n, k: gold, aluminium, and a metal that is hardly one.
CONDUCTORS = {
    "gold": ((0.18, 0.42, 1.37), (3.42, 2.35, 1.77)),
    "aluminium": ((1.36, 0.96, 0.62), (7.57, 6.59, 5.27)),
    "weak": ((2.0, 1.5, 1.1), (0.1, 0.5, 1.0)),
}


@needs_metallic
@pytest.mark.parametrize("name", CONDUCTORS)
def test_metallic_of_physical_conductor(convert, name) -> None:
    """Fresnel's equations of a complex index at 0 and 82 degrees, cos 82 = 1/7."""
    n, k = CONDUCTORS[name]
    material, tree = new_material()
    node = add_node(tree, METALLIC, Roughness=0.4)
    node.fresnel_type = "PHYSICAL_CONDUCTOR"
    node.inputs["IOR"].default_value, node.inputs["Extinction"].default_value = n, k
    finish(tree, node)
    converted, report = convert(material)

    def reflectance(cosine: float) -> Any:
        index = np.array(n) + 1j * np.array(k)
        root = np.sqrt(index**2 - 1 + cosine**2)
        s = (cosine - root) / (cosine + root)
        p = (index**2 * cosine - root) / (index**2 * cosine + root)
        return 0.5 * (np.abs(s) ** 2 + np.abs(p) ** 2)

    f0 = reflectance(1.0)
    tint = (reflectance(1 / 7) / (f0 + (1 - f0) * (6 / 7) ** 5)).clip(0, 1)
    (lobe,) = converted.lobes
    assert_lobe(lobe, "ggx_metal", f0, microfacets(0.4) | {"tint": tuple(tint)})
    assert features(report, "approximated") == ["Physical Conductor"]


@pytest.mark.parametrize("roughness", [0.0, 0.2])
@pytest.mark.parametrize("kind", [PRINCIPLED, GLASS, REFRACTION, DIFFUSE])
def test_dispersion(convert, kind, roughness) -> None:
    """A material's own, of all its glass; 0 is none: the lobes are what they were."""
    inputs = {"Transmission_Weight": 1.0} if kind == PRINCIPLED else {}
    inputs |= {"IOR": 1.6} if kind != DIFFUSE else {}
    material = shader_material(kind, Roughness=roughness, **inputs)
    plain, _ = convert(material)
    material.photon_stream.dispersion = 0.5
    (converted, report) = convert(material)
    if kind == DIFFUSE:
        assert converted == plain and features(report, "ignored") == ["Dispersion"]
        return
    (lobe,), (other,) = converted.lobes, plain.lobes
    parameters = {**other.parameters, "dispersion": 1 / 40}
    if roughness:
        parameters["switches"] = 2.0 * parameters.pop("reflects") + parameters.pop("compensated")
    wanted = {"glass": "dispersive_glass", "ggx_glass": "ggx_dispersive_glass"}[other.kind]
    assert_lobe(lobe, wanted, other.colour, parameters)
    assert "Dispersion" in features(report, "exact")
    material.photon_stream.dispersion = 0.0
    assert convert(material)[0] == plain


@pytest.mark.parametrize("ior", [0.75, 1.0, 1.33, 2.0])
@pytest.mark.parametrize(("kind", "reflects"), [(GLASS, 2.0), (REFRACTION, 0.0)])
@pytest.mark.parametrize("roughness", [0.0037, 0.0039, 0.2])
def test_glass(convert, kind, reflects, ior, roughness) -> None:
    """Smooth up to a roughness of 0.0038, as in Cycles; of an index of 1 its colour is left."""
    material, report = convert(shader_material(kind, Color=RED, IOR=ior, Roughness=roughness))
    assert material.diffuse == BLACK
    (lobe,) = material.lobes
    parameters = {"ior": ior, "tint": (1.0, 1.0, 1.0), "reflects": reflects, "open": 1.0}
    if ior == 1.0:
        assert_lobe(lobe, "transparent", RED[:3], {})
    elif roughness < 0.0038:
        assert_lobe(lobe, "glass", RED[:3], parameters)
    else:
        rough = {"alpha": roughness**2, "compensated": float(kind == GLASS)}
        assert_lobe(lobe, "ggx_glass", RED[:3], rough | parameters)
        if kind == REFRACTION:  # its own default is another
            assert features(report, "approximated") == ["Distribution BECKMANN"]
            return
    assert features(report, "exact") == ["Shader"]
