# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes under lights of some size and a world, with Cycles' own lobes; make_scenes.py makes them.

Sizes are in metres.
"""

from __future__ import annotations

import math

import bpy
from scene_lights import lamp, sky, world
from scene_parts import (
    SUNK,
    backdrop,
    block,
    camera,
    closed_room,
    lathe,
    material,
    sphere,
    tube,
    wall_with_window,
)


def studio() -> None:
    """A glazed teapot and a matt bowl of fruit on a seamless backdrop: key, fill and rim light."""
    paper = material("Paper", (0.62, 0.61, 0.60))
    clay = material("Clay", (0.55, 0.30, 0.19))
    fruit = material("Fruit", (0.66, 0.40, 0.05))
    glaze = principled("Glaze", (0.04, 0.14, 0.19), 0.22)
    backdrop("Backdrop", paper, 2.2, 2.4, 2.6, 1.2)
    teapot(glaze, (-0.32, 0.15, -0.002), 32)
    bowl = [(0, 0.02), (0.14, 0.02), (0.15, 0), (0.17, 0), (0.30, 0.12), (0.38, 0.26)]
    inside = [(0.36, 0.265), (0.28, 0.14), (0.16, 0.05), (0, 0.04)]
    lathe("Bowl", clay, [*bowl, *inside], (0.62, -0.12, -0.002), 48)
    for i, (x, y) in enumerate([(-0.12, -0.04), (0.11, -0.09), (0.02, 0.13)]):
        sphere(f"Fruit {i + 1}", fruit, 0.115, (0.62 + x, -0.12 + y, 0.17), 3)
    lamp("AREA", "Key", (-1.9, -1.7, 2.3), (0, 0, 0.3),
         energy=52, shape="RECTANGLE", size=1.3, size_y=0.9, color=(1, 0.95, 0.88))  # fmt: skip
    lamp("AREA", "Fill", (2.3, -2.0, 1.3), (0.1, 0, 0.3),
         energy=14, shape="DISK", size=1.5, color=(0.86, 0.93, 1))  # fmt: skip
    lamp("AREA", "Rim", (1.3, 1.5, 2.2), (-0.1, 0, 0.35),
         energy=36, shape="RECTANGLE", size=1.2, size_y=0.3)  # fmt: skip
    world(0.09, (0.80, 0.90, 1.0))
    camera((0.02, -4.2, 1.45), (0.08, 0, 0.27), lens=72)


def teapot(mat: bpy.types.Material, at, turn: float) -> None:
    """Body, lid, spout and handle, in one place."""
    body = [(0, 0.01), (0.21, 0.01), (0.22, 0), (0.24, 0), (0.25, 0.02), (0.36, 0.15)]
    body += [(0.39, 0.28), (0.34, 0.41), (0.22, 0.50), (0.21, 0.515), (0.19, 0.515), (0.19, 0.48)]
    lid = [(0.195, 0.50), (0.195, 0.52), (0.15, 0.555), (0.07, 0.58), (0.03, 0.595)]
    knob = [(0.028, 0.61), (0.05, 0.63), (0.055, 0.655), (0.035, 0.685), (0, 0.692)]

    def spout(t: float) -> tuple[float, float, float]:
        return 0, -0.30 - 0.36 * t, 0.16 + 0.12 * t + 0.22 * t**2

    def handle(t: float) -> tuple[float, float, float]:
        bow = math.sin(math.pi * t)
        return 0, 0.28 + 0.28 * bow, 0.13 + 0.29 * t + 0.05 * bow

    parts = [
        lathe("Teapot", mat, body, segments=48),
        lathe("Lid", mat, [*lid, *knob], segments=48),
        tube("Spout", mat, spout, lambda t: 0.085 - 0.05 * t),
        tube("Handle", mat, handle, lambda t: 0.03),
    ]
    for part in parts:
        part.location, part.rotation_euler = at, (0, 0, math.radians(turn - 90))


def principled(name: str, colour, roughness: float) -> bpy.types.Material:
    """A Principled BSDF of Blender's default index of refraction."""
    mat = bpy.data.materials.new(name)
    mat.use_nodes = True
    inputs = mat.node_tree.nodes["Principled BSDF"].inputs
    inputs["Base Color"].default_value = (*colour, 1)
    inputs["Roughness"].default_value = roughness
    mat.diffuse_color = (*colour, 1)
    return mat


def daylight() -> None:
    """A room that sun and sky light through a window."""
    wall = material("Wall", (0.74, 0.72, 0.68))
    floor = material("Floor", (0.40, 0.25, 0.14))
    paint = material("Window paint", (0.78, 0.78, 0.76))
    stone = material("Stone", (0.45, 0.43, 0.40))
    blue = material("Blue", (0.13, 0.24, 0.42))
    oak = material("Oak", (0.48, 0.30, 0.15))
    linen = material("Linen", (0.60, 0.56, 0.48))
    leaf = material("Leaf", (0.12, 0.30, 0.09))
    left, right, back, top = -2.1, 2.1, 4.8, 2.7
    closed_room((left, 0, 0), (right, back, top), floor, wall, (None, wall, wall, wall))
    window = {"y": (0, 1.2, 3.9, back), "z": (0, 0.6, 2.4, top)}
    wall_with_window("Window wall", [wall, paint, stone], (left, left - 0.3), **window)
    for y in (2.08, 2.98):
        low, high = (left - 0.17, y, 0.6 - SUNK), (left - 0.1, y + 0.05, 2.4 + SUNK)
        block("Mullion", paint, low, high)
    block("Transom", paint, (left - 0.16, 1.2 - SUNK, 1.93), (left - 0.11, 3.9 + SUNK, 1.97))
    block("Sill", paint, (left - 0.1, 1.12, 0.56), (left + 0.14, 3.98, 0.602))

    block("Table top", oak, (-0.75, -0.45, 0.70), (0.75, 0.45, 0.74), (0.05, 2.95, 0), 8)
    for x in (-0.66, 0.66):
        for y in (-0.37, 0.37):
            block("Leg", oak, (x - 0.035, y - 0.035, -SUNK), (x + 0.035, y + 0.035, 0.71),
                  (0.05, 2.95, 0), 8)  # fmt: skip
    vase = [(0, 0), (0.06, 0), (0.10, 0.09), (0.085, 0.20), (0.04, 0.28), (0.05, 0.33), (0, 0.30)]
    lathe("Vase", blue, vase, (-0.2, 3.05, 0.738))
    sphere("Apple", material("Apple", (0.50, 0.07, 0.05)), 0.055, (0.22, 2.85, 0.792), 4)
    block("Book", linen, (-0.13, -0.09, 0.738), (0.13, 0.09, 0.775), (0.48, 3.0, 0), 33)
    block("Sofa", blue, (-0.45, -0.9, -SUNK), (0.45, 0.9, 0.42), (1.62, 3.1, 0))
    block("Sofa's back", blue, (0.25, -0.9, 0.1), (0.45, 0.9, 0.82), (1.62, 3.1, 0))
    pot = [(0, -SUNK), (0.15, -SUNK), (0.20, 0.34), (0.18, 0.34), (0.17, 0.30), (0, 0.30)]
    lathe("Pot", linen, pot, (-1.6, 4.3, 0))
    sphere("Bush", leaf, 0.36, (-1.6, 4.3, 0.78), 4)
    block("Frame", oak, (-0.45, back - 0.03, 1.1), (0.95, back + SUNK, 2.1))
    block("Picture", linen, (-0.28, back - 0.035, 1.27), (0.78, back, 1.93))

    to_sun = (-0.80, -0.32, 0.62)
    lamp("SUN", "Sun", tuple(6 * x for x in to_sun), (0, 0, 0),
         energy=9.0, angle=math.radians(0.53), color=(1, 0.90, 0.76))  # fmt: skip
    sky(1.4, to_sun, (0.40, 0.37, 0.31))
    camera((1.0, 0.25, 1.45), (-0.25, 4.0, 1.1), lens=25)
