# SPDX-License-Identifier: GPL-3.0-or-later
"""Small pieces of Blender scenes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import bpy

from addon.blender.export import Report

QUAD = ([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], [(0, 1, 2, 3)])
CUBE = (
    [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)],
    [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)],
)


def add_object(name: str, data: bpy.types.ID | None, **properties: Any) -> bpy.types.Object:
    """Link a new object to the scene and set its properties."""
    obj = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(obj)
    for key, value in properties.items():
        setattr(obj, key, value)
    return obj


def new_mesh(name: str, shape: tuple[Sequence, Sequence] = QUAD) -> bpy.types.Mesh:
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(shape[0], [], shape[1])
    return mesh


def add_mesh(name: str, shape: tuple[Sequence, Sequence] = QUAD, **properties: Any):
    return add_object(name, new_mesh(name, shape), **properties)


def add_light(name: str, kind: str, **properties: Any) -> bpy.types.Object:
    """Add a light; properties of the light and of the object may be mixed."""
    light = bpy.data.lights.new(name, kind)
    obj = add_object(name, light)
    for key, value in properties.items():
        setattr(light if hasattr(light, key) else obj, key, value)
    return obj


def nodes_of(data: Any) -> bpy.types.NodeTree:
    """The node tree of a material, a world or a light: older Blenders make it when they are asked
    to use nodes, which later ones deprecate."""
    if not data.node_tree:
        data.use_nodes = True
    return data.node_tree


def new_material(name: str = "Material") -> tuple[bpy.types.Material, bpy.types.NodeTree]:
    """Return a material whose node tree holds nothing but an output."""
    material = bpy.data.materials.new(name)
    tree = nodes_of(material)
    tree.nodes.clear()
    tree.nodes.new("ShaderNodeOutputMaterial")
    return material, tree


def add_node(tree: bpy.types.NodeTree, kind: str, **inputs: Any) -> bpy.types.Node:
    """Add a node; inputs are named as in Blender, with _ for spaces: numbers or output sockets."""
    node = tree.nodes.new(kind)
    for key, value in inputs.items():
        socket = node.inputs[key.replace("_", " ")]
        if isinstance(value, bpy.types.NodeSocket):
            tree.links.new(value, socket)
        else:
            socket.default_value = value
    return node


def finish(tree: bpy.types.NodeTree, shader: bpy.types.Node, end: str = "Surface") -> None:
    """Link a shader to an end of the output."""
    output = next(node for node in tree.nodes if node.type.startswith("OUTPUT_"))
    tree.links.new(shader.outputs[0], output.inputs[end])


def new_world(scene: bpy.types.Scene) -> bpy.types.NodeTree:
    """Give the scene a world whose node tree holds nothing but an output."""
    world = scene.world = bpy.data.worlds.new("World")
    tree = nodes_of(world)
    tree.nodes.clear()
    tree.nodes.new("ShaderNodeOutputWorld")
    return tree


def long_paths(scene: bpy.types.Scene) -> None:
    """Let Cycles follow 32 bounces of every kind, blur none, and filter pixels by boxes."""
    scene.cycles.pixel_filter_type, scene.cycles.max_bounces = "BOX", 32
    for kind in ("diffuse", "glossy", "transmission"):
        setattr(scene.cycles, f"{kind}_bounces", 32)
    scene.cycles.blur_glossy = 0.0


def shader_material(kind: str, name: str = "Material", **inputs: Any) -> bpy.types.Material:
    """Return a material of one shader node."""
    material, tree = new_material(name)
    finish(tree, add_node(tree, kind, **inputs))
    return material


def features(report: Report, status: str) -> list[str]:
    """What a report says of materials."""
    return [entry.feature for entry in report.of(status) if entry.object.startswith("Material")]


def gone() -> bpy.types.Image:
    """An image whose file is not there."""
    image = bpy.data.images.new("Gone", 4, 4)
    image.source, image.filepath = "FILE", "//gone.png"
    return image


def unknown_lens(data: bpy.types.Camera) -> None:
    """A panorama of a kind that we do not render."""
    data.type = "PANO"
    where = data if hasattr(data, "panorama_type") else data.cycles
    where.panorama_type = "FISHEYE_LENS_POLYNOMIAL"
