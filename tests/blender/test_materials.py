# SPDX-License-Identifier: GPL-3.0-or-later
"""Shader nodes become k_d, k_s and an exponent; whatever gets lost is in the report."""

from __future__ import annotations

import math
from pathlib import Path

import bpy
import numpy as np
import pytest

from addon.blender.export import Report
from addon.photon.scene import MIRROR, Material

from .build import add_mesh, add_node, finish, new_material, shader_material

pytestmark = pytest.mark.blender

RED = (0.8, 0.2, 0.1, 1.0)
DIFFUSE, GLOSSY = "ShaderNodeBsdfDiffuse", "ShaderNodeBsdfGlossy"
PRINCIPLED = "ShaderNodeBsdfPrincipled"


@pytest.fixture
def convert(export):
    """Return the exported material that a plane wears, and the report."""

    def run(material: bpy.types.Material | None) -> tuple[Material, Report]:
        add_mesh("Plane").data.materials.append(material)
        scene, report = export()
        (converted,) = scene.materials
        return converted, report

    return run


def features(report: Report, status: str) -> list[str]:
    return [entry.feature for entry in report.of(status) if entry.object.startswith("Material")]


def test_no_material_is_default_grey(convert) -> None:
    material, report = convert(None)
    assert (material.diffuse, material.specular) == ((0.8, 0.8, 0.8), (0.0, 0.0, 0.0))
    assert [e.feature for e in report.of("exact") if e.object == "Object 'Plane'"] == [
        "No material"
    ]


def test_diffuse(convert) -> None:
    material, report = convert(shader_material(DIFFUSE, Color=RED))
    assert material.diffuse == pytest.approx(RED[:3])
    assert material.specular == (0.0, 0.0, 0.0)
    assert features(report, "exact") == ["Shader"]
    assert not features(report, "approximated")


def test_oren_nayar_is_approximated(convert) -> None:
    report = convert(shader_material(DIFFUSE, Roughness=0.5))[1]
    assert features(report, "approximated") == ["Diffuse roughness"]


def test_sharp_glossy_is_an_exact_mirror(convert) -> None:
    material, report = convert(shader_material(GLOSSY, Color=RED, Roughness=0.0))
    assert material.diffuse == (0.0, 0.0, 0.0)
    assert material.specular == pytest.approx(RED[:3])
    assert material.exponent == MIRROR
    assert features(report, "exact") == ["Shader"]


def test_rough_glossy_is_a_phong_lobe(convert) -> None:
    material, report = convert(shader_material(GLOSSY, Color=RED, Roughness=0.5))
    assert material.exponent == pytest.approx(2.0 / 0.5**4 - 2.0)
    assert features(report, "approximated") == ["Roughness 0.5"]


def test_hardly_rough_glossy_is_a_mirror_and_says_so(convert) -> None:
    material, report = convert(shader_material(GLOSSY, Roughness=0.01))
    assert material.exponent == MIRROR
    assert features(report, "approximated") == ["Roughness 0.01"]


@pytest.mark.parametrize(
    ("inputs", "diffuse", "specular"),
    [
        ({"Metallic": 1.0}, 0.0, 0.5),
        ({"Specular_IOR_Level": 0.0}, 0.5, 0.0),
        ({}, 0.5 * (1 - 0.04), 0.04),
        ({"Metallic": 0.5}, 0.25 * (1 - 0.04), 0.25 + 0.02),
        ({"IOR": 2.0}, 0.5 * (1 - 1 / 9), 1 / 9),
        ({"Transmission_Weight": 1.0}, 0.0, 0.04),
    ],
)
def test_principled(convert, inputs, diffuse, specular) -> None:
    grey = (0.5, 0.5, 0.5, 1.0)
    node = {"Base_Color": grey, "IOR": 1.5, "Metallic": 0.0, "Roughness": 0.5} | inputs
    material, report = convert(shader_material(PRINCIPLED, **node))
    assert material.diffuse == pytest.approx((diffuse,) * 3, abs=1e-6)
    assert material.specular == pytest.approx((specular,) * 3, abs=1e-6)
    if specular:
        assert "Principled reflection" in features(report, "approximated")
        assert material.exponent == pytest.approx(30.0)
    else:
        assert features(report, "exact") == ["Shader"]


@pytest.mark.parametrize(
    ("inputs", "status", "feature"),
    [
        ({"Alpha": 0.5}, "ignored", "Alpha"),
        ({"Coat_Weight": 1.0}, "ignored", "Coat"),
        ({"Sheen_Weight": 1.0}, "ignored", "Sheen"),
        ({"Emission_Strength": 2.0}, "ignored", "Emission"),
        ({"Subsurface_Weight": 0.5}, "approximated", "Subsurface"),
        ({"Transmission_Weight": 0.5}, "approximated", "Transmission"),
        ({"Anisotropic": 0.5}, "approximated", "Anisotropic"),
    ],
)
def test_principled_says_what_it_lost(convert, inputs, status, feature) -> None:
    report = convert(shader_material(PRINCIPLED, **inputs))[1]
    assert feature in features(report, status)


def test_mix_weighs_its_shaders(convert) -> None:
    material, tree = new_material()
    diffuse = add_node(tree, DIFFUSE, Color=RED)
    glossy = add_node(tree, GLOSSY, Color=(1, 1, 1, 1), Roughness=0.0)
    mix = tree.nodes.new("ShaderNodeMixShader")
    mix.inputs[0].default_value = 0.25
    tree.links.new(diffuse.outputs[0], mix.inputs[1])
    tree.links.new(glossy.outputs[0], mix.inputs[2])
    finish(tree, mix)
    converted, report = convert(material)
    assert converted.diffuse == pytest.approx(tuple(0.75 * c for c in RED[:3]))
    assert converted.specular == pytest.approx((0.25,) * 3)
    assert features(report, "exact") == ["Shader"]


def test_add_of_two_lobes_joins_them(convert) -> None:
    material, tree = new_material()
    grey = (0.3, 0.3, 0.3, 1)
    first = add_node(tree, GLOSSY, Color=grey, Roughness=0.5)
    second = add_node(tree, GLOSSY, Color=(0.1, 0.1, 0.1, 1), Roughness=0.0)
    add = tree.nodes.new("ShaderNodeAddShader")
    tree.links.new(first.outputs[0], add.inputs[0])
    tree.links.new(second.outputs[0], add.inputs[1])
    finish(tree, add)
    converted, report = convert(material)
    assert converted.specular == pytest.approx((0.4,) * 3)
    assert converted.exponent == pytest.approx(30.0)
    assert "Reflections of different roughness" in features(report, "approximated")


def test_linked_factor_is_approximated(convert) -> None:
    material, tree = new_material()
    mix = tree.nodes.new("ShaderNodeMixShader")
    mix.inputs[0].default_value = 0.75
    noise = tree.nodes.new("ShaderNodeTexNoise")
    tree.links.new(noise.outputs[0], mix.inputs[0])
    for index, level in ((1, 0.0), (2, 0.8)):
        shader = add_node(tree, DIFFUSE, Color=(level, level, level, 1))
        tree.links.new(shader.outputs[0], mix.inputs[index])
    finish(tree, mix)
    converted, report = convert(material)
    assert converted.diffuse == pytest.approx((0.6,) * 3)
    (entry,) = [e for e in report.of("approximated") if e.object == "Material 'Material'"]
    assert "Noise Texture" in entry.feature and "0.75" in entry.detail


def test_constants_reroutes_and_groups_are_followed(convert) -> None:
    inner = bpy.data.node_groups.new("Group", "ShaderNodeTree")
    inner.interface.new_socket("Paint", in_out="INPUT", socket_type="NodeSocketColor")
    inner.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    entrance, exit_ = (inner.nodes.new(f"NodeGroup{end}") for end in ("Input", "Output"))
    shader = add_node(inner, DIFFUSE, Color=entrance.outputs[0])
    inner.links.new(shader.outputs[0], exit_.inputs[0])
    material, tree = new_material()
    group = tree.nodes.new("ShaderNodeGroup")
    group.node_tree = inner
    colour, reroute = tree.nodes.new("ShaderNodeRGB"), tree.nodes.new("NodeReroute")
    colour.outputs[0].default_value = RED
    tree.links.new(colour.outputs[0], reroute.inputs[0])
    tree.links.new(reroute.outputs[0], group.inputs[0])
    finish(tree, group)
    converted, report = convert(material)
    assert converted.diffuse == pytest.approx(RED[:3])
    assert features(report, "exact") == ["Shader"]


def test_unlinked_group_input_uses_the_groups_value(convert) -> None:
    inner = bpy.data.node_groups.new("Group", "ShaderNodeTree")
    inner.interface.new_socket("Paint", in_out="INPUT", socket_type="NodeSocketColor")
    inner.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    entrance, exit_ = (inner.nodes.new(f"NodeGroup{end}") for end in ("Input", "Output"))
    shader = add_node(inner, DIFFUSE, Color=entrance.outputs[0])
    inner.links.new(shader.outputs[0], exit_.inputs[0])
    material, tree = new_material()
    group = tree.nodes.new("ShaderNodeGroup")
    group.node_tree = inner
    group.inputs[0].default_value = RED
    finish(tree, group)
    assert convert(material)[0].diffuse == pytest.approx(RED[:3])


def test_image_texture_is_averaged_in_linear_light(convert) -> None:
    image = bpy.data.images.new("Chequer", 2, 1)
    image.pixels.foreach_set(np.array([1, 1, 1, 1, 0, 0, 0, 1], np.float32))
    material, tree = new_material()
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image = image
    finish(tree, add_node(tree, DIFFUSE, Color=texture.outputs["Color"]))
    converted, report = convert(material)
    assert converted.diffuse == pytest.approx((0.5,) * 3, abs=1e-3)
    (entry,) = [e for e in report.of("approximated") if e.object == "Material 'Material'"]
    assert "Chequer" in entry.detail


def absent(case: str, folder: Path, user: bpy.types.ImageUser) -> tuple[bpy.types.Image, str]:
    """An image that is missing, and the file that was looked for."""
    real = bpy.data.images.new("First", 4, 4)
    real.filepath_raw, real.file_format = str(folder / "wood0001.png"), "PNG"
    real.save()
    image = bpy.data.images.load(real.filepath_raw)
    image.name = "Wood"
    image.source = {"sequence": "SEQUENCE", "movie": "MOVIE", "tiles": "TILED"}.get(case, "FILE")
    path = folder / "nowhere" / "wood.png"
    match case:
        case "sequence":
            user.frame_duration, user.use_auto_refresh = 20, True
            bpy.context.scene.frame_set(7)
            return image, str(folder / "wood0007.png")
        case "relative":
            bpy.ops.wm.save_as_mainfile(filepath=str(folder / "scene.blend"))
            image.filepath = "//nowhere/wood.png"
            return image, str(path)
        case "tiles":
            path = folder / "wood.<UDIM>.png"
        case "unreadable":
            path = folder / "wood.png"
            path.write_text("no picture")
    image.filepath = str(path)
    image.reload()
    return image, str(path).replace("<UDIM>", "1001")


@pytest.mark.parametrize(
    "case", ["file", "relative", "unreadable", "sequence", "movie", "tiles", "none"]
)
def test_missing_image_is_magenta_as_in_cycles(convert, scene, cycles, tmp_path, case) -> None:
    """Named with the file that is not there; its Alpha is opaque."""
    material, tree = new_material()
    texture = tree.nodes.new("ShaderNodeTexImage")
    said = "no image is chosen"
    if case != "none":
        texture.image, path = absent(case, tmp_path, texture.image_user)
        said = f"image 'Wood' is missing ({path})"
    diffuse = add_node(tree, DIFFUSE, Color=texture.outputs["Color"])
    diffuse.inputs["Roughness"].default_value = 0.5
    tree.links.new(texture.outputs["Alpha"], diffuse.inputs["Roughness"])
    finish(tree, diffuse)
    converted, report = convert(material)
    assert converted.diffuse == (1.0, 0.0, 1.0)
    details = [entry.detail for entry in report.of("approximated")]
    assert f"{said}: magenta (1, 0, 1) is used" in details
    assert f"{said}: opaque 1 is used" in details
    finish(tree, add_node(tree, "ShaderNodeEmission", Color=texture.outputs["Color"]))
    scene.camera.data.type, scene.camera.data.ortho_scale = "ORTHO", 1.0
    assert (cycles() == (1.0, 0.0, 1.0, 1.0)).all()


def test_sequence_whose_file_is_there_is_not_missing(convert, tmp_path) -> None:
    material, tree = new_material()
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image, _ = absent("sequence", tmp_path, texture.image_user)
    bpy.context.scene.frame_set(1)
    diffuse = add_node(tree, DIFFUSE, Color=RED)
    tree.links.new(texture.outputs["Color"], diffuse.inputs["Color"])
    finish(tree, diffuse)
    converted, report = convert(material)
    assert converted.diffuse == pytest.approx(RED[:3])
    assert not any("missing" in entry.detail for entry in report.entries)


def test_other_textures_use_the_sockets_value(convert) -> None:
    material, tree = new_material()
    noise = tree.nodes.new("ShaderNodeTexNoise")
    diffuse = add_node(tree, DIFFUSE, Color=RED)
    tree.links.new(noise.outputs[1], diffuse.inputs["Color"])
    finish(tree, diffuse)
    converted, report = convert(material)
    assert converted.diffuse == pytest.approx(RED[:3])
    (entry,) = [e for e in report.of("approximated") if e.object == "Material 'Material'"]
    assert "0.8, 0.2, 0.1" in entry.detail


@pytest.mark.parametrize(
    ("kind", "status"),
    [
        ("ShaderNodeEmission", "ignored"),
        ("ShaderNodeBsdfRefraction", "ignored"),
        ("ShaderNodeBsdfGlass", "approximated"),
        ("ShaderNodeBsdfTranslucent", "approximated"),
        ("ShaderNodeSubsurfaceScattering", "approximated"),
    ],
)
def test_unknown_shaders_are_named(convert, kind, status) -> None:
    assert features(convert(shader_material(kind))[1], status)


def test_unlinked_surface_is_black_with_a_word(convert) -> None:
    converted, report = convert(new_material()[0])
    assert converted.diffuse == (0.0, 0.0, 0.0)
    assert features(report, "approximated") == ["Surface"]


def test_volumes_and_transparent_surfaces_are_left_out(export) -> None:
    smoke, tree = new_material("Smoke")
    output = tree.nodes[0]
    volume = tree.nodes.new("ShaderNodeVolumePrincipled")
    tree.links.new(volume.outputs[0], output.inputs["Volume"])
    add_mesh("Cloud").data.materials.append(smoke)
    add_mesh("Pane").data.materials.append(shader_material("ShaderNodeBsdfTransparent", "Clear"))
    add_mesh("Floor")
    scene, report = export()
    assert set(scene.surface) == {scene.surfaces.index("Floor")}
    assert features(report, "ignored") == ["Volume", "No surface", "No surface"]


@pytest.mark.skipif(bpy.app.version >= (5, 0), reason="materials always have nodes")
def test_without_nodes_the_viewport_colour_counts(convert) -> None:
    material = bpy.data.materials.new("Plain")
    material.diffuse_color = RED
    converted, report = convert(material)
    assert converted.diffuse == pytest.approx(RED[:3])
    assert features(report, "exact") == ["Viewport colour", "Shader"]


@pytest.mark.parametrize("output", [None, "EEVEE"])
def test_without_material_output_is_black_as_in_cycles(convert, scene, cycles, output) -> None:
    """Whatever its viewport colour, and though an output serves another renderer."""
    material, tree = new_material("Bare")
    material.diffuse_color = RED
    finish(tree, add_node(tree, "ShaderNodeEmission", Color=RED))
    if output:
        tree.nodes[0].target = output
    else:
        tree.nodes.clear()
    converted, report = convert(material)
    assert (converted.diffuse, converted.specular) == ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    assert "No Material Output" in features(report, "exact")
    scene.camera.data.type, scene.camera.data.ortho_scale = "ORTHO", 1.0
    assert (cycles() == (0.0, 0.0, 0.0, 1.0)).all()  # opaque


def test_of_two_outputs_that_of_cycles_counts(convert, scene, cycles) -> None:
    """Before one for all renderers, though that is the active one."""
    material, tree = new_material()
    finish(tree, add_node(tree, DIFFUSE, Color=(0.1, 0.1, 0.1, 1.0)))
    own = tree.nodes.new("ShaderNodeOutputMaterial")
    own.target, own.is_active_output = "CYCLES", False
    tree.nodes[0].is_active_output = True
    shader = add_node(tree, "ShaderNodeEmission", Color=RED)
    tree.links.new(shader.outputs[0], own.inputs["Surface"])
    converted, report = convert(material)
    assert converted.diffuse == (0.0, 0.0, 0.0)
    assert features(report, "ignored") == ["Emission 'Emission'"]
    scene.camera.data.type, scene.camera.data.ortho_scale = "ORTHO", 1.0
    np.testing.assert_allclose(cycles()[0, 0], RED, rtol=1e-4)


@pytest.mark.stability(29)
@pytest.mark.parametrize(("value", "expected"), [(1.5, 1.0), (-0.25, 0.0), (math.nan, 0.0)])
def test_impossible_colours_are_clamped_and_named(convert, value, expected) -> None:
    material, tree = new_material("Paint")
    constant = tree.nodes.new("ShaderNodeValue")  # its range is not limited as a colour's is
    constant.outputs[0].default_value = value
    finish(tree, add_node(tree, DIFFUSE, Color=constant.outputs[0]))
    converted, report = convert(material)
    assert converted.diffuse == pytest.approx((expected,) * 3)
    (entry,) = [e for e in report.of("approximated") if e.object == "Material 'Paint'"]
    assert entry.feature == "Diffuse colour" and f"{value:g}" in entry.detail


def test_too_bright_sums_are_scaled_and_named(convert) -> None:
    material, tree = new_material()
    add = tree.nodes.new("ShaderNodeAddShader")
    shaders = (add_node(tree, DIFFUSE, Color=(0.9, 0.3, 0.3, 1)), add_node(tree, GLOSSY))
    shaders[1].inputs["Color"].default_value = (0.6, 0.6, 0.6, 1)
    shaders[1].inputs["Roughness"].default_value = 0.0
    for shader, socket in zip(shaders, add.inputs, strict=True):
        tree.links.new(shader.outputs[0], socket)
    finish(tree, add)
    converted, report = convert(material)
    assert converted.diffuse == pytest.approx((0.6, 0.3, 0.3))
    assert converted.specular == pytest.approx((0.4, 0.6, 0.6))
    assert features(report, "approximated") == ["Albedo above 1"]
