# SPDX-License-Identifier: GPL-3.0-or-later
"""A room with diffuse walls, a rough metal box and a mirror, under a lamp of each kind, and
Blender's default scene; made in Blender.

Lamps are seen, directly and in the mirror. They are of some size, or a path tracer would not find
what the mirror throws back of them.
"""

from __future__ import annotations

import math
from typing import Any

import bpy

from addon.blender.export import snapshot
from addon.photon.scene import Scene
from tests.blender.build import nodes_of

from .cycles import TURNED_OFF
from .glossy_room import HALF, HEIGHT, SIZE, add, add_quad, new_material

# By name: Blender's type, place, rotation [deg], scale and settings of the light.
Lamp = tuple[str, tuple[float, ...], tuple[float, ...], tuple[float, ...], dict[str, Any]]
OVERHEAD, NONE, EVEN = (-0.5, -0.4, 3.6), (0, 0, 0), (1, 1, 1)
LAMPS: dict[str, Lamp] = {
    "rectangle": (
        "AREA",
        OVERHEAD,
        (15, 10, 30),
        (1, 1.5, 1),
        {"energy": 200.0, "shape": "RECTANGLE", "size": 0.8, "size_y": 1.0},
    ),
    "softbox": (
        "AREA",
        OVERHEAD,
        (20, -10, 0),
        EVEN,
        {"energy": 200.0, "shape": "DISK", "size": 1.2, "spread": math.radians(110)},
    ),
    "sun": ("SUN", NONE, (60, 0, 15), EVEN, {"energy": 3.0, "angle": math.radians(20)}),
    "soft point": ("POINT", (-0.9, -0.8, 3.0), NONE, EVEN, {"shadow_soft_size": 0.3}),
    "sphere": (
        "POINT",
        (-0.9, -0.8, 3.0),
        NONE,
        EVEN,
        {"shadow_soft_size": 0.3, "use_soft_falloff": False},
    ),
    "spot": (
        "SPOT",
        OVERHEAD,
        (10, -10, 20),
        (2, 1, 1.5),
        {"energy": 300.0, "spot_size": math.radians(90), "spot_blend": 0.4}
        | {"shadow_soft_size": 0.5},
    ),
    "linear": (
        "AREA",
        OVERHEAD,
        (15, 10, 30),
        EVEN,
        {"energy": 60.0, "size": 1.0, "falloff": "Linear"},
    ),
}
DEFAULT = "default scene"
CASES = (*LAMPS, DEFAULT)


def open_case(name: str) -> Scene:
    """Make the scene of a case in Blender, and export it."""
    if name == DEFAULT:
        bpy.ops.wm.read_factory_settings()
    else:
        make_room(*LAMPS[name])
    render = bpy.context.scene.render
    render.resolution_x = render.resolution_y = SIZE
    render.resolution_percentage = 100
    exported, report = snapshot(bpy.context.evaluated_depsgraph_get())
    lost = [e for e in report.entries if e.status != "exact" and e.feature not in TURNED_OFF]
    assert not lost, lost
    return exported


def make_room(kind: str, place: Any, turn: Any, scale: Any, settings: dict[str, Any]) -> None:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if kind == "SPOT":  # what it leaves dark would be noise alone
        world = bpy.context.scene.world = bpy.data.worlds.new("World")
        background = nodes_of(world).nodes["Background"]
        background.inputs["Color"].default_value = (0.5, 0.5, 0.5, 1.0)
    grey = new_material("Grey", "ShaderNodeBsdfDiffuse", (0.6, 0.6, 0.6))
    red = new_material("Red", "ShaderNodeBsdfDiffuse", (0.6, 0.2, 0.2))
    mirror = new_material("Mirror", "ShaderNodeBsdfGlossy", (0.8, 0.8, 0.8))
    mirror.node_tree.nodes["Shader"].inputs["Roughness"].default_value = 0.0
    glossy = new_material("Glossy", "ShaderNodeBsdfPrincipled", (0.8, 0.6, 0.3))
    inputs = glossy.node_tree.nodes["Shader"].inputs
    inputs["Metallic"].default_value, inputs["Roughness"].default_value = 1.0, 0.4
    a, h = HALF, HEIGHT
    add_quad("Floor", [(-a, -a, 0), (a, -a, 0), (a, a, 0), (-a, a, 0)], grey)
    add_quad("Ceiling", [(-a, a, h), (a, a, h), (a, -a, h), (-a, -a, h)], grey)
    add_quad("Back", [(-a, a, h), (a, a, h), (a, a, 0), (-a, a, 0)], grey)
    add_quad("Left", [(-a, -a, h), (-a, a, h), (-a, a, 0), (-a, -a, 0)], red)
    add_quad("Right", [(a, -a, 0), (a, a, 0), (a, a, h), (a, -a, h)], grey)
    add_quad("Glass", [(1.9, -1, 0.6), (0.9, 1.5, 0.6), (0.9, 1.5, 2.6), (1.9, -1, 2.6)], mirror)
    bpy.ops.mesh.primitive_cube_add(size=1.2, location=(-0.7, 0.6, 0.6), rotation=(0, 0, 0.4))
    bpy.context.object.data.materials.append(glossy)
    data = bpy.data.lights.new("Lamp", kind)
    data.energy = 300.0
    falloff = settings.get("falloff")
    for key, value in settings.items():
        if key != "falloff":
            setattr(data, key, value)
    if falloff:
        tree = nodes_of(data)
        node = tree.nodes.new("ShaderNodeLightFalloff")
        node.inputs["Strength"].default_value = 1.0
        emission = next(node for node in tree.nodes if node.type == "EMISSION")
        tree.links.new(node.outputs[falloff], emission.inputs["Strength"])
    lamp = add(data, place)
    lamp.rotation_euler, lamp.scale = [math.radians(angle) for angle in turn], scale
    lamp.visible_camera = True
    camera = bpy.data.cameras.new("Camera")
    camera.lens = 48
    view = add(camera, (0, -7, 2))
    view.rotation_euler = (math.pi / 2, 0, 0)
    bpy.context.scene.camera = view
