# SPDX-License-Identifier: GPL-3.0-or-later
"""Worlds against Cycles: seen, mirrored and lighting, as a ball that does both shows them."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

from addon.blender.export import snapshot
from addon.streams import Device
from tests.blender.build import add_node, add_object, finish, new_world, shader_material
from tests.measure import render

from .blocks import Difference, block_means, compare
from .cycles import render_loaded

pytestmark = pytest.mark.blender

MEDIAN, HIGH = 0.01, 0.03  # relative, of blocks; HIGH at their 95th percentile
SIZE = 64  # [px]
PASSES = 256
DARK = 1e-2  # of the mean: a single bright pixel is more than such ground
TURN = (0.3, -0.5, 1.1)

Tree = Any
Graph = Callable[[Tree, Path], Any]  # makes the world's nodes, and returns the last one


def blobs(width: int, height: int) -> Any:
    """Even enough for a picture of few passes, and unlike itself turned or mirrored."""
    at = np.random.default_rng(5).normal(size=(6, 3))
    up = np.pi * ((np.arange(height) + 0.5) / height - 0.5)[:, None]
    around = 2 * np.pi * (0.5 - (np.arange(width) + 0.5) / width)
    across = np.cos(up)
    shape = (height, width)
    towards = np.stack(
        [across * np.cos(around), across * np.sin(around), np.broadcast_to(np.sin(up), shape)], -1
    )
    colours = np.random.default_rng(6).random((6, 4))
    lit = np.exp(4 * (towards @ (at / np.linalg.norm(at, axis=1, keepdims=True)).T - 1))
    pixels = 0.1 + lit @ colours
    pixels[..., 3] = 1.0
    return pixels.astype(np.float32)


def image_of(folder: Path, kind: str = "exr", width: int = 64, height: int = 32) -> Any:
    """In a file."""
    image = bpy.data.images.new("Blobs", width, height, float_buffer=kind == "exr")
    image.pixels.foreach_set((blobs(width, height) * (1.0 if kind == "exr" else 0.5)).ravel())
    path = folder / f"blobs.{kind}"
    image.filepath_raw, image.file_format = str(path), {"exr": "OPEN_EXR", "png": "PNG"}[kind]
    image.save()
    bpy.data.images.remove(image)
    return bpy.data.images.load(str(path))


def texture(tree: Tree, image: Any, **mapping: Any) -> Any:
    """An Environment Texture; turned by a Mapping node if that is given its inputs."""
    node = tree.nodes.new("ShaderNodeTexEnvironment")
    node.image = image
    if mapping:
        coordinates = tree.nodes.new("ShaderNodeTexCoord")
        moved = add_node(
            tree, "ShaderNodeMapping", Vector=coordinates.outputs["Generated"], **mapping
        )
        tree.links.new(moved.outputs[0], node.inputs["Vector"])
    return node


def background(tree: Tree, colour: Any, strength: float = 1.0) -> Any:
    if isinstance(colour, bpy.types.Node):
        colour = colour.outputs[0]
    return add_node(tree, "ShaderNodeBackground", Color=colour, Strength=strength)


def turned(tree: Tree, folder: Path) -> Any:
    return background(tree, texture(tree, image_of(folder), Rotation=TURN), 0.7)


def turned_back_bytes(tree: Tree, folder: Path) -> Any:
    node = texture(tree, image_of(folder, "png"), Rotation=TURN)
    tree.nodes["Mapping"].vector_type = "TEXTURE"
    return background(tree, node, 2.0)


def mirrored(tree: Tree, folder: Path) -> Any:
    image = image_of(folder)
    image.pack()
    return background(tree, texture(tree, image, Rotation=TURN, Scale=(-2.0, 2.0, 2.0)))


def moved(tree: Tree, folder: Path) -> Any:
    """No turn alone: Blender evaluates it."""
    return background(tree, texture(tree, image_of(folder), Location=(0.2, 0.1, 0.6)))


def mirror_ball(tree: Tree, folder: Path) -> Any:
    image = image_of(folder, width=64, height=64)
    image.pack()
    node = texture(tree, image, Rotation=TURN)
    node.projection = "MIRROR_BALL"
    return background(tree, node)


def other_hue(tree: Tree, folder: Path) -> Any:
    image = bpy.data.images.new("Made", 64, 32, float_buffer=True)
    image.pixels.foreach_set(blobs(64, 32).ravel())
    node = texture(tree, image)
    hue = add_node(tree, "ShaderNodeHueSaturation", Hue=0.8, Color=node.outputs[0])
    return background(tree, hue)


def for_the_camera(tree: Tree, folder: Path) -> Any:
    """Another world than what lights."""
    path = tree.nodes.new("ShaderNodeLightPath")
    shaders = (
        background(tree, texture(tree, image_of(folder), Rotation=TURN)),
        background(tree, (0.2, 0.6, 0.1, 1.0)),
    )
    mix = add_node(tree, "ShaderNodeMixShader", Fac=path.outputs["Is Camera Ray"])
    for socket, shader in zip(mix.inputs[1:], shaders, strict=True):
        tree.links.new(shader.outputs[0], socket)
    return mix


def mixed_by_height(tree: Tree, folder: Path) -> Any:
    coordinates = tree.nodes.new("ShaderNodeTexCoord")
    apart = add_node(tree, "ShaderNodeSeparateXYZ", Vector=coordinates.outputs["Generated"])
    ramp = add_node(tree, "ShaderNodeValToRGB", Fac=apart.outputs["Z"])
    ramp.color_ramp.elements[0].position, ramp.color_ramp.elements[1].position = 0.1, 0.7
    mix = add_node(tree, "ShaderNodeMixShader", Fac=ramp.outputs[0])
    colours = (0.2, 0.6, 0.1, 1.0), (0.1, 0.3, 0.9, 1.0)
    for socket, colour in zip(mix.inputs[1:], colours, strict=True):
        tree.links.new(background(tree, colour).outputs[0], socket)
    return mix


def sky(kind: str, **values: Any) -> Graph:
    def make(tree: Tree, folder: Path) -> Any:
        node = tree.nodes.new("ShaderNodeTexSky")
        if kind not in node.bl_rna.properties["sky_type"].enum_items:
            pytest.skip(f"this Blender has no sky {kind}")
        node.sky_type = kind
        for name, value in values.items():
            setattr(node, name, value)
        return background(tree, node, 0.5)

    make.__name__ = f"sky_{kind.lower()}"
    return make


EXACT = (turned, mirrored, for_the_camera)
EVALUATED = (
    turned_back_bytes,
    moved,
    mirror_ball,
    other_hue,
    mixed_by_height,
    sky("SINGLE_SCATTERING", sun_rotation=0.7, sun_disc=False),
    sky("MULTIPLE_SCATTERING", sun_rotation=0.7, sun_elevation=0.6),  # with its sun
    sky("NISHITA", sun_rotation=0.7, sun_disc=False),
    sky("PREETHAM", sun_direction=(0.5, -0.3, 0.6)),
    sky("HOSEK_WILKIE", sun_direction=(0.5, -0.3, 0.6)),
)


def open_scene(graph: Graph, folder: Path) -> None:
    """A ball, half diffuse and half a mirror, before the world; all diffuse below a sun, which only
    many samples find in a mirror of that size."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    world = new_world(scene)
    finish(world, graph(world, folder))
    material = shader_material("ShaderNodeBsdfDiffuse", Color=(0.8, 0.8, 0.8, 1.0))
    tree = material.node_tree
    diffuse = next(node for node in tree.nodes if node.type == "BSDF_DIFFUSE")
    mirror = add_node(tree, "ShaderNodeBsdfGlossy", Roughness=0.0, Color=(0.9, 0.9, 0.9, 1.0))
    has_sun = any(
        node.type == "TEX_SKY" and "SCATTERING" in node.sky_type and node.sun_disc
        for node in world.nodes
    )
    mix = add_node(tree, "ShaderNodeMixShader", Fac=0.0 if has_sun else 0.5)
    for socket, shader in zip(mix.inputs[1:], (diffuse, mirror), strict=True):
        tree.links.new(shader.outputs[0], socket)
    finish(tree, mix)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=96, ring_count=48)
    bpy.ops.object.shade_smooth()
    bpy.context.object.data.materials.append(material)
    camera = add_object("Camera", bpy.data.cameras.new("Camera"), location=(1.5, -3.5, 1.2))
    camera.rotation_euler = (math.radians(73.0), 0.0, math.radians(23.0))
    camera.data.lens = 40.0
    scene.camera = camera


FEW = (for_the_camera,)  # the others take long together
GRAPHS = [
    pytest.param(graph, id=graph.__name__, marks=() if graph in FEW else pytest.mark.thorough)
    for graph in (*EXACT, *EVALUATED)
]


@pytest.mark.parametrize("graph", GRAPHS)
def test_a_ball_shows_what_it_shows_in_cycles(device: Device, graph: Graph, tmp_path: Path) -> None:
    open_scene(graph, tmp_path)
    exported, report = snapshot(bpy.context.evaluated_depsgraph_get())
    (entry,) = (entry for entry in report.entries if entry.object == "World 'World'")
    assert entry.status == ("approximated" if graph in EVALUATED else "exact"), entry
    images = render(device, exported, width=SIZE, height=SIZE, passes=PASSES, photons=0)
    ours, reference = images["Combined"][..., :3], render_loaded(128, 1)
    brightness = block_means(reference).mean(axis=2)
    # Where a ball in the sun begins before a dark ground, a pixel's share of it is noise.
    share = block_means(np.abs(images["Normal"][..., :3]).max(axis=2, keepdims=True) > 0)[..., 0]
    keep = (brightness > DARK * brightness.mean()) & ((share == 0) | (share == 1))
    assert keep[share == 1].sum() >= 8 and keep[share == 0].sum() >= 16
    found: Difference = compare(ours, reference, keep)
    print(f"\n{graph.__name__}: median {found.median:.3%}, high {found.high:.3%}")
    assert found.median <= MEDIAN
    assert found.high <= HIGH
