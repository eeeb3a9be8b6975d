# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair and point clouds, for which triangles stand, against Cycles."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

from addon.blender.export.strands import balls, tubes
from tests.measure import render
from tests.regression.blocks import block_means

from .build import add_light, add_mesh, add_node, add_object, finish, new_material, shader_material

pytestmark = pytest.mark.blender

DIFFUSE, EMISSION = "ShaderNodeBsdfDiffuse", "ShaderNodeEmission"
SIZE = 64  # [px]


def hair() -> bpy.types.Object:
    """Waves of hair, thinner at their tips."""
    data = bpy.data.hair_curves.new("Hair")
    data.add_curves([6] * 30)
    x, y = np.random.default_rng(1).uniform(-1.0, 1.0, (2, 30, 1))
    along = np.arange(6)
    places = np.stack(
        np.broadcast_arrays(
            x + 0.15 * np.sin(0.9 * along + 3.0 * y), y + 0.08 * along, 0.2 * along
        ),
        axis=2,
    )
    data.attributes["position"].data.foreach_set("vector", places.astype(np.float32).ravel())
    radius = data.attributes.get("radius") or data.attributes.new("radius", "FLOAT", "POINT")
    radius.data.foreach_set("value", np.tile(np.linspace(0.08, 0.03, 6), 30).astype(np.float32))
    tint = data.attributes.new("tint", "FLOAT_COLOR", "CURVE")
    tint.data.foreach_set("color", np.random.default_rng(5).random((30, 4)).ravel())
    return add_object("Hair", data)


def cloud() -> bpy.types.Object:
    """Balls of several sizes."""
    places = np.random.default_rng(2).uniform(-1.0, 1.0, (40, 3))
    obj = add_mesh("Cloud", (places.tolist(), []))
    bpy.context.view_layer.objects.active = obj
    obj.select_set(True)
    bpy.ops.object.convert(target="POINTCLOUD")
    data = bpy.context.object.data
    radius = data.attributes.get("radius") or data.attributes.new("radius", "FLOAT", "POINT")
    radius.data.foreach_set("value", np.linspace(0.05, 0.2, 40).astype(np.float32))
    tint = data.attributes.new("tint", "FLOAT_COLOR", "POINT")
    tint.data.foreach_set("color", np.random.default_rng(6).random((40, 4)).ravel())
    return bpy.context.object


def particles(**settings: object) -> bpy.types.Object:
    """Hair that grows on a plane, by a particle system; the emitter is not rendered."""
    obj = add_mesh("Skin", location=(0.0, 0.0, 0.1))
    uv = obj.data.uv_layers.new(name="tint")
    uv.uv.foreach_set("vector", (0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 1.0))
    for layer in ("other", "shade"):
        shade = obj.data.color_attributes.new(layer, "BYTE_COLOR", "CORNER")
        colours = np.random.default_rng(8).random(16).astype(np.float32)
        shade.data.foreach_set("color", colours if layer == "shade" else 0.0 * colours)
    obj.show_instancer_for_render = False
    obj.modifiers.new("Hair", "PARTICLE_SYSTEM")
    hair = obj.particle_systems[0].settings
    hair.type, hair.count, hair.hair_length, hair.render_step = "HAIR", 40, 0.8, 3
    hair.root_radius, hair.tip_radius, hair.radius_scale, hair.shape = 1.0, 0.4, 0.1, 0.3
    hair.brownian_factor = 0.2
    for name, value in settings.items():
        setattr(hair, name, value)
    return obj


def children() -> bpy.types.Object:
    """Hair between hair, without its own."""
    return particles(child_type="SIMPLE", rendered_child_count=4, count=10, use_close_tip=True)


def asked(name: str, output: str = "Color", **properties: str) -> bpy.types.Material:
    """A material that emits what a node says."""
    material, tree = new_material(output)
    node = add_node(tree, name)
    for key, value in properties.items():
        setattr(node, key, value)
    finish(tree, add_node(tree, EMISSION, Color=node.outputs[output]))
    return material


@pytest.mark.parametrize(
    ("make", "median", "high"),
    [(hair, 0.03, 0.12), (cloud, 0.01, 0.05), (particles, 0.03, 0.12), (children, 0.03, 0.12)],
)
def test_as_cycles(export, cycles_mean, device, make, median, high) -> None:
    make().data.materials.append(shader_material(DIFFUSE, Color=(0.8, 0.6, 0.3, 1.0)))
    floor = add_mesh("Floor", location=(0.0, 0.0, -1.2), scale=(2.0, 2.0, 1.0))
    floor.data.materials.append(shader_material(DIFFUSE, Color=(0.3, 0.3, 0.3, 1.0)))
    add_light("Sun", "SUN", energy=3.0, angle=0.0, rotation_euler=(0.5, 0.4, 0.0))
    scene = bpy.context.scene
    scene.camera.location.z, scene.camera.data.lens = 4.5, 40.0
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    scene.cycles_curves.shape = "THICK"
    scene.cycles.max_bounces, scene.cycles.light_sampling_threshold = 0, 0.0
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BOX", 1.0
    exported, report = export()
    assert any("triangles stand for it" in entry.detail for entry in report.entries)
    ours = render(device, exported, width=SIZE, height=SIZE, passes=64, photons=0)
    means = [block_means(x) for x in (ours["Combined"][..., :3], cycles_mean(64, 0)[..., :3])]
    off = np.abs(means[0] - means[1]) / means[1]
    assert np.median(off) < median and np.percentile(off, 95) < high


@pytest.mark.parametrize(
    ("make", "node", "output"),
    [
        (hair, "Attribute", "Color"),
        (hair, "HairInfo", "Intercept"),
        (hair, "HairInfo", "Random"),
        (cloud, "Attribute", "Color"),
        (cloud, "PointInfo", "Position"),
        (cloud, "PointInfo", "Random"),
        (particles, "UVMap", "UV"),
        (particles, "TexCoord", "Generated"),
        (particles, "HairInfo", "Length"),
        (particles, "VertexColor", "Color"),
        (children, "VertexColor", "Color"),
    ],
)
def test_what_they_tell_is_cycles(export, cycles_mean, device, make, node, output) -> None:
    name = {"Attribute": {"attribute_name": "tint"}, "UVMap": {"uv_map": "tint"}}
    name = {**name, "VertexColor": {"layer_name": "shade"}}.get(node, {})
    make().data.materials.append(asked(f"ShaderNode{node}", output, **name))
    scene = bpy.context.scene
    scene.camera.location.z, scene.camera.data.lens = 4.5, 40.0
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    scene.cycles_curves.shape = "THICK"
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BOX", 1.0
    ours = render(device, export()[0], width=SIZE, height=SIZE, passes=16, photons=0)
    pictures = ours["Combined"], cycles_mean(16, 0).clip(0.0)  # here no emission is negative
    ours, cycles = (block_means(picture[..., :3]) for picture in pictures)
    assert cycles.max() > 0.05 and np.abs(ours - cycles).mean() < 0.05 * cycles.mean()


def test_balls_are_as_wide_as_spheres() -> None:
    """A convex body's mean projected area is a quarter of its own."""
    for count in (3, 30_000):
        made = balls(np.zeros((count, 3)), np.full(count, 0.5))
        vertices, normals, triangles = made.vertices, made.normals, made.triangles
        corners = vertices[triangles[: len(triangles) // count]]
        sides = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        assert np.linalg.norm(sides, axis=1).sum() / 8.0 == pytest.approx(np.pi * 0.25, rel=1e-4)
        assert ((sides * corners.mean(axis=1)).sum(axis=1) > 0.0).all()
        assert np.allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-5)


def test_curves_of_one_point_have_no_tube() -> None:
    points, radii = np.arange(12.0).reshape(4, 3), np.ones(4)
    assert not len(tubes(points, radii, np.arange(5, dtype=np.int32)).triangles)
    made = tubes(points, radii, np.array([0, 1, 4], np.int32))
    assert made.triangles.max() == len(made.vertices) - 1


def test_many_points_have_thinner_tubes() -> None:
    """Of three sides and no more pieces: six triangles between two points."""
    count = 100_002
    points = np.random.default_rng(3).random((count, 3))
    firsts = np.arange(0, count + 1, 3, dtype=np.int32)
    assert len(tubes(points, np.ones(count), firsts).triangles) == 6 * 2 * (count // 3)


def test_displacement_moves_no_strands(scene, export) -> None:
    """A material that moves its mesh leaves hair of the same material where it is, as in Cycles."""
    material = shader_material(DIFFUSE)
    material.displacement_method = "DISPLACEMENT"
    tree = material.node_tree
    move = add_node(tree, "ShaderNodeCombineXYZ", Z=1.0)
    output = next(node for node in tree.nodes if node.type == "OUTPUT_MATERIAL")
    tree.links.new(move.outputs[0], output.inputs["Displacement"])
    for obj in (hair(), add_mesh("Sheet")):
        obj.data.materials.append(material)
    found, _ = export()
    moves = {
        name: found.materials[found.material[found.surface == number][0]].displacement
        for number, name in enumerate(found.surfaces)
    }
    assert moves["Hair"] is None and moves["Sheet"].way == (0.0, 0.0, 1.0)


def test_strands_are_bent_where_they_are(scene, export) -> None:
    """What is displaced and bent asks where it was: of hair, where it is."""
    material = shader_material(DIFFUSE)
    material.displacement_method = "BOTH"
    tree = material.node_tree
    place = add_node(tree, "ShaderNodeTexCoord").outputs["Object"]
    noise = add_node(tree, "ShaderNodeTexNoise", Vector=place)
    move = add_node(tree, "ShaderNodeDisplacement", Height=noise.outputs[0])
    output = next(node for node in tree.nodes if node.type == "OUTPUT_MATERIAL")
    tree.links.new(move.outputs[0], output.inputs["Displacement"])
    hair().data.materials.append(material)
    found, _ = export()
    places = found.vertices[found.triangles]
    assert any(
        np.allclose(found.corner_attributes[:, i, :, :3], places, atol=1e-5)
        for i in range(found.corner_attributes.shape[1])
    )
