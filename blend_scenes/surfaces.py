# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials of node graphs, and the pictures that some of them show. Sizes are in metres."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import bpy
import numpy as np

Socket = bpy.types.NodeSocket
Stops = Sequence[tuple[float, Sequence[float]]]


class Graph:
    """Collects the nodes of a material around its Principled BSDF."""

    def __init__(self, name: str) -> None:
        self.material = bpy.data.materials.new(name)
        self.material.use_nodes = True
        self.tree = self.material.node_tree

    def add(self, kind: str, inputs: Mapping[str, Any] | None = None, **settings) -> bpy.types.Node:
        """A node; its inputs are values or other nodes' outputs."""
        node = self.tree.nodes.new(f"ShaderNode{kind}")
        for key, value in settings.items():
            setattr(node, key, value)
        self.put(node, inputs or {})
        return node

    def put(self, node: bpy.types.Node, inputs: Mapping[str, Any]) -> None:
        for name, value in inputs.items():
            socket = next(s for s in node.inputs if name in (s.identifier, s.name))
            if isinstance(value, Socket):
                self.tree.links.new(value, socket)
            elif socket.type == "RGBA":
                socket.default_value = (*value, 1)
            else:
                socket.default_value = value

    def place(self, kind: str = "Object") -> Socket:
        return self.add("TexCoord").outputs[kind]

    def mapped(self, vector: Socket, **inputs) -> Socket:
        return self.add("Mapping", {"Vector": vector, **inputs}).outputs[0]

    def noise(self, vector: Socket, scale: float, detail: float = 3.0, **more) -> Socket:
        inputs = {"Vector": vector, "Scale": scale, "Detail": detail, **more}
        return self.add("TexNoise", inputs).outputs["Fac"]

    def math(self, operation: str, a: Any, b: Any = 0.0, c: Any = 0.0) -> Socket:
        node = self.add("Math", operation=operation)
        for socket, value in zip(node.inputs, (a, b, c), strict=True):
            if isinstance(value, Socket):
                self.tree.links.new(value, socket)
            else:
                socket.default_value = value
        return node.outputs[0]

    def mix(self, fac: Any, a: Any, b: Any, blend: str = "MIX") -> Socket:
        inputs = {"Factor_Float": fac, "A_Color": a, "B_Color": b}
        node = self.add("Mix", inputs, data_type="RGBA", blend_type=blend)
        return next(s for s in node.outputs if s.identifier == "Result_Color")

    def ramp(self, fac: Socket, stops: Stops) -> Socket:
        node = self.add("ValToRGB", {"Fac": fac})
        elements = node.color_ramp.elements
        for _ in stops[2:]:
            elements.new(0.5)
        for element, (position, colour) in zip(elements, stops, strict=True):
            element.position, element.color = position, (*colour, 1)
        return node.outputs["Color"]

    def bump(self, height: Socket, distance: float, strength: float = 1.0) -> Socket:
        inputs = {"Height": height, "Distance": distance, "Strength": strength}
        return self.add("Bump", inputs).outputs[0]

    def made(self, inputs: Mapping[str, Any], shown=(0.6, 0.6, 0.6)) -> bpy.types.Material:
        """The material, when its surface's inputs are given; `shown` in the solid viewport."""
        self.put(self.tree.nodes["Principled BSDF"], inputs)
        self.material.diffuse_color = (*shown, 1)
        return self.material


def plain(name: str, colour, roughness: float = 0.5, **inputs) -> bpy.types.Material:
    """The same all over."""
    return Graph(name).made({"Base Color": colour, "Roughness": roughness, **inputs}, colour)


def wood(name: str, along: str) -> bpy.types.Material:
    """Grain along an axis of the object, in each object another, of the object's colour."""
    graph = Graph(name)
    info = graph.add("ObjectInfo").outputs
    other = graph.math("MULTIPLY", info["Random"], 17.0)
    inputs = {"Vector": graph.place(), "Vector_001": other}
    place = graph.add("VectorMath", inputs, operation="ADD").outputs[0]
    grain = graph.mapped(place, Scale=[1.1 if axis == along else 11.0 for axis in "XYZ"])
    inputs = {"Vector": grain, "Scale": 0.7, "Distortion": 9.0, "Detail": 3.0, "Detail Scale": 0.7}
    rings = graph.add("TexWave", inputs, bands_direction="DIAGONAL").outputs["Fac"]
    fine = graph.noise(grain, 11.0, 5.0, Roughness=0.65)
    fac = graph.math("MULTIPLY_ADD", rings, 0.45, fine)
    tones = [(0.36, (0.42, 0.36, 0.31)), (0.68, (0.76, 0.72, 0.68)), (0.98, (1.0, 1.0, 1.0))]
    colour = graph.mix(1.0, info["Color"], graph.ramp(fac, tones), "MULTIPLY")
    inputs = {"Base Color": colour, "Roughness": 0.42, "Normal": graph.bump(fine, 0.0012)}
    return graph.made(inputs, (0.42, 0.25, 0.12))


def bricks(
    name: str, axes: str, size, offset: float, mortar: float, colours, roughness: float
) -> bpy.types.Material:
    """Tiles in the plane of two axes: `colours` are two of tiles and that of the mortar."""
    graph = Graph(name)
    parts = graph.add("SeparateXYZ", {"Vector": graph.place()}).outputs
    flat = graph.add("CombineXYZ", {"X": parts[axes[0]], "Y": parts[axes[1]]}).outputs[0]
    inputs = {
        "Vector": flat, "Scale": 1.0, "Brick Width": size[0], "Row Height": size[1],
        "Mortar Size": mortar, "Mortar Smooth": 0.6, "Bias": 0.0,
        "Color1": colours[0], "Color2": colours[1], "Mortar": colours[2],
    }  # fmt: skip
    tiles = graph.add("TexBrick", inputs, offset=offset)
    cloud = graph.noise(graph.place(), 9.0, 4.0)
    stains = graph.ramp(cloud, [(0.25, (0.72, 0.70, 0.66)), (0.7, (1, 1, 1))])
    bump = graph.add(
        "Bump", {"Height": tiles.outputs["Fac"], "Distance": 0.6 * mortar}, invert=True
    )
    inputs = {
        "Base Color": graph.mix(1.0, tiles.outputs["Color"], stains, "MULTIPLY"),
        "Roughness": roughness,
        "Normal": bump.outputs[0],
    }
    return graph.made(inputs, colours[0])


def gingham(name: str, thread, dyed, squares: float) -> bpy.types.Material:
    """Checkered cloth of so many squares in a unit of its UV map; where dyed threads cross it is
    darkest."""
    graph = Graph(name)
    parts = graph.add("SeparateXYZ", {"Vector": graph.place("UV")}).outputs
    stripes = []
    for axis in "XY":
        one = graph.add("CombineXYZ", {"X": parts[axis], "Y": 0.5 / squares, "Z": 0.5 / squares})
        inputs = {"Vector": one.outputs[0], "Color1": dyed, "Color2": thread, "Scale": squares}
        stripes.append(graph.add("TexChecker", inputs).outputs["Color"])
    inputs = {
        "Base Color": graph.mix(1.0, *stripes, "MULTIPLY"),
        "Roughness": 0.85,
        "Sheen Weight": 0.25,
        "Sheen Roughness": 0.4,
    }
    return graph.made(inputs, dyed)


def dimpled(
    name: str, scale: float, fine: float, deep: float, tones: Stops, roughness: float
) -> bpy.types.Material:
    """Of the object's colour in cloudy tones, with bumps so fine and deep."""
    graph = Graph(name)
    clouds = graph.ramp(graph.noise(graph.place(), scale, 4.0), tones)
    bumps = graph.noise(graph.place(), fine, 3.0)
    colour = graph.mix(1.0, graph.add("ObjectInfo").outputs["Color"], clouds, "MULTIPLY")
    inputs = {"Base Color": colour, "Roughness": roughness, "Normal": graph.bump(bumps, deep)}
    return graph.made(inputs)


def apple_skin(name: str) -> bpy.types.Material:
    """Red streaks over yellow."""
    graph = Graph(name)
    streaks = graph.noise(graph.mapped(graph.place(), Scale=(1, 1, 0.3)), 55.0, 4.0)
    stops = [(0.36, (0.50, 0.42, 0.06)), (0.45, (0.52, 0.17, 0.03)), (0.54, (0.40, 0.025, 0.02))]
    inputs = {"Base Color": graph.ramp(streaks, stops), "Roughness": 0.28}
    return graph.made(inputs, (0.4, 0.05, 0.03))


def glaze(name: str, colour, low: float, high: float) -> bpy.types.Material:
    """Ceramic under a coat, with a band of the object's colour; heights are parts of the whole."""
    graph = Graph(name)
    place = graph.place("Generated")
    z = graph.add("SeparateXYZ", {"Vector": place}).outputs["Z"]
    wavy = graph.math("MULTIPLY_ADD", graph.noise(place, 6.0, 1.0), 0.06, z)
    within = graph.math("COMPARE", wavy, (low + high) / 2, (high - low) / 2)
    band = graph.add("ObjectInfo").outputs["Color"]
    inputs = {
        "Base Color": graph.mix(within, colour, band),
        "Roughness": 0.5,
        "Coat Weight": 1.0,
        "Coat Roughness": 0.16,
    }
    return graph.made(inputs, colour)


def printed(name: str, image: bpy.types.Image, roughness: float, **inputs) -> bpy.types.Material:
    """An image over the UV map; with "Alpha" the image's own cuts the surface out."""
    graph = Graph(name)
    node = graph.add("TexImage", {"Vector": graph.place("UV")}, image=image, extension="CLIP")
    given = {"Base Color": node.outputs["Color"], "Roughness": roughness}
    if inputs.pop("cut_out", False):
        given["Alpha"] = node.outputs["Alpha"]
    return graph.made({**given, **inputs}, (0.5, 0.5, 0.4))


def packed(name: str, pixels: Any) -> bpy.types.Image:
    """An image of bytes, sRGB, from (h, w, 4) of what they show, row 0 at the bottom."""
    height, width, _ = pixels.shape
    image = bpy.data.images.new(name, width, height, alpha=True)
    image.pixels.foreach_set(np.ascontiguousarray(pixels, np.float32).ravel())
    image.pack()
    return image


def smooth(x: Any) -> Any:
    t = np.clip(x, 0, 1)
    return t * t * (3 - 2 * t)


def leaf_picture(width: int = 96, height: int = 160) -> bpy.types.Image:
    """A leaf with veins; nothing around it."""
    v, u = np.mgrid[0:height, 0:width]
    u, v = (u + 0.5) / width * 2 - 1, (v + 0.5) / height
    edge = 0.95 * np.sin(np.pi * v**0.8) ** 0.75 * (1 + 0.05 * np.sin(46 * v))
    inside = np.abs(u) < edge
    side = np.abs((v * 9 - np.abs(u) * 2.2) % 1 - 0.5)
    vein = np.maximum(smooth(1 - np.abs(u) / 0.06), 0.7 * smooth(1 - side / 0.09))
    shade = 0.8 + 0.2 * np.sin(7 * v + 2 * u) * (1 - np.abs(u))
    dark, pale = np.array((0.16, 0.38, 0.12)), np.array((0.50, 0.64, 0.30))
    pixels = np.ones((height, width, 4))
    pixels[..., :3] = shade[..., None] * ((1 - vein)[..., None] * dark + vein[..., None] * pale)
    pixels[..., 3] = inside
    return packed("Leaf", pixels)


def landscape(width: int = 200, height: int = 150) -> bpy.types.Image:
    """Hills, a lake and a low sun."""
    v, u = np.mgrid[0:height, 0:width]
    u, v = (u + 0.5) / width, (v + 0.5) / height
    t = smooth((v - 0.4) / 0.6)[..., None]
    rgb = (1 - t) * (0.98, 0.80, 0.55) + t * (0.36, 0.58, 0.78)
    sun = np.hypot((u - 0.66) * width / height, v - 0.62)
    rgb += smooth(1 - sun / 0.35)[..., None] ** 2 * np.array((0.25, 0.16, 0.02))
    rgb = np.where((sun < 0.06)[..., None], (1.0, 0.93, 0.72), rgb)
    hills = ((0.52, 0.09, 3.1, 0.4, (0.55, 0.60, 0.68)), (0.45, 0.08, 5.3, 2.0, (0.38, 0.50, 0.48)),
             (0.38, 0.05, 8.0, 4.0, (0.22, 0.36, 0.26)))  # fmt: skip
    for level, high, number, phase, colour in hills:
        top = level + high * (np.sin(number * u + phase) + 0.4 * np.sin(2.7 * number * u + 2))
        rgb = np.where(
            (v < top)[..., None], np.array(colour) * (0.9 + 0.3 * (v / top))[..., None], rgb
        )
    lake = 0.30 + 0.01 * np.sin(9 * u)
    ripples = 0.5 + 0.5 * np.sin(150 * v + 14 * np.sin(5 * u + 40 * v))
    water = np.array((0.42, 0.56, 0.66)) + (ripples * smooth(1 - np.abs(u - 0.66) / 0.22))[
        ..., None
    ] * np.array((0.45, 0.28, 0.05))
    rgb = np.where((v < lake)[..., None], water, rgb)
    shore = 0.13 + 0.07 * np.sin(3.4 * u + 0.3) + 0.012 * np.sin(37 * u)
    grass = np.array((0.20, 0.30, 0.10)) * (0.7 + 0.5 * np.sin(90 * u + 33 * v) ** 2)[..., None]
    rgb = np.where((v < shore)[..., None], grass, rgb)
    trunk = (np.abs(u - 0.17 - 0.02 * np.sin(7 * v)) < 0.012) & (v > 0.1) & (v < 0.62)
    rgb = np.where(trunk[..., None], (0.20, 0.13, 0.09), rgb)
    for x, y, r in ((0.12, 0.66, 0.13), (0.21, 0.74, 0.14), (0.26, 0.62, 0.10), (0.17, 0.58, 0.09)):
        ball = np.hypot((u - x) * width / height, v - y)
        ragged = r * (1 + 0.10 * np.sin(23 * np.arctan2(v - y, u - x)))
        green = (
            np.array((0.17, 0.33, 0.13))
            * (0.75 + 3.5 * np.clip(v - y + u - x, -0.08, 0.2))[..., None]
        )
        rgb = np.where((ball < ragged)[..., None], green, rgb)
    pixels = np.ones((height, width, 4))
    pixels[..., :3] = np.clip(rgb, 0, 1)
    return packed("Landscape", pixels)
