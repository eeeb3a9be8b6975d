# SPDX-License-Identifier: GPL-3.0-or-later
"""Node trees and outputs are followed to what a material reflects; what gets lost is reported."""

from __future__ import annotations

import math
from pathlib import Path

import bpy
import numpy as np
import pytest

from addon.blender.export import SpecularModel

from .build import add_mesh, add_node, features, finish, new_material, shader_material

pytestmark = pytest.mark.blender

RED = (0.8, 0.2, 0.1, 1.0)
DIFFUSE = "ShaderNodeBsdfDiffuse"
PRINCIPLED = "ShaderNodeBsdfPrincipled"


@pytest.mark.parametrize("model", SpecularModel)
def test_no_material_is_the_default_surface_of_cycles(convert, model) -> None:
    """Grey; from Blender 5.0 on a Principled BSDF of that base, roughness 0.5 and IOR 1.5."""
    material, report = convert(None, model)
    grey = (0.8, 0.8, 0.8)
    if model is SpecularModel.PHONG or bpy.app.version < (5, 0, 0):
        assert material.diffuse == grey and not material.lobes
    else:
        assert material.diffuse == (0.0, 0.0, 0.0)
        (lobe,) = material.lobes
        assert (lobe.kind, lobe.weight, lobe.covered) == ("ggx_dielectric", 1.0, grey)
        assert lobe.colour == pytest.approx((0.04,) * 3)
        microfacets = {"alpha_x": 0.25, "alpha_y": 0.25, "turn": 0.0, "compensated": 1.0}
        assert lobe.parameters == microfacets | {"ior": 1.5}
    assert [e.feature for e in report.of("exact") if e.object == "Object 'Plane'"] == [
        "No material"
    ]


def test_no_material_looks_as_the_default_shader(convert) -> None:
    """A Principled BSDF as Blender makes it, of the default surface's base."""
    if bpy.app.version < (5, 0, 0):
        pytest.skip("before Blender 5.0 the default surface is diffuse")
    default, _ = convert(None)
    bpy.data.objects.remove(bpy.data.objects["Plane"])
    material, _ = convert(shader_material(PRINCIPLED, Base_Color=(0.8, 0.8, 0.8, 1.0)))
    (lobe,), (expected,) = material.lobes, default.lobes
    assert lobe.parameters == pytest.approx(expected.parameters)
    assert (*lobe.colour, *lobe.covered) == pytest.approx((*expected.colour, *expected.covered))


def test_linked_factor_is_approximated(convert) -> None:
    material, tree = new_material()
    mix = tree.nodes.new("ShaderNodeMixShader")
    mix.inputs[0].default_value = 0.75
    profile = tree.nodes.new("ShaderNodeTexIES")
    tree.links.new(profile.outputs[0], mix.inputs[0])
    for index, level in ((1, 0.0), (2, 0.8)):
        shader = add_node(tree, DIFFUSE, Color=(level, level, level, 1))
        tree.links.new(shader.outputs[0], mix.inputs[index])
    finish(tree, mix)
    converted, report = convert(material)
    assert converted.diffuse == pytest.approx((0.6,) * 3)
    (entry,) = [e for e in report.of("approximated") if e.object == "Material 'Material'"]
    assert "IES Texture" in entry.feature and "0.75" in entry.detail


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
        tile = ", tile 1001," if case == "tiles" else ""
        said = f"image 'Wood'{tile} is missing ({path})"
    diffuse = add_node(tree, DIFFUSE, Color=texture.outputs["Color"])
    diffuse.inputs["Roughness"].default_value = 0.5
    tree.links.new(texture.outputs["Alpha"], diffuse.inputs["Roughness"])
    finish(tree, diffuse)
    converted, report = convert(material)
    (lobe,) = converted.lobes
    assert (lobe.colour, lobe.parameters) == ((1.0, 0.0, 1.0), {"diffuse_roughness": 1.0})
    details = [entry.detail for entry in report.of("approximated")]
    assert f"{said}: magenta" in details
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
    _, report = convert(material)
    assert not any("missing" in entry.detail for entry in report.entries)


def test_other_nodes_use_the_sockets_value(convert) -> None:
    material, tree = new_material()
    unknown = tree.nodes.new("ShaderNodeShaderToRGB")
    diffuse = add_node(tree, DIFFUSE, Color=RED)
    tree.links.new(unknown.outputs[0], diffuse.inputs["Color"])
    finish(tree, diffuse)
    converted, report = convert(material)
    assert converted.diffuse == pytest.approx(RED[:3])
    (entry,) = [e for e in report.of("approximated") if e.object == "Material 'Material'"]
    assert "0.8, 0.2, 0.1" in entry.detail


def test_unlinked_surface_is_black_with_a_word(convert) -> None:
    converted, report = convert(new_material()[0])
    assert converted.diffuse == (0.0, 0.0, 0.0)
    assert features(report, "approximated") == ["Surface"]


def test_clear_surfaces_without_volumes_are_left_out(export) -> None:
    smoke, tree = new_material("Smoke")
    noise = tree.nodes.new("ShaderNodeTexNoise")
    volume = add_node(tree, "ShaderNodeVolumePrincipled", Density=noise.outputs[0])
    finish(tree, volume, "Volume")
    add_mesh("Cloud").data.materials.append(smoke)
    add_mesh("Pane").data.materials.append(shader_material("ShaderNodeBsdfTransparent", "Clear"))
    add_mesh("Floor")
    scene, report = export()
    assert set(scene.surface) == {scene.surfaces.index(x) for x in ("Cloud", "Floor")}
    assert features(report, "ignored") == ["No surface"]


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
    assert (converted.diffuse, converted.lobes) == ((0.0, 0.0, 0.0), ())
    assert "No Material Output" in features(report, "exact")
    scene.camera.data.type, scene.camera.data.ortho_scale = "ORTHO", 1.0
    assert (cycles() == (0.0, 0.0, 0.0, 1.0)).all()  # opaque


@pytest.mark.parametrize("other", ["ALL", "EEVEE"])
def test_of_two_outputs_that_of_cycles_counts(convert, scene, cycles, other) -> None:
    """Before one for all renderers or another one, though that is the active one."""
    material, tree = new_material()
    finish(tree, add_node(tree, DIFFUSE, Color=(0.1, 0.1, 0.1, 1.0)))
    tree.nodes[0].target = other
    own = tree.nodes.new("ShaderNodeOutputMaterial")
    own.target, own.is_active_output = "CYCLES", False
    tree.nodes[0].is_active_output = True
    shader = add_node(tree, "ShaderNodeEmission", Color=RED)
    tree.links.new(shader.outputs[0], own.inputs["Surface"])
    converted, report = convert(material)
    assert converted.diffuse == (0.0, 0.0, 0.0)
    assert converted.emission == pytest.approx(RED[:3])
    assert features(report, "exact") == ["Shader"]
    assert len(bpy.data.materials) == 1 and tree.nodes[0].target == other
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
    wanted = ("Color", "not a number") if math.isnan(value) else ("Diffuse colour", f"{value:g}")
    assert entry.feature == wanted[0] and wanted[1] in entry.detail
