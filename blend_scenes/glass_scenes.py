# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes of caustics through glass and water and by metal; make_scenes.py makes them.

Sizes are in metres. All glass is closed, and what stands on something sinks into it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import bpy
from lit_scenes import principled
from scene_parts import block, camera, lamp, lathe, mesh_object, world

WATER, GLASS, WINE = 1.333, 1.5, 1.36


def wine_glass() -> None:
    """A glass of red wine on a table of pale wood, in the light of a bulb to the side."""
    clear = glass("Glass", (1, 1, 1), GLASS)
    # Where wine touches glass there is one surface, of the ratio of both indices.
    touching = glass("Glass in wine", (0.74, 0.06, 0.09), GLASS / WINE)
    top = glass("Wine", (1, 1, 1), WINE)
    table = textured("Wood", "ShaderNodeTexWave", (0.52, 0.36, 0.22), (0.66, 0.50, 0.33), 14)
    block("Table", table, (-0.7, -0.6, -0.04), (0.7, 0.8, 0))
    # Round the foot, up the stem and the outside of the bowl, over the rim and down its inside.
    outside = [(0, -0.0005), (0.033, -0.0005), (0.034, 0.001), (0.02, 0.004), (0.006, 0.010)]
    outside += [(0.0040, 0.03), (0.0040, 0.075), (0.012, 0.088), (0.030, 0.104), (0.0395, 0.13)]
    outside += [(0.0385, 0.16), (0.0325, 0.198)]
    level = (0.0388, 0.142)
    lathe("Wine glass", clear, [*outside, (0.0315, 0.198), (0.0375, 0.16), level], segments=64)
    inside = [level, (0.0385, 0.13), (0.0288, 0.105), (0.011, 0.0905), (0, 0.0885)]
    lathe("Wine's side", touching, inside, segments=64)
    lathe("Wine's top", top, [level, (0, level[1])], segments=64)
    lamp("POINT", "Bulb", (-0.30, 0.27, 0.60), (0, 0, 0), energy=9, shadow_soft_size=0.004,
         color=(1, 0.90, 0.78))  # fmt: skip
    world(0.05, (0.75, 0.85, 1.0))
    camera((0.16, -0.62, 0.34), (0.035, -0.01, 0.075), lens=50)


def pool() -> None:
    """Sun on a pool's waves, and their net of light on its tiles."""
    stone = principled("Stone", (0.62, 0.58, 0.52), 0.6)
    tiles = textured("Tiles", "ShaderNodeTexBrick", (0.62, 0.78, 0.80), (0.55, 0.72, 0.77), 1)
    low, high, deep = (-2.0, -1.5), (2.0, 1.5), 1.2
    corners = [
        (x, y, z) for z in (-deep, 0.15) for y in (low[1], high[1]) for x in (low[0], high[0])
    ]
    faces = [(0, 1, 3, 2), (0, 4, 5, 1), (1, 5, 7, 3), (3, 7, 6, 2), (2, 6, 4, 0)]
    mesh_object("Basin", [tiles], corners, faces)
    for name, (x0, y0), (x1, y1) in (
        ("Edge, left", (low[0] - 1.5, low[1] - 1.5), (low[0], high[1] + 1.5)),
        ("Edge, right", (high[0], low[1] - 1.5), (high[0] + 1.5, high[1] + 1.5)),
        ("Edge, front", (low[0], low[1] - 1.5), (high[0], low[1])),
        ("Edge, back", (low[0], high[1]), (high[0], high[1] + 1.5)),
    ):
        block(name, stone, (x0, y0, -0.05), (x1, y1, 0.15))
    waves("Water", glass("Water", (0.92, 0.98, 1.0), WATER), low, high)
    lamp("SUN", "Sun", (-1.5, 1.0, 4.0), (0, 0, 0), energy=4.0, angle=math.radians(0.53),
         color=(1, 0.96, 0.90))  # fmt: skip
    world(0.6, (0.45, 0.66, 1.0))
    camera((0.0, -3.4, 2.9), (0, 0.1, -0.5), lens=30)


def waves(name: str, mat, low: Sequence[float], high: Sequence[float], cells: int = 96):
    """A rippled sheet of water from wall to wall, a little into them."""
    ways = [(0.9, 0.35, 6.1, 0.3), (-0.5, 0.85, 8.7, 1.9), (0.2, -1.0, 11.3, 4.0),
            (1.0, -0.6, 15.1, 5.2), (-0.8, -0.4, 19.7, 2.7)]  # fmt: skip

    def height(x: float, y: float) -> float:
        parts = [
            0.055 / number * math.sin(number * (a * x + b * y) / math.hypot(a, b) + phase)
            for a, b, number, phase in ways
        ]
        return sum(parts)

    more = 0.01
    corners = []
    for i in range(cells + 1):
        for k in range(cells + 1):
            x = low[0] - more + (high[0] - low[0] + 2 * more) * k / cells
            y = low[1] - more + (high[1] - low[1] + 2 * more) * i / cells
            corners.append((x, y, height(x, y)))
    faces = [
        (i * (cells + 1) + k, i * (cells + 1) + k + 1, (i + 1) * (cells + 1) + k + 1,
         (i + 1) * (cells + 1) + k)
        for i in range(cells) for k in range(cells)
    ]  # fmt: skip
    return mesh_object(name, [mat], corners, faces, smooth=True)


def ring() -> None:
    """Two rings of gold on paper: the cardioid of a near lamp, the nephroid of a far one."""
    gold = metal("Gold", (1.0, 0.72, 0.32), 0.0)
    paper = principled("Paper", (0.78, 0.76, 0.72), 0.7)
    block("Sheet", paper, (-0.15, -0.12, -0.01), (0.15, 0.15, 0))
    for x, y, turn in ((-0.014, 0.0, 0.0), (0.022, 0.016, 1.0)):
        # A band of 20 mm, inside first round to the outside.
        band = [(0.0100, -0.0002), (0.0100, 0.0052), (0.0103, 0.0055), (0.0111, 0.0055)]
        lathe("Ring", gold, [*band, (0.0114, 0.0052), (0.0114, -0.0002)], (x, y, turn * 1e-5), 128)
    lamp("SPOT", "Lamp", (-0.10, 0.055, 0.06), (0.0, 0.0, 0.0), energy=0.35,
         shadow_soft_size=0.0004, spot_size=math.radians(50), spot_blend=0.6,
         color=(1, 0.93, 0.82))  # fmt: skip
    world(0.12, (0.80, 0.88, 1.0))
    camera((0.016, -0.115, 0.085), (0.004, 0.004, 0.0), lens=60)


def glass(name: str, colour, ior: float) -> bpy.types.Material:
    """A smooth Glass BSDF."""
    mat = bpy.data.materials.new(name)
    mat.use_nodes = True
    nodes = mat.node_tree.nodes
    nodes.remove(nodes["Principled BSDF"])
    node = nodes.new("ShaderNodeBsdfGlass")
    node.inputs["Color"].default_value = (*colour, 1)
    node.inputs["Roughness"].default_value = 0
    node.inputs["IOR"].default_value = ior
    mat.node_tree.links.new(node.outputs[0], nodes["Material Output"].inputs["Surface"])
    mat.diffuse_color = (*colour, 1)
    return mat


def metal(name: str, colour, roughness: float) -> bpy.types.Material:
    """A Principled BSDF that is all metal."""
    mat = principled(name, colour, roughness)
    mat.node_tree.nodes["Principled BSDF"].inputs["Metallic"].default_value = 1
    return mat


def textured(name: str, kind: str, one, other, scale: float) -> bpy.types.Material:
    """A Principled BSDF whose base a procedural texture mixes of two colours, by the object's
    coordinates."""
    mat = principled(name, one, 0.45)
    tree = mat.node_tree
    place, texture = tree.nodes.new("ShaderNodeTexCoord"), tree.nodes.new(kind)
    texture.inputs["Scale"].default_value = scale
    tree.links.new(place.outputs["Object"], texture.inputs["Vector"])
    base = tree.nodes["Principled BSDF"].inputs["Base Color"]
    if kind == "ShaderNodeTexBrick":
        for socket, colour in (("Color1", one), ("Color2", other), ("Mortar", (0.85, 0.88, 0.88))):
            texture.inputs[socket].default_value = (*colour, 1)
        texture.inputs["Brick Width"].default_value = 0.25
        texture.inputs["Row Height"].default_value = 0.25
        texture.inputs["Mortar Size"].default_value = 0.008
        texture.offset = 0
        tree.links.new(texture.outputs["Color"], base)
        return mat
    texture.inputs["Distortion"].default_value = 6
    texture.inputs["Detail"].default_value = 3
    ramp = tree.nodes.new("ShaderNodeValToRGB")
    for element, colour in zip(ramp.color_ramp.elements, (one, other), strict=True):
        element.color = (*colour, 1)
    tree.links.new(texture.outputs["Fac"], ramp.inputs["Fac"])
    tree.links.new(ramp.outputs["Color"], base)
    return mat
