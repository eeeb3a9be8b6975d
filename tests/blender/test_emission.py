# SPDX-License-Identifier: GPL-3.0-or-later
"""Emission nodes and Principled's emission become a material's radiance."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

from addon.blender.export import SpecularModel
from tests.measure import render
from tests.regression.blocks import block_means
from tests.regression.cycles import render_loaded

from .build import CUBE, add_mesh, add_node, features, finish, new_material, shader_material
from .lobes import BLACK, DIFFUSE, PRINCIPLED, near

pytestmark = pytest.mark.blender

EMISSION, BACKGROUND = "ShaderNodeEmission", "ShaderNodeBackground"
WARM = (1.0, 0.5, 0.25, 1.0)


@pytest.mark.parametrize("kind", [EMISSION, BACKGROUND])
@pytest.mark.parametrize(("strength", "expected"), [(3.0, (3.0, 1.5, 0.75)), (-1.0, BLACK)])
def test_emission(convert, kind, strength, expected) -> None:
    """A Background of a surface is as Cycles has it, too. Light that would be negative is named."""
    material = shader_material(kind, Color=WARM, Strength=strength)
    converted, report = convert(material)
    assert converted.emission == near(expected)
    assert converted.diffuse == BLACK and not converted.lobes
    told = [] if strength > 0.0 else ["Negative light"]
    assert features(report, "approximated") == told
    assert features(report, "exact") == ["Shader"] * (not told)


@pytest.mark.parametrize("metallic", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("model", SpecularModel)
def test_principled(convert, metallic, model) -> None:
    """Whatever it reflects."""
    given = {"Emission_Color": WARM, "Emission_Strength": 2.0, "Metallic": metallic}
    material = shader_material(PRINCIPLED, **given)
    converted, _ = convert(material, model)
    bpy.data.objects.remove(bpy.data.objects["Plane"])
    node = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    node.inputs["Emission Strength"].default_value = 0.0
    bare, _ = convert(material, model)
    assert converted.emission == near((2.0, 1.0, 0.5)) and bare.emission == BLACK
    assert (converted.diffuse, converted.lobes) == (bare.diffuse, bare.lobes)


@pytest.mark.parametrize(
    ("joint", "factor", "share"),
    [
        ("ShaderNodeMixShader", 0.25, 0.75),
        ("ShaderNodeMixShader", 1.0, 0.0),
        ("ShaderNodeAddShader", None, 1.0),
    ],
)
def test_mixed(convert, joint, factor, share) -> None:
    material, tree = new_material()
    both = tree.nodes.new(joint)
    if factor is not None:
        both.inputs["Fac"].default_value = factor
    sockets = list(both.inputs)[-2:]
    emission = add_node(tree, EMISSION, Color=WARM, Strength=4.0)
    tree.links.new(emission.outputs[0], sockets[0])
    grey = add_node(tree, DIFFUSE, Color=(0.5, 0.5, 0.5, 1.0))
    tree.links.new(grey.outputs[0], sockets[1])
    finish(tree, both)
    converted, _ = convert(material)
    assert converted.emission == near(tuple(share * np.array((4.0, 2.0, 1.0))))
    assert converted.diffuse == near((0.5 if factor is None else 0.5 * factor,) * 3)


def test_each_instance_emits(export, scene) -> None:
    """Where it is."""
    cube = add_mesh("Cube", CUBE)
    cube.data.materials.append(shader_material(EMISSION, Strength=1.0))
    copy = bpy.data.objects.new("Copy", cube.data)
    copy.location = (5, 0, 0)
    scene.collection.objects.link(copy)
    exported, _ = export()
    emissive = np.array([m.is_emissive for m in exported.materials])[exported.material]
    assert emissive.all() and len(emissive) == 24
    assert np.ptp(exported.vertices[exported.triangles].mean(axis=(0, 1))[:1]) == 0
    assert exported.vertices[:, 0].max() == pytest.approx(6.0)


@pytest.mark.parametrize(
    ("other", "ray", "named"),
    [
        ("ShaderNodeBsdfGlass", None, ["Emission of glass"]),
        (DIFFUSE, "Is Camera Ray", []),
        (DIFFUSE, "Is Glossy Ray", ["Emission by Light Path"]),
        (DIFFUSE, "Ray Length", ["Emission by distance"]),
    ],
)
def test_what_emits_otherwise_than_in_cycles_is_named(convert, other, ray, named) -> None:
    material, tree = new_material()
    both = tree.nodes.new("ShaderNodeMixShader")
    if ray:
        path = tree.nodes.new("ShaderNodeLightPath")
        tree.links.new(path.outputs[ray], both.inputs[0])
    for kind, socket in ((other, both.inputs[1]), (EMISSION, both.inputs[2])):
        tree.links.new(add_node(tree, kind).outputs[0], socket)
    finish(tree, both)
    assert features(convert(material)[1], "approximated") == named


@pytest.mark.parametrize(("output", "named"), [("Quadratic", []), ("Linear", ["by distance"])])
def test_falloff_of_what_emits_is_named(convert, output, named) -> None:
    material, tree = new_material()
    falloff = add_node(tree, "ShaderNodeLightFalloff", Strength=3.0)
    finish(tree, add_node(tree, EMISSION, Strength=falloff.outputs[output]))
    found = features(convert(material)[1], "approximated")
    assert found == [f"Emission {name}" for name in named]


def test_textured_emission_is_named(convert) -> None:
    """Of its place on a triangle a light knows the cell."""
    material, tree = new_material()
    noise = tree.nodes.new("ShaderNodeTexNoise")
    finish(tree, add_node(tree, EMISSION, Color=noise.outputs["Color"]))
    assert features(convert(material)[1], "approximated") == ["Emission by nodes"]


def one_side(tree: bpy.types.NodeTree) -> bpy.types.NodeSocket:
    return add_node(tree, "ShaderNodeNewGeometry").outputs["Backfacing"]


def by_facing(tree: bpy.types.NodeTree) -> bpy.types.NodeSocket:
    return add_node(tree, "ShaderNodeLayerWeight", Blend=0.7).outputs["Facing"]


def by_place(tree: bpy.types.NodeTree) -> bpy.types.NodeSocket:
    place = add_node(tree, "ShaderNodeTexCoord").outputs["Object"]
    ball = add_node(tree, "ShaderNodeTexGradient", Vector=place)
    ball.gradient_type = "SPHERICAL"
    return ball.outputs["Color"]


@pytest.mark.thorough("by_place")
@pytest.mark.parametrize("by", [one_side, by_facing, by_place])
def test_panels_light_as_in_cycles(scene, export, device, by) -> None:
    """A floor on both sides of one: the side, the angle and the place tell how much it emits."""
    scene.render.resolution_x = scene.render.resolution_y = 48
    floor = add_mesh("Plane", scale=(4, 4, 1))
    floor.data.materials.append(shader_material(DIFFUSE, Color=(0.7, 0.7, 0.7, 1)))
    panel = add_mesh("Panel", location=(0, 0, 0.8), rotation_euler=(1.3, 0, 0.2))
    material, tree = new_material()
    finish(tree, add_node(tree, EMISSION, Color=WARM, Strength=by(tree)))
    panel.data.materials.append(material)
    exported, _ = export()
    theirs = block_means(render_loaded(256, seed=1))
    size = {"width": 48, "height": 48, "passes": 32}
    rays = render(device, exported, photons=1000, **size)["Combined"]
    landed = render(device, exported, photons=50000, direct_by_photons=True, **size)["Combined"]
    for ours in (rays, landed):
        off = np.abs(block_means(ours[..., :3]) - theirs) / np.maximum(theirs, theirs.mean())
        assert np.median(off) < 0.015 and np.percentile(off, 95) < 0.05
        assert ours[..., :3].mean() == pytest.approx(theirs.mean(), rel=0.01)
