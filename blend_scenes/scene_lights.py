# SPDX-License-Identifier: GPL-3.0-or-later
"""What lights the scenes of make_scenes.py: lamps, worlds, skies."""

from __future__ import annotations

import math

import bpy
import numpy as np

# isort: split
from mathutils import Vector
from scene_parts import add_object


def point_light(power: float, location, colour=(1, 1, 1)) -> bpy.types.Object:
    """A delta point light of `power` [W]."""
    light = bpy.data.lights.new("Point", "POINT")
    light.energy, light.color, light.shadow_soft_size = power, colour, 0
    obj = add_object("Point", light)
    obj.location = location
    return obj


def spotlight(
    power: float, location, target, cone: float, blend: float, colour=(1, 1, 1)
) -> bpy.types.Object:
    """A delta spotlight of `power` [W], aimed at `target`, `cone` [degrees] from edge to edge."""
    light = bpy.data.lights.new("Spotlight", "SPOT")
    light.energy, light.color = power, colour
    light.spot_size = math.radians(cone)
    light.spot_blend = blend
    light.shadow_soft_size = 0
    obj = add_object("Spotlight", light)
    obj.location = location
    obj.rotation_euler = (Vector(target) - Vector(location)).to_track_quat("-Z", "Y").to_euler()
    return obj


def lamp(kind: str, name: str, location, target, **settings) -> bpy.types.Object:
    """A light with settings of Blender's own names, aimed at `target`."""
    light = bpy.data.lights.new(name, kind)
    for key, value in settings.items():
        setattr(light, key, value)
    obj = add_object(name, light)
    obj.location = location
    obj.rotation_euler = (Vector(target) - Vector(location)).to_track_quat("-Z", "Y").to_euler()
    return obj


def world(strength: float, colour=(1, 1, 1)) -> bpy.types.Node:
    """Light the scene from all around; the Background node."""
    here = bpy.context.scene.world
    here.name = "World"
    background = here.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (*colour, 1)
    background.inputs["Strength"].default_value = strength
    return background


def sky(zenith: float, to_sun, ground, width: int = 128) -> None:
    """A clear sky of so much radiance at its zenith, without the sun, over even ground: an image.

    The CIE's standard clear sky (Kittler 1967), bluer where it is darker.
    """
    height = width // 2
    azimuth = -2 * math.pi * (np.arange(width) + 0.5) / width  # of Blender's Environment Texture
    height_angle = math.pi * ((np.arange(height) + 0.5) / height - 0.5)[:, None]
    x, y, z = np.broadcast_arrays(
        -np.cos(height_angle) * np.cos(azimuth),
        np.cos(height_angle) * np.sin(azimuth),
        np.sin(height_angle),
    )
    sun = np.array(Vector(to_sun).normalized())
    away = np.arccos(np.clip(x * sun[0] + y * sun[1] + z * sun[2], -1, 1))

    def glow(angle):
        return 0.91 + 10 * np.exp(-3 * angle) + 0.45 * np.cos(angle) ** 2

    depth = 1 - np.exp(-0.32 / np.maximum(z, 0.02))
    shape = glow(away) * depth / (glow(math.acos(sun[2])) * (1 - math.exp(-0.32)))
    white = (depth**1.5)[..., None]
    colour = (1 - white) * (0.20, 0.42, 1.0) + white * (0.75, 0.88, 1.0)
    pixels = np.ones((height, width, 4), np.float32)
    pixels[..., :3] = np.where(z[..., None] > 0, zenith * shape[..., None] * colour, ground)
    image = bpy.data.images.new("Sky", width, height, float_buffer=True)
    image.pixels.foreach_set(pixels.ravel())
    image.pack()
    tree = bpy.context.scene.world.node_tree
    node = tree.nodes.new("ShaderNodeTexEnvironment")
    node.image, node.location = image, (-300, 300)
    tree.links.new(node.outputs["Color"], world(1.0).inputs["Color"])
