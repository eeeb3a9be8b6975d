# SPDX-License-Identifier: GPL-3.0-or-later
"""A room open to the eye whose floor and ball wear one Principled material, made in Blender.

What lights it decides what converges in Cycles. A path tracer meets a delta light through a sharp
lobe by chance alone: of the metal of roughness 0.05 under the bare point light two runs of 2048
samples differ by 7 % in the median and by 45 % at the 95th percentile of 8x8 blocks. So sharp lobes
see light that was scattered before, or a light of some size, whose caustic a path can find.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import bpy

from addon.blender.export import snapshot
from addon.photon.scene import Scene
from tests.blender.build import nodes_of

from .cycles import TURNED_OFF

SIZE = 64  # [px]
HALF, HEIGHT = 2.0, 4.0  # [m] of the room
LAMP = (-0.9, -0.8, 3.2)  # [m]


@dataclass(frozen=True)
class Case:
    """A material, and what lights the room."""

    roughness: float
    metallic: float
    light: str  # "point"; "up": a spotlight on the ceiling; "sphere"

    @property
    def name(self) -> str:
        return f"{'metal' if self.metallic else 'dielectric'} {self.roughness:g} {self.light}"


CASES = (
    Case(0.05, 0.0, "up"),
    Case(0.05, 1.0, "up"),
    Case(0.2, 0.0, "point"),
    Case(0.2, 1.0, "point"),
    Case(0.5, 0.0, "point"),
    Case(0.5, 1.0, "point"),
    Case(1.0, 0.0, "point"),
    Case(1.0, 1.0, "point"),
    Case(0.05, 1.0, "sphere"),
)


def open_room(case: Case) -> Scene:
    """Make the room in Blender, and export it."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    render = scene.render
    render.resolution_x = render.resolution_y = SIZE
    render.resolution_percentage = 100
    glossy = new_material("Glossy", "ShaderNodeBsdfPrincipled", (0.8, 0.6, 0.3))
    inputs = glossy.node_tree.nodes["Shader"].inputs
    inputs["Metallic"].default_value = case.metallic
    inputs["Roughness"].default_value = case.roughness
    inputs["IOR"].default_value = 1.5
    grey = new_material("Grey", "ShaderNodeBsdfDiffuse", (0.7, 0.7, 0.7))
    red = new_material("Red", "ShaderNodeBsdfDiffuse", (0.7, 0.2, 0.2))
    a, h = HALF, HEIGHT
    add_quad("Floor", [(-a, -a, 0), (a, -a, 0), (a, a, 0), (-a, a, 0)], glossy)
    add_quad("Ceiling", [(-a, a, h), (a, a, h), (a, -a, h), (-a, -a, h)], grey)
    add_quad("Back", [(-a, a, h), (a, a, h), (a, a, 0), (-a, a, 0)], grey)
    add_quad("Left", [(-a, -a, h), (-a, a, h), (-a, a, 0), (-a, -a, 0)], red)
    add_quad("Right", [(a, -a, 0), (a, a, 0), (a, a, h), (a, -a, h)], grey)
    bpy.ops.mesh.primitive_uv_sphere_add(
        segments=64, ring_count=32, radius=0.8, location=(0.2, 0.3, 1.0)
    )
    ball = bpy.context.object
    ball.data.shade_smooth()
    ball.data.materials.append(glossy)
    _add_light(case.light)
    camera = bpy.data.cameras.new("Camera")
    camera.lens = 48
    scene.camera = add(camera, (0, -7, 2))
    scene.camera.rotation_euler = (math.pi / 2, 0, 0)
    exported, report = snapshot(bpy.context.evaluated_depsgraph_get())
    lost = [e for e in report.entries if e.status == "ignored" and e.feature not in TURNED_OFF]
    assert not lost, lost
    return exported


def new_material(name: str, kind: str, colour: tuple[float, float, float]) -> bpy.types.Material:
    material = bpy.data.materials.new(name)
    tree = nodes_of(material)
    tree.nodes.clear()
    shader, output = tree.nodes.new(kind), tree.nodes.new("ShaderNodeOutputMaterial")
    shader.name = "Shader"
    shader.inputs[0].default_value = (*colour, 1.0)
    tree.links.new(shader.outputs[0], output.inputs["Surface"])
    return material


def add(data: bpy.types.ID, location: Any = (0, 0, 0)) -> bpy.types.Object:
    obj = bpy.data.objects.new(data.name, data)
    obj.location = location
    bpy.context.scene.collection.objects.link(obj)
    return obj


def add_quad(name: str, corners: Any, material: bpy.types.Material) -> None:
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
    mesh.materials.append(material)
    add(mesh)


def _add_light(kind: str) -> None:
    data = bpy.data.lights.new("Lamp", "SPOT" if kind == "up" else "POINT")
    data.energy, data.shadow_soft_size = 300.0, 0.3 if kind == "sphere" else 0.0
    data.use_soft_falloff = False
    lamp = add(data, LAMP)
    lamp.visible_camera = False  # ours is not seen either
    if kind == "up":
        data.spot_size, data.spot_blend = math.radians(120), 0.5
        lamp.rotation_euler = (math.pi, 0, 0)
