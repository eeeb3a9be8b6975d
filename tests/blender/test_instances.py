# SPDX-License-Identifier: GPL-3.0-or-later
"""What geometry nodes, particles and other instancers tell of instances, against Cycles."""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np
import pytest

from tests.measure import render
from tests.regression.blocks import block_means

from .build import CUBE, add_mesh, add_node, finish, new_material, new_mesh

pytestmark = pytest.mark.blender

SIZE = 64  # [px]
FACES = [(0, 1, 4, 3), (1, 2, 5, 4), (3, 4, 7, 6), (4, 5, 8, 7)]  # of three by three vertices


def instanced(
    what: bpy.types.ID, kind: str, modified: bpy.types.Object, ids: Sequence[int] = ()
) -> None:
    """Instances of an object, a collection, or an object's geometry on the vertices of another,
    each with an attribute "tint" of its own; the vertices may have ids."""
    if ids:
        of_points = modified.data.attributes.new("id", "INT", "POINT")
        of_points.data.foreach_set("value", np.array(ids, np.int32))
    tree = bpy.data.node_groups.new("Scatter", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    start, end = (tree.nodes.new(f"NodeGroup{way}") for way in ("Input", "Output"))
    is_collection = kind == "collection"
    node = "GeometryNodeCollectionInfo" if is_collection else "GeometryNodeObjectInfo"
    info = tree.nodes.new(node)
    info.inputs["Collection" if is_collection else "Object"].default_value = what
    if kind == "object":
        info.inputs["As Instance"].default_value = True
    on_points = tree.nodes.new("GeometryNodeInstanceOnPoints")
    store = tree.nodes.new("GeometryNodeStoreNamedAttribute")
    store.domain, store.data_type = "INSTANCE", "FLOAT_COLOR"
    store.inputs["Name"].default_value = "tint"
    random = tree.nodes.new("FunctionNodeRandomValue")
    random.data_type = "FLOAT_VECTOR"
    index = tree.nodes.new("GeometryNodeInputIndex")  # those of one id differ, too
    source = info.outputs["Instances" if is_collection else "Geometry"]
    for output, socket in (
        (start.outputs[0], on_points.inputs["Points"]),
        (source, on_points.inputs["Instance"]),
        (on_points.outputs[0], store.inputs["Geometry"]),
        (index.outputs[0], random.inputs["ID"]),
        (random.outputs[0], store.inputs["Value"]),
        (store.outputs[0], end.inputs[0]),
    ):
        tree.links.new(output, socket)
    modified.modifiers.new("Scatter", "NODES").node_group = tree


def emissive(kind: str, output: str, **properties: object) -> bpy.types.Material:
    """Emits what an output of a node says."""
    material, tree = new_material()
    node = add_node(tree, kind)
    for name, value in properties.items():
        setattr(node, name, value)
    more = add_node(tree, "ShaderNodeVectorMath")  # of what may be negative
    tree.links.new(node.outputs[output], more.inputs[0])
    more.inputs[1].default_value = (1.0, 1.0, 1.0)
    finish(tree, add_node(tree, "ShaderNodeEmission", Color=more.outputs[0]))
    return material


def compared(export, cycles_mean, device) -> None:
    """Our picture and Cycles', which must show something."""
    scene = bpy.context.scene
    scene.camera.location.z, scene.camera.data.lens = 5.0, 40.0
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BOX", 1.0
    exported, report = export()
    assert not report.of("ignored"), report.lines()
    ours = render(device, exported, width=SIZE, height=SIZE, passes=16, photons=0)
    shown = cycles_mean(16, 0).clip(0.0)
    ours, shown = (block_means(picture[..., :3]) for picture in (ours["Combined"], shown))
    assert len(np.unique(shown.round(3).reshape(-1, 3), axis=0)) >= 4
    assert np.abs(ours - shown).mean() < 0.06 * shown.mean()


@pytest.mark.parametrize(
    ("kind", "ids"),
    [
        ("object", ()),
        ("collection", ()),
        ("geometry", ()),
        ("geometry", (-7, 2000000000, 0, 3)),  # as where points are distributed on faces
        ("geometry", (5, 5, 1, 5)),  # as where geometries are joined
    ],
)
def test_attributes_of_instances(export, cycles_mean, device, kind, ids) -> None:
    if kind != "geometry" and not hasattr(bpy.types.Object, "evaluated_geometry"):
        pytest.skip("Blender 5.0 on")
    collection = bpy.data.collections.new("Part")
    part = bpy.data.objects.new("Part", new_mesh("Part", CUBE))
    part.scale = (0.4, 0.4, 0.4)
    node = "ShaderNodeAttribute"
    tint = emissive(node, "Color", attribute_name="tint", attribute_type="INSTANCER")
    part.data.materials.append(tint)
    collection.objects.link(part)
    instanced(collection if kind == "collection" else part, kind, add_mesh("Points"), ids)
    compared(export, cycles_mean, device)


@pytest.mark.parametrize("output", ["Random", "Age", "Size", "Location", "Velocity"])
def test_particles(export, cycles_mean, device, output) -> None:
    """Cubes that a plane emits, one frame after another."""
    part = add_mesh("Part", CUBE, location=(50.0, 0.0, 0.0))
    part.data.materials.append(emissive("ShaderNodeParticleInfo", output))
    emitter = add_mesh("Emitter")
    emitter.show_instancer_for_render = False
    emitter.modifiers.new("Emits", "PARTICLE_SYSTEM")
    settings = emitter.particle_systems[0].settings
    settings.count, settings.frame_start, settings.frame_end = 12, 1, 4
    settings.render_type, settings.instance_object = "OBJECT", part
    settings.particle_size, settings.size_random = 0.2, 0.5
    bpy.context.scene.frame_set(6)
    compared(export, cycles_mean, device)


@pytest.mark.parametrize("output", ["Random", "Size"])
def test_children_of_particles(export, cycles_mean, device, output) -> None:
    """Things in place of hair that has children, such as grass: no particle tells of those."""
    part = add_mesh("Part", CUBE, location=(50.0, 0.0, 0.0))
    part.data.materials.append(emissive("ShaderNodeParticleInfo", output))
    emitter = add_mesh("Emitter", scale=(0.7, 0.7, 0.7))
    emitter.modifiers.new("Grows", "PARTICLE_SYSTEM")
    settings = emitter.particle_systems[0].settings
    settings.type, settings.count, settings.hair_length = "HAIR", 8, 0.5
    settings.render_type, settings.instance_object = "OBJECT", part
    settings.child_type, settings.rendered_child_count = "SIMPLE", 3
    settings.particle_size = 0.15
    compared(export, cycles_mean, device)


@pytest.mark.parametrize(
    ("kind", "output"), [("TexCoord", "UV"), ("TexCoord", "Generated"), ("UVMap", "UV")]
)
def test_coordinates_of_the_instancer(export, cycles_mean, device, kind, output) -> None:
    material = emissive(f"ShaderNode{kind}", output, from_instancer=True)
    part = add_mesh("Part", CUBE, scale=(0.2, 0.2, 0.2))
    part.data.materials.append(material)
    whole = add_mesh("Whole", ([(x / 2, y / 2, 0) for y in (-2, 0, 2) for x in (-2, 0, 2)], FACES))
    layer = whole.data.uv_layers.new(name="UVMap")
    layer.uv.foreach_set("vector", np.random.default_rng(4).random(32))
    part.parent = whole
    whole.instance_type, whole.show_instancer_for_render = "FACES", False
    compared(export, cycles_mean, device)


@pytest.mark.parametrize(("domain", "kind"), [("POINT", "FLOAT2"), ("CORNER", "FLOAT_VECTOR")])
def test_a_uv_map_that_is_another_attribute(export, cycles_mean, device, domain, kind) -> None:
    """As geometry nodes may store it: by its name Cycles finds it all the same."""
    whole = add_mesh("Whole", ([(x / 2, y / 2, 0) for y in (-2, 0, 2) for x in (-2, 0, 2)], FACES))
    given = whole.data.attributes.new("Stored", kind, domain)
    numbers = np.random.default_rng(4).random(len(given.data) * (2 if kind == "FLOAT2" else 3))
    given.data.foreach_set("vector", numbers.astype(np.float32))
    whole.data.materials.append(emissive("ShaderNodeUVMap", "UV", uv_map="Stored"))
    compared(export, cycles_mean, device)
