# SPDX-License-Identifier: GPL-3.0-or-later
"""What geometry nodes, particles and other instancers tell of instances, against Cycles."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

from tests.measure import render

from .build import CUBE, add_mesh, add_node, finish, new_material, new_mesh

pytestmark = pytest.mark.blender

SIZE = 32  # [px]


def attribute_material(name: str) -> bpy.types.Material:
    """Glows as an attribute of its instancer says."""
    material, tree = new_material()
    node = add_node(tree, "ShaderNodeAttribute")
    node.attribute_name, node.attribute_type = name, "INSTANCER"
    finish(tree, add_node(tree, "ShaderNodeEmission", Color=node.outputs["Color"]))
    return material


def instanced(what: bpy.types.ID, kind: str, modified: bpy.types.Object) -> None:
    """Instances of an object, a collection, or an object's geometry on the vertices of another,
    each with an attribute "tint" of its own."""
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
    source = info.outputs["Instances" if is_collection else "Geometry"]
    for output, socket in (
        (start.outputs[0], on_points.inputs["Points"]),
        (source, on_points.inputs["Instance"]),
        (on_points.outputs[0], store.inputs["Geometry"]),
        (random.outputs[0], store.inputs["Value"]),
        (store.outputs[0], end.inputs[0]),
    ):
        tree.links.new(output, socket)
    modified.modifiers.new("Scatter", "NODES").node_group = tree


@pytest.mark.parametrize("kind", ["object", "collection", "geometry"])
def test_attributes_of_instances(export, cycles, device, kind) -> None:
    if kind != "geometry" and not hasattr(bpy.types.Object, "evaluated_geometry"):
        pytest.skip("Blender 5.0 on")
    collection = bpy.data.collections.new("Part")
    part = bpy.data.objects.new("Part", new_mesh("Part", CUBE))
    part.scale = (0.4, 0.4, 0.4)
    part.data.materials.append(attribute_material("tint"))
    collection.objects.link(part)
    instanced(collection if kind == "collection" else part, kind, add_mesh("Points"))
    scene = bpy.context.scene
    scene.camera.location.z, scene.camera.data.lens = 5.0, 40.0
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    ours = render(device, export()[0], width=SIZE, height=SIZE, passes=4, photons=0)
    shown = cycles()[..., :3]
    assert len(np.unique(shown.round(3).reshape(-1, 3), axis=0)) >= 4
    assert np.abs(ours["Combined"][..., :3] - shown).mean() < 0.12 * shown.mean()  # edges
