# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes of caustics through glass and water and by metal; make_scenes.py makes them.

Sizes are in metres. Glass is closed, the pool's water ends within walls, and what stands on
something sinks into it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import bpy
from lit_scenes import principled
from scene_lights import lamp, point_light, world
from scene_parts import (
    SUNK,
    add_object,
    block,
    camera,
    closed_room,
    lathe,
    lathes,
    material,
    mesh_object,
    sphere,
    wall_with_window,
)

WATER, GLASS, WINE = 1.333, 1.5, 1.36


def wine_glass() -> None:
    """A glass of red wine on a table of pale wood, in the light of a bulb to the side.

    The wine is a ball lens: its focus lies on the table, beside the foot.
    """
    clear = glass("Glass", (1, 1, 1), GLASS)
    # Where wine touches glass there is one surface, of the ratio of both indices.
    touching = glass("Glass in wine", (0.74, 0.06, 0.09), GLASS / WINE)
    top = glass("Wine", (1, 1, 1), WINE)
    table = textured("Wood", "ShaderNodeTexWave", (0.42, 0.27, 0.15), (0.56, 0.40, 0.25), 14)
    block("Table", table, (-0.7, -0.6, -0.04), (0.7, 0.8, 0))
    middle, radius, thick = 0.078, 0.043, 0.001

    def bowl(r: float, first: float, last: float, count: int) -> list[tuple[float, float]]:
        """Along a ball of which the upper half is higher, between two angles [degrees]."""
        angles = [math.radians(first + (last - first) * i / (count - 1)) for i in range(count)]
        high = [r * math.sin(a) * (1.35 if a > 0 else 1) for a in angles]
        return [(r * math.cos(a), middle + z) for a, z in zip(angles, high, strict=True)]

    foot = [(0, -0.0005), (0.030, -0.0005), (0.031, 0.001), (0.018, 0.0035), (0.006, 0.008)]
    stem = [(0.0036, 0.018), (0.0040, middle - radius - 0.006)]
    # Up the outside, over the rim and down the inside to the wine.
    dry = [*foot, *stem, *bowl(radius, -78, 55, 8), *bowl(radius - thick, 55, -25, 5)]
    wet = [dry[-1], *bowl(radius - thick, -25, -90, 5)[1:-1], (0, middle - radius + thick)]
    level = [dry[-1], (0, dry[-1][1])]
    lathes("Wine glass", [(clear, dry), (touching, wet), (top, level)], segments=56)
    lamp("POINT", "Bulb", (-0.40, 0.30, 0.395), (0, 0, middle), energy=11, shadow_soft_size=0.003,
         color=(1, 0.90, 0.78))  # fmt: skip
    world(0.03, (0.75, 0.85, 1.0))
    camera((0.15, -0.42, 0.27), (0.056, -0.046, 0.036), lens=55)


def pool() -> None:
    """Sun on a pool's waves, and their net of light on its tiles."""
    stone = material("Stone", (0.62, 0.58, 0.52))
    tiles = textured("Tiles", "ShaderNodeTexBrick", (0.62, 0.78, 0.80), (0.55, 0.72, 0.77), 1)
    low, high, deep = (-2.0, -1.5), (2.0, 1.5), 1.2
    corners = [
        (x, y, z) for z in (-deep, 0.1) for y in (low[1], high[1]) for x in (low[0], high[0])
    ]
    faces = [(0, 1, 3, 2), (0, 4, 5, 1), (1, 5, 7, 3), (3, 7, 6, 2), (2, 6, 4, 0)]
    mesh_object("Basin", [tiles], corners, faces)
    # The edges stand before the basin's walls, and end in each other.
    (left, front), (right, back) = ((x + SUNK, y + SUNK) for x, y in (low, (-high[0], -high[1])))
    right, back, wide = -right, -back, 1.5
    for name, (x0, y0), (x1, y1), top in (
        ("Edge, left", (left - wide, front - wide), (left, back + wide), 0.15),
        ("Edge, right", (right, front - wide), (right + wide, back + wide), 0.15),
        ("Edge, front", (left - SUNK, front - wide + SUNK), (right + SUNK, front), 0.151),
        ("Edge, back", (left - SUNK, back), (right + SUNK, back + wide - SUNK), 0.151),
    ):
        block(name, stone, (x0, y0, top - 0.2), (x1, y1, top))
    waves("Water", glass("Water", (0.90, 0.97, 1.0), WATER), low, high)
    lamp("SUN", "Sun", (-1.5, 1.0, 4.0), (0, 0, 0), energy=2.4, angle=math.radians(0.53),
         color=(1, 0.96, 0.90))  # fmt: skip
    world(0.25, (0.45, 0.66, 1.0))
    camera((0.5, -2.9, 2.5), (0.05, 0.05, -0.55), lens=34)


def waves(name: str, mat, low: Sequence[float], high: Sequence[float], cell: float = 0.08):
    """A rippled sheet of water from wall to wall, and a little into them; subdivided."""
    ways = [(0.9, 0.35, 4.3, 0.3), (-0.5, 0.85, 6.9, 1.9), (0.2, -1.0, 8.7, 4.0),
            (1.0, -0.6, 11.9, 5.2), (-0.8, -0.4, 14.3, 2.7)]  # fmt: skip

    def height(x: float, y: float) -> float:
        parts = [
            0.10 / number * math.sin(number * (a * x + b * y) / math.hypot(a, b) + phase)
            for a, b, number, phase in ways
        ]
        return sum(parts)

    low, high = ([x + more for x in side] for side, more in ((low, -0.01), (high, 0.01)))
    columns, rows = (round((b - a) / cell) for a, b in zip(low, high, strict=True))
    corners = []
    for i in range(rows + 1):
        for k in range(columns + 1):
            x = low[0] + (high[0] - low[0]) * k / columns
            y = low[1] + (high[1] - low[1]) * i / rows
            corners.append((x, y, height(x, y)))
    faces = [
        (i * (columns + 1) + k, i * (columns + 1) + k + 1, (i + 1) * (columns + 1) + k + 1,
         (i + 1) * (columns + 1) + k)
        for i in range(rows) for k in range(columns)
    ]  # fmt: skip
    sheet = mesh_object(name, [mat], corners, faces, smooth=True)
    finer = sheet.modifiers.new("Smooth", "SUBSURF")
    finer.levels, finer.render_levels = 1, 2
    return sheet


def ring() -> None:
    """Two rings of gold on paper, and in each the cusp of the light that it reflects."""
    gold = metal("Gold", (1.0, 0.72, 0.32), 0.0)
    paper = material("Paper", (0.74, 0.72, 0.68))
    block("Sheet", paper, (-0.3, -0.3, -0.01), (0.3, 0.3, 0))
    for x, y, turn in ((-0.014, 0.0, 0.0), (0.022, 0.016, 1.0)):
        # A band of 20 mm, inside first round to the outside.
        band = [(0.0100, -0.0002), (0.0100, 0.0052), (0.0103, 0.0055), (0.0111, 0.0055)]
        lathe("Ring", gold, [*band, (0.0114, 0.0052), (0.0114, -0.0002)], (x, y, turn * 1e-5), 128)
    lamp("SPOT", "Lamp", (-0.10, 0.055, 0.06), (0.0, 0.0, 0.0), energy=0.50,
         shadow_soft_size=0.0004, spot_size=math.radians(50), spot_blend=0.6,
         color=(1, 0.93, 0.82))  # fmt: skip
    world(0.05, (0.80, 0.88, 1.0))
    eye = camera((0.012, -0.052, 0.105), (0.005, 0.0065, 0.0), lens=68)
    eye.data.clip_start = 0.01


def glass_in_mirror() -> None:
    """A ball of glass and its caustics before a mirror, which shows them and sends light, too."""
    paper = material("Paper", (0.62, 0.58, 0.52))
    blue = material("Blue", (0.20, 0.34, 0.50))
    block("Table", paper, (-0.8, -0.8, -0.04), (0.8, 0.8, 0))
    block("Wall", blue, (-0.8, 0.5, -SUNK), (0.8, 0.54, 0.8))
    looking_glass = material("Looking glass", glossy=(0.9, 0.9, 0.9))
    block("Mirror", looking_glass, (-0.34, -0.01, 0.02), (0.34, 0.01, 0.40), (0, 0.26, 0), -14)
    sphere("Ball", glass("Glass", (0.96, 1, 0.97), GLASS), 0.08, (-0.02, 0, 0.08 - SUNK), 5)
    point_light(10, (0.06, -0.34, 0.42), (1, 0.93, 0.82))
    camera((0.34, -0.62, 0.40), (0.0, 0.07, 0.10), lens=42)


def sunlit_window() -> None:
    """A room that the sun lights through a pane of glass alone."""
    wall = material("Wall", (0.74, 0.72, 0.68))
    floor = material("Floor", (0.46, 0.29, 0.17))
    blue = material("Blue", (0.13, 0.24, 0.42))
    left, right, back, top = -1.6, 1.6, 3.6, 2.5
    closed_room((left, 0, 0), (right, back, top), floor, wall, (None, wall, wall, wall))
    window = {"y": (0, 1.0, 2.6, back), "z": (0, 0.8, 2.1, top)}
    wall_with_window("Window wall", [wall, wall, wall], (left, left - 0.2), **window)
    pane = glass("Pane", (0.97, 0.99, 0.98), GLASS)
    block(
        "Pane", pane, (left - 0.11, 1.0 - SUNK, 0.8 - SUNK), (left - 0.10, 2.6 + SUNK, 2.1 + SUNK)
    )
    block("Box", blue, (-0.3, -0.3, -SUNK), (0.3, 0.3, 0.55), (0.3, 2.3, 0), 24)
    lamp("SUN", "Sun", (-4.0, -0.8, 3.3), (0, 0.8, 0), energy=12, angle=0, color=(1, 0.92, 0.80))
    camera((-1.35, 0.15, 1.75), (0.45, 2.35, 0.55), lens=24)


def glass_bulb() -> None:
    """A ball that glows in a bulb of thin glass, above a table and beside a wall."""
    paper = material("Paper", (0.66, 0.62, 0.56))
    green = material("Green", (0.22, 0.42, 0.24))
    block("Table", paper, (-0.7, -0.7, -0.04), (0.7, 0.7, 0))
    block("Wall", green, (-0.7, 0.34, -SUNK), (0.7, 0.38, 0.7))
    middle, outside, thick = 0.24, 0.085, 0.004
    clear = glass("Glass", (1, 1, 1), GLASS)
    bulb = sphere("Bulb", clear, outside, (0, 0, middle), 5)
    shell = bulb.modifiers.new("Shell", "SOLIDIFY")
    shell.thickness, shell.offset = thick, -1
    filament = add_object("Filament", bulb.data)
    filament.location, filament.scale = bulb.location, [0.04492 / outside] * 3
    filament.material_slots[0].link = "OBJECT"
    filament.material_slots[0].material = glowing("Glow", (1, 0.72, 0.42), 12)
    block("Box", paper, (-0.06, -0.06, -SUNK), (0.06, 0.06, 0.10), (0.20, -0.10, 0), 30)
    camera((0.42, -0.80, 0.50), (0.02, 0.02, 0.14), lens=42)


def frosted_glass() -> None:
    """A ball of frosted glass, and the soft light that a panel sends through it."""
    paper = material("Paper", (0.68, 0.64, 0.58))
    frosted = glass("Frosted glass", (0.92, 0.97, 1), GLASS)
    node = frosted.node_tree.nodes["Glass BSDF"]
    node.distribution, node.inputs["Roughness"].default_value = "GGX", 0.35
    block("Table", paper, (-0.7, -0.7, -0.04), (0.7, 0.7, 0))
    sphere("Ball", frosted, 0.11, (0, 0, 0.11 - SUNK), 5)
    block("Box", paper, (-0.06, -0.06, -SUNK), (0.06, 0.06, 0.12), (0.24, 0.14, 0), 20)
    panel = glowing("Panel", (1, 0.94, 0.86), 24)
    block("Panel", panel, (-0.09, -0.09, 0), (0.09, 0.09, 0.01), (-0.34, 0.10, 0.46))
    camera((0.30, -0.66, 0.46), (0.04, 0.0, 0.06), lens=45)


def glowing(name: str, colour, strength: float) -> bpy.types.Material:
    """An Emission shader."""
    node = shader(name, "ShaderNodeEmission", colour)
    node.inputs["Strength"].default_value = strength
    return bpy.data.materials[name]


def glass(name: str, colour, ior: float) -> bpy.types.Material:
    """A smooth Glass BSDF."""
    node = shader(name, "ShaderNodeBsdfGlass", colour)
    node.inputs["Roughness"].default_value = 0
    node.inputs["IOR"].default_value = ior
    mat = bpy.data.materials[name]
    mat.diffuse_color = (*colour, 1)
    return mat


def shader(name: str, kind: str, colour) -> bpy.types.Node:
    """The one shader of a new material."""
    mat = bpy.data.materials.new(name)
    mat.use_nodes = True
    nodes = mat.node_tree.nodes
    nodes.remove(nodes["Principled BSDF"])
    node = nodes.new(kind)
    node.inputs["Color"].default_value = (*colour, 1)
    mat.node_tree.links.new(node.outputs[0], nodes["Material Output"].inputs["Surface"])
    return node


def metal(name: str, colour, roughness: float) -> bpy.types.Material:
    """A Principled BSDF that is all metal."""
    mat = principled(name, colour, roughness)
    mat.node_tree.nodes["Principled BSDF"].inputs["Metallic"].default_value = 1
    return mat


def textured(name: str, kind: str, one, other, scale: float) -> bpy.types.Material:
    """A Diffuse BSDF whose colour a texture mixes of two, by the object's coordinates."""
    mat = material(name, one)
    tree = mat.node_tree
    place, texture = tree.nodes.new("ShaderNodeTexCoord"), tree.nodes.new(kind)
    texture.inputs["Scale"].default_value = scale
    tree.links.new(place.outputs["Object"], texture.inputs["Vector"])
    base = tree.nodes["Diffuse BSDF"].inputs["Color"]
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
