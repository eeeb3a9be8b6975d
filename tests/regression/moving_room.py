# SPDX-License-Identifier: GPL-3.0-or-later
"""A room in which things move, turn and bend while the shutter is open; made in Blender."""

from __future__ import annotations

import math

import bpy

from addon.blender.export import snapshot
from addon.photon.scene import Scene

from .glossy_room import SIZE, add_quad, new_material
from .lamp_room import LAMPS, OVERHEAD, make_room

EDGES = (0, 2)  # frames; the exposure is of frame 1, a frame long
CASES = ("box", "cloth", "emissive")


def open_case(name: str) -> Scene:
    """Make the scene of a case in Blender, and export it."""
    kind, place, turn, scale, settings = LAMPS["softbox"]
    make_room(kind, place, turn, scale, settings)
    scene = bpy.context.scene
    if name == "box":
        _go(bpy.data.objects["Cube"], (-1.5, 0.2, 0.6), (0.3, 0.9, 1.3), 1.6)
    elif name == "cloth":
        _bend()
    else:
        bpy.data.objects["Lamp"].hide_render = True
        material = new_material("Emissive", "ShaderNodeEmission", (1.0, 0.9, 0.7))
        material.node_tree.nodes["Shader"].inputs["Strength"].default_value = 20.0
        panel = [(-0.5, -0.4, 0), (0.5, -0.4, 0), (0.5, 0.4, 0), (-0.5, 0.4, 0)]
        add_quad("Panel", panel, material)
        x, y, z = OVERHEAD
        _go(bpy.data.objects["Panel"], (x - 1.5, y, z), (x + 2.5, y, z - 0.6), 0.5)
    render = scene.render
    render.resolution_x = render.resolution_y = SIZE
    render.resolution_percentage = 100
    render.use_motion_blur, render.motion_blur_shutter = True, 1.0
    scene.frame_set(1)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    exported, _ = snapshot(depsgraph, frame_set=lambda f, part: scene.frame_set(f, subframe=part))
    assert exported.moving
    return exported


def _go(obj: bpy.types.Object, first: tuple, last: tuple, turn: float) -> None:
    for frame, place, angle in zip(EDGES, (first, last), (0.0, turn), strict=True):
        obj.location, obj.rotation_euler[2] = place, angle
        obj.keyframe_insert("location", frame=frame)
        obj.keyframe_insert("rotation_euler", frame=frame)


def _bend() -> None:
    """A smooth sheet, flat at first and then a hill."""
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=12, y_subdivisions=12, size=2.4)
    sheet = bpy.context.object
    sheet.location = (-0.6, -0.6, 0.5)
    sheet.data.materials.append(bpy.data.materials["Red"])
    for face in sheet.data.polygons:
        face.use_smooth = True
    sheet.shape_key_add(name="Basis")
    hill = sheet.shape_key_add(name="Hill")
    for point in hill.data:
        x, y, _ = point.co
        point.co[2] = 1.6 * math.exp(-2.0 * (x * x + y * y))
    for frame, value in zip(EDGES, (0.0, 1.0), strict=True):
        hill.value = value
        hill.keyframe_insert("value", frame=frame)
