# SPDX-License-Identifier: GPL-3.0-or-later
"""Every shader node becomes lobes, as Cycles evaluates it."""

from __future__ import annotations

from itertools import product

import bpy
import numpy as np
import pytest

from addon.blender.export import SpecularModel
from addon.blender.export.shaders import READERS
from addon.photon.stage.kinds import COLOUR, check_kinds, lobe_kinds
from tests.measure import render

from .build import add_mesh, add_node, features, finish, new_material, shader_material
from .lobes import (
    BLACK,
    DIFFUSE,
    GGX,
    GLASS,
    GLOSSY,
    GOLD,
    METALLIC,
    PHONG,
    PRINCIPLED,
    RED,
    assert_lobe,
    joined,
    microfacets,
    mixed,
    near,
)

pytestmark = pytest.mark.blender

SHADERS = {
    "BSDF_DIFFUSE": DIFFUSE,
    "BSDF_GLASS": GLASS,
    "BSDF_GLOSSY": GLOSSY,
    "BSDF_HAIR": "ShaderNodeBsdfHair",
    "BSDF_HAIR_PRINCIPLED": "ShaderNodeBsdfHairPrincipled",
    "BSDF_METALLIC": METALLIC,
    "BSDF_PRINCIPLED": PRINCIPLED,
    "BSDF_REFRACTION": "ShaderNodeBsdfRefraction",
    "BSDF_SHEEN": "ShaderNodeBsdfSheen",
    "BSDF_TOON": "ShaderNodeBsdfToon",
    "BSDF_TRANSLUCENT": "ShaderNodeBsdfTranslucent",
    "BSDF_TRANSPARENT": "ShaderNodeBsdfTransparent",
    "BACKGROUND": "ShaderNodeBackground",
    "EMISSION": "ShaderNodeEmission",
    "HOLDOUT": "ShaderNodeHoldout",
    "SUBSURFACE_SCATTERING": "ShaderNodeSubsurfaceScattering",
}
JOINTS = {"ADD_SHADER": "ShaderNodeAddShader", "MIX_SHADER": "ShaderNodeMixShader"}
GLASSY = {"BSDF_GLASS", "BSDF_REFRACTION"}
SPECULAR = {"BSDF_GLOSSY", "BSDF_METALLIC", "BSDF_PRINCIPLED", *GLASSY, *JOINTS}
SPECULAR |= {"BSDF_TRANSLUCENT"}
# Of GGX's model: in the paper's they are Lambert's.
DIFFUSE_LOBES = {"BSDF_DIFFUSE", "BSDF_SHEEN", "BSDF_TOON", "SUBSURFACE_SCATTERING"}
MICROFACETS = {"mirror", "ggx", "ggx_metal", "ggx_dielectric", "glass", "ggx_glass"}
SHEET = {"translucent"}
KINDS = {
    GGX: MICROFACETS
    | SHEET
    | {"oren_nayar", "sheen", "velvet", "coat", "bent_coat", "toon", "subsurface"},
    PHONG: SHEET | {"mirror", "phong", "glass", "ggx_glass"},
}


def variants(kind: str) -> list[bpy.types.Material]:
    """Materials of a kind of node: smooth and rough, metal by halves, by every Fresnel."""
    found = []
    for roughness, metallic in product((0.0, 0.5), (0.0, 0.5, 1.0)):
        given = {"kind": SHADERS.get(kind, PRINCIPLED)}
        if kind in JOINTS:
            other = {"kind": GLOSSY, "Roughness": roughness}
            found.append(joined(JOINTS[kind], given | {"Metallic": metallic}, other))
            continue
        material, tree = new_material()
        node = add_node(tree, **given)
        given = {"Roughness": roughness, "Metallic": metallic}
        layers = ("Diffuse Roughness", "Coat Weight", "Sheen Weight")
        for name, value in (given | dict.fromkeys(layers, metallic)).items():
            if name in node.inputs:
                node.inputs[name].default_value = value
        if kind == "BSDF_METALLIC" and metallic:
            node.fresnel_type = "PHYSICAL_CONDUCTOR"
        if kind == "BSDF_SHEEN" and metallic:
            node.distribution = "ASHIKHMIN"
        assert node.type == kind
        finish(tree, node)
        found.append(material)
    return found


@pytest.mark.parametrize("model", SpecularModel)
@pytest.mark.parametrize("kind", READERS)
def test_lobes_have_what_their_files_ask_for(export, kind, model) -> None:
    """Of every reader, the kinds of its model, with the parameters that heads in glsl/bsdf name."""
    if kind == "BSDF_METALLIC" and bpy.app.version < (4, 3):
        pytest.skip("Metallic BSDF came with Blender 4.3")
    for number, material in enumerate(variants(kind)):
        add_mesh(f"Plane {number}").data.materials.append(material)
    scene, _ = export(model)
    check_kinds(scene)
    lobes = [lobe for material in scene.materials for lobe in material.lobes]
    assert bool(lobes) == (kind in SPECULAR or (model is GGX and kind in DIFFUSE_LOBES))
    for lobe in lobes:
        assert lobe.kind in KINDS[model]
        asked = lobe_kinds()[lobe.kind].parameters
        assert list(lobe.parameters) == list(asked)
        for name, unit in asked.items():
            assert np.shape(lobe.parameters[name]) == ((3,) if unit == COLOUR else ()), name


def test_every_reader_is_tested() -> None:
    assert READERS.keys() == SHADERS.keys() | JOINTS.keys()


@pytest.mark.parametrize("model", SpecularModel)
def test_diffuse(convert, model) -> None:
    material, report = convert(shader_material(DIFFUSE, Color=RED), model)
    assert material.diffuse == near(RED[:3])
    assert not material.lobes
    assert features(report, "exact") == ["Shader"]
    assert not features(report, "approximated")


def test_rough_diffuse(convert) -> None:
    material, report = convert(shader_material(DIFFUSE, Color=RED, Roughness=0.5))
    (lobe,) = material.lobes
    assert_lobe(lobe, "oren_nayar", RED[:3], {"diffuse_roughness": 0.5})
    assert material.diffuse == BLACK
    assert features(report, "exact") == ["Shader"]
    bpy.data.objects.remove(bpy.data.objects["Plane"])
    report = convert(shader_material(DIFFUSE, Roughness=0.5), PHONG)[1]
    assert features(report, "approximated") == ["Diffuse roughness"]


@pytest.mark.parametrize(
    ("distribution", "kind", "name"),
    [("MICROFIBER", "sheen", "roughness"), ("ASHIKHMIN", "velvet", "sigma")],
)
def test_sheen(convert, distribution, kind, name) -> None:
    material, tree = new_material()
    node = add_node(tree, "ShaderNodeBsdfSheen", Color=RED, Roughness=0.3)
    node.distribution = distribution
    finish(tree, node)
    converted, report = convert(material)
    (lobe,) = converted.lobes
    assert_lobe(lobe, kind, RED[:3], {name: 0.3})
    assert features(report, "exact") == ["Shader"]


def test_principled_layers(convert) -> None:
    """Sheen over a coat over a dielectric over a rough base; and what a Mix Shader makes of it."""
    coat = {"Coat_Weight": 0.5, "Coat_Roughness": 0.2, "Coat_IOR": 1.6, "Coat_Tint": GOLD}
    sheen = {"Sheen_Weight": 0.5, "Sheen_Roughness": 0.4, "Sheen_Tint": RED}
    paint = {"Base_Color": RED, "Roughness": 0.3, "Diffuse_Roughness": 0.7, "IOR": 1.5}
    layered = {"kind": PRINCIPLED} | coat | sheen | paint
    expected = [
        ("sheen", tuple(0.5 * c for c in RED[:3]), {"roughness": 0.4}, None),
        ("coat", GOLD[:3], {"alpha": 0.04, "ior": 1.6, "cover": 0.5}, 0),
        ("ggx_dielectric", (0.04,) * 3, microfacets(0.3) | {"ior": 1.5}, 1),
        ("oren_nayar", RED[:3], {"diffuse_roughness": 0.7}, 2),
    ]
    material, report = convert(shader_material(**layered))
    assert [lobe.over for lobe in material.lobes] == [over for *_, over in expected]
    for lobe, given in zip(material.lobes, expected, strict=True):
        assert_lobe(lobe, *given[:3])
    assert features(report, "exact") == ["Shader"]
    bpy.data.objects.remove(bpy.data.objects["Plane"])
    material, _ = convert(mixed({"kind": PRINCIPLED, "Roughness": 0.3, "IOR": 1.5}, layered, 0.25))
    assert [lobe.over for lobe in material.lobes] == [None, None, 1, 2, 3]
    assert [lobe.weight for lobe in material.lobes] == near([0.75, *[0.25] * 4])


def test_layers_over_lamberts_base(convert) -> None:
    """Each takes the base that nothing is between."""
    given = {"Base_Color": RED, "Coat_Weight": 1.0, "Specular_IOR_Level": 0.0}
    (coat,) = convert(shader_material(PRINCIPLED, **given))[0].lobes
    assert coat.kind == "coat" and coat.covered == near(RED[:3])
    bpy.data.objects.remove(bpy.data.objects["Plane"])
    given = {"Base_Color": RED, "Subsurface_Weight": 0.75, "Diffuse_Roughness": 0.5}
    material, report = convert(shader_material(PRINCIPLED, **given))
    interface, rough, below = material.lobes
    assert interface.covered == (0.0,) * 3
    assert (rough.weight, rough.over) == (near(0.25), 0)
    assert (below.kind, below.weight, below.over) == ("subsurface", near(0.75), 0)
    assert features(report, "exact") == ["Shader"]


@pytest.mark.parametrize(("component", "kind"), [("DIFFUSE", "toon"), ("GLOSSY", "glossy_toon")])
def test_toon(convert, component, kind) -> None:
    material = shader_material("ShaderNodeBsdfToon", Color=RED, Size=0.5, Smooth=0.1)
    material.node_tree.nodes["Toon BSDF"].component = component
    (lobe,) = convert(material)[0].lobes
    assert_lobe(lobe, kind, RED[:3], {"size": 0.5, "edge": 0.1})


@pytest.mark.parametrize(
    ("linked", "kind"),
    [
        ((), "coat"),
        (("Normal",), "bent_coat"),
        (("Coat Normal",), "bent_coat"),
        (("Normal", "Coat Normal"), "coat"),
    ],
)
def test_coats_have_normals_of_their_own(convert, linked, kind) -> None:
    """What bends the base leaves the coat smooth, as in Cycles."""
    material, tree = new_material()
    node = add_node(tree, PRINCIPLED, Coat_Weight=1.0)
    bump = add_node(tree, "ShaderNodeBump", Height=tree.nodes.new("ShaderNodeTexNoise").outputs[0])
    for name in linked:
        tree.links.new(bump.outputs[0], node.inputs[name])
    finish(tree, node)
    converted, report = convert(material)
    assert converted.lobes[0].kind == kind and not features(report, "approximated")
    assert ("normal" in converted.varying) == ("Normal" in linked)


def test_emission_below_a_coat(convert) -> None:
    """A tinted coat of index 1 lets its tint through."""
    emission = {"Emission_Color": GOLD, "Emission_Strength": 2.0}
    coat = {"Coat_Weight": 0.5, "Coat_IOR": 1.0, "Coat_Tint": RED}
    material, report = convert(shader_material(PRINCIPLED, **emission, **coat))
    expected = (2.0 * g * (0.5 + 0.5 * r) for g, r in zip(GOLD[:3], RED[:3], strict=True))
    assert max(material.emission) < 2.0
    found = np.array(material.emission) / tuple(expected)
    assert found.max() - found.min() < 0.2 and 0.5 < found.mean() < 1.0
    assert features(report, "approximated") == ["Emission below a coat"]


@pytest.mark.parametrize("told", ["nothing", "Coat Weight", "Coat Tint", "Sheen Weight"])
def test_emission_below_layers(scene, export, device, cycles_mean, told) -> None:
    """As bright as in Cycles, in the mean over a ball, by constants and by textures alike."""
    emission = {"Emission_Color": GOLD, "Emission_Strength": 2.0, "Base_Color": (0, 0, 0, 1)}
    of_sheen = {"Sheen_Weight": 0.9, "Sheen_Roughness": 0.7, "Sheen_Tint": (0.9, 0.5, 0.7, 1)}
    of_coat = {"Coat_Weight": 0.7, "Coat_IOR": 1.7, "Coat_Tint": (0.8, 0.3, 0.2, 1)}
    over = of_sheen if told == "Sheen Weight" else of_coat
    material = shader_material(PRINCIPLED, Specular_IOR_Level=0.0, **emission, **over)
    tree = material.node_tree
    if told != "nothing":
        place = add_node(tree, "ShaderNodeTexCoord").outputs["Generated"]
        socket = tree.nodes["Principled BSDF"].inputs[told]
        tree.links.new(place, socket)
    bpy.ops.mesh.primitive_uv_sphere_add(radius=1.5)
    bpy.context.object.data.materials.append(material)
    size = {"width": 64, "height": 32}
    ours = render(device, export()[0], photons=0, passes=8, **size)["Combined"][..., :3]
    theirs = cycles_mean(64, 1)[..., :3]
    assert ours.mean(axis=(0, 1)) == pytest.approx(theirs.mean(axis=(0, 1)), rel=0.02)


@pytest.mark.parametrize(
    ("kind", "status"),
    [
        ("ShaderNodeBsdfRayPortal", "ignored"),
        ("ShaderNodeBsdfHair", "approximated"),
        ("ShaderNodeBsdfHairPrincipled", "approximated"),
    ],
)
@pytest.mark.parametrize("model", SpecularModel)
def test_unknown_shaders_are_named(convert, kind, status, model) -> None:
    assert features(convert(shader_material(kind), model)[1], status)


@pytest.mark.parametrize("name", ["COLOR", "MELANIN", "ABSORPTION"])
@pytest.mark.parametrize("model", ["CHIANG", "HUANG"])
def test_principled_hair_has_its_colour(convert, model, name) -> None:
    """That of much of it, whatever tells it: half of all melanin, all of it dark."""
    absorbed = np.log(2.0) * np.array((0.506, 0.841, 1.653))
    seen = np.exp(-np.sqrt(absorbed) * 5.8887)  # at a roughness of 0.3, a new node's
    inputs = {
        "COLOR": {"Color": (*seen, 1.0)},
        "MELANIN": {"Melanin": 0.5, "Melanin Redness": 0.0, "Tint": (1.0, 1.0, 1.0, 1.0)},
        "ABSORPTION": {"Absorption Coefficient": absorbed},
    }
    material, tree = new_material()
    hair = add_node(tree, "ShaderNodeBsdfHairPrincipled")
    hair.model, hair.parametrization = model, name
    for socket, given in inputs[name].items():
        hair.inputs[socket].default_value = given
    finish(tree, hair)
    assert convert(material)[0].diffuse == pytest.approx(seen, rel=1e-3)


@pytest.mark.parametrize(
    ("kind", "expected"), [("ShaderNodeRGB", (0.5, 0.5, 0.5)), ("ShaderNodeValue", (0.5,) * 3)]
)
def test_colours_in_place_of_shaders_are_emitted(convert, kind, expected) -> None:
    material, tree = new_material()
    node = add_node(tree, kind)
    half = 0.5 if kind == "ShaderNodeValue" else (0.5, 0.5, 0.5, 1.0)
    node.outputs[0].default_value = half
    finish(tree, node)
    assert convert(material)[0].emission == pytest.approx(expected)
