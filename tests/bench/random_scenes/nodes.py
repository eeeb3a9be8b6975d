# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials and worlds of nodes by chance: every choice and number of a node that Blender has."""

from __future__ import annotations

import random
from contextlib import suppress
from typing import Any

import bpy
import numpy as np

from tests.blender.build import finish, new_material, new_world

Tree, Node, Socket = bpy.types.NodeTree, bpy.types.Node, bpy.types.NodeSocket

TEXTURES = [
    "TexNoise",
    "TexVoronoi",
    "TexWave",
    "TexChecker",
    "TexBrick",
    "TexMagic",
    "TexGradient",
    "TexWhiteNoise",
    "TexImage",
]
SLOW = ["TexGabor"]  # for worlds, which Cycles evaluates in each direction
NUMBERS = [
    "Math",
    "MapRange",
    "Clamp",
    "Fresnel",
    "LayerWeight",
    "NewGeometry",
    "ObjectInfo",
    "RGBToBW",
    "SeparateXYZ",
    "LightPath",
    "VertexColor",
    "VectorMath",
]
COLOURS = [
    "ValToRGB",
    "MixRGB",
    "HueSaturation",
    "Gamma",
    "BrightContrast",
    "Invert",
    "RGBCurve",
    "CombineColor",
    "VectorCurve",
]
SHADERS = [
    "BsdfDiffuse",
    "BsdfPrincipled",
    "BsdfPrincipled",
    "BsdfAnisotropic",
    "BsdfMetallic",
    "BsdfGlass",
    "BsdfTranslucent",
    "BsdfSheen",
    "BsdfTransparent",
    "BsdfToon",
    "Emission",
    "MixShader",
]
COORDINATES = ["Generated", "Object", "UV", "Normal", "Camera", "Window", "Reflection"]
OF_DIRECTIONS = ["Generated", "Object", "Normal", "Reflection"]
# What numbers of an input are by chance, by its name; others are between 0 and 1.
RANGES = {
    "Scale": (0.5, 6.0),
    "Detail": (0.0, 6.0),
    "Distortion": (0.0, 1.5),
    "Lacunarity": (1.5, 3.0),
    "W": (-3.0, 3.0),
    "IOR": (1.05, 2.0),
    "Coat IOR": (1.2, 2.0),
    "Exponent": (0.3, 3.0),
    "Gamma": (0.3, 2.5),
    "Saturation": (0.0, 2.0),
    "Emission Strength": (0.0, 2.0),
    "Strength": (0.2, 3.0),
    "Mortar Size": (0.0, 0.1),
    "Row Height": (0.1, 0.5),
    "Brick Width": (0.2, 1.0),
}
# Of Principled, mostly 0; of rough glass Cycles counts what no microfacet does.
SELDOM = ("Transmission Weight", "Coat Weight", "Sheen Weight", "Emission Strength", "Anisotropic")
GLASSY_ROUGHNESS = 0.15
# Inputs that a texture may tell from place to place.
TOLD = (
    "Roughness",
    "Metallic",
    "Alpha",
    "IOR",
    "Specular IOR Level",
    "Diffuse Roughness",
    "Transmission Weight",
    "Coat Weight",
    "Coat Roughness",
    "Sheen Weight",
    "Sheen Roughness",
    "Emission Strength",
    "Anisotropic",
    "Anisotropy",
    "Rotation",
    "Size",
    "Smooth",
    "Fac",
    "Factor",
)
# Inputs and choices that the report names as approximated or left out.
LEFT_OUT = ("Weight", "Subsurface Weight", "Thin Film Thickness", "Coat Normal", "Tangent")
NOT_CHOSEN = {"BECKMANN", "ASHIKHMIN_SHIRLEY", "PHYSICAL_CONDUCTOR", "ASHIKHMIN"}


class Nodes:
    """Makes nodes in a tree by numbers of a seed."""

    def __init__(self, dice: random.Random, tree: Tree, is_world: bool = False) -> None:
        self.dice, self.tree, self.is_world = dice, tree, is_world

    def chance(self, share: float) -> bool:
        return self.dice.random() < share

    def made(self, kind: str) -> Node:
        """A node with its choices and inputs by chance."""
        node = self.tree.nodes.new(f"ShaderNode{kind}")
        for name, kept in node.bl_rna.properties.items():
            if name in bpy.types.Node.bl_rna.properties or kept.is_readonly:
                continue
            if kept.type == "ENUM" and not kept.is_enum_flag:
                self._choose(node, name)
            elif kept.type == "BOOLEAN":
                setattr(node, name, self.chance(0.3))
        for socket in node.inputs:
            if socket.enabled and socket.name not in LEFT_OUT:
                self._fill(node, socket)
        if kind == "BsdfPrincipled":
            self._scatter_below(node)
        return node

    def _scatter_below(self, node: Node) -> None:
        """By chance, of numbers of its own: what else a seed makes stays as it was."""
        dice = random.Random(str(tuple(node.inputs["Base Color"].default_value)))
        if dice.random() < 0.2:
            node.inputs["Subsurface Weight"].default_value = dice.choice((0.4, 1.0))
            node.inputs["Subsurface Scale"].default_value = dice.uniform(0.02, 0.5)
            if "Subsurface Anisotropy" in node.inputs:  # which the method says
                node.inputs["Subsurface Anisotropy"].default_value = 0.0

    def _choose(self, node: Node, name: str) -> None:
        allowed = [x.identifier for x in node.bl_rna.properties[name].enum_items]
        allowed = [x for x in allowed if x not in NOT_CHOSEN]
        with suppress(TypeError):  # Blender lists more than this node may have
            setattr(node, name, self.dice.choice(allowed))

    def _fill(self, node: Node, socket: Socket) -> None:
        low, high = RANGES.get(socket.name, (0.0, 1.0))
        if socket.type == "VALUE":
            number = self.dice.uniform(low, high)
            if socket.name in SELDOM and node.type == "BSDF_PRINCIPLED" and self.chance(0.7):
                number = 0.0
            if socket.name == "Roughness" and node.type in ("BSDF_GLASS", "BSDF_PRINCIPLED"):
                is_glass = (
                    node.type == "BSDF_GLASS" or node.inputs["Transmission Weight"].default_value
                )
                number *= GLASSY_ROUGHNESS if is_glass else 1.0
            socket.default_value = number
        elif socket.type == "RGBA":
            socket.default_value = (*(self.dice.uniform(0.05, 0.9) for _ in range(3)), 1.0)

    def link(self, output: Socket, node: Node, name: str | int) -> None:
        self.tree.links.new(output, node.inputs[name])

    def coordinate(self) -> Socket:
        """Where a texture is asked, maybe mapped."""
        names = OF_DIRECTIONS if self.is_world else COORDINATES
        output = self.tree.nodes.new("ShaderNodeTexCoord").outputs[self.dice.choice(names)]
        if self.chance(0.5):
            mapping = self.made("Mapping")
            for name in ("Location", "Rotation", "Scale"):
                if name in mapping.inputs and mapping.inputs[name].enabled:
                    mapping.inputs[name].default_value = [self.dice.uniform(0.3, 2) for _ in "xyz"]
            self.link(output, mapping, "Vector")
            output = mapping.outputs[0]
        return output

    def texture(self) -> Socket:
        node = self.made(self.dice.choice(TEXTURES + SLOW * (not self.is_world)))
        if node.type == "TEX_IMAGE":
            node.image = picture(self.dice)
        vector = node.inputs.get("Vector")
        if vector and vector.enabled and self.chance(0.8):
            self.link(self.coordinate(), node, "Vector")
        return self.dice.choice([output for output in node.outputs if output.enabled])

    def value(self, depth: int = 0) -> Socket:
        """An output of numbers or colours."""
        if depth > 2 or self.chance(0.4):
            return self.texture()
        node = self.made(self.dice.choice(NUMBERS + COLOURS))
        inputs = [x for x in node.inputs if x.enabled and x.type in ("VALUE", "RGBA", "VECTOR")]
        for socket in inputs[:2]:
            if socket.name not in ("Normal", "IOR", "Blend") and self.chance(0.7):
                self.tree.links.new(self.value(depth + 1), socket)
        if node.type == "VALTORGB":
            node.color_ramp.elements[0].color = (*(self.dice.random() for _ in "rgb"), 1.0)
        return self.dice.choice([output for output in node.outputs if output.enabled])

    def reflectance(self) -> Socket:
        """A colour between 0 and 0.9: Cycles has others, of which it makes nothing that lasts."""
        clamped = self.tree.nodes.new("ShaderNodeMixRGB")
        clamped.use_clamp, clamped.inputs[0].default_value = True, 0.1
        clamped.inputs[2].default_value = (0.0, 0.0, 0.0, 1.0)
        self.tree.links.new(self.value(), clamped.inputs[1])
        return clamped.outputs[0]

    def shader(self, depth: int = 0) -> Socket:
        kind = self.dice.choice(SHADERS)
        if kind == "MixShader" and depth > 1:
            kind = "BsdfDiffuse"
        node = self.made(kind)
        if kind == "MixShader":
            for number in (1, 2):
                self.link(self.shader(depth + 1), node, number)
        for name in ("Color", "Base Color"):
            if name in node.inputs and self.chance(0.4):
                self.link(self.reflectance(), node, name)
        for socket in node.inputs:
            if socket.enabled and socket.type == "VALUE" and socket.name in TOLD:
                self._tell(socket)
        if "Normal" in node.inputs and not depth and self.chance(0.25):
            bent = self._mapped if self.chance(0.3) else self._bumped
            self.link(bent(), node, "Normal")
        return node.outputs[0]

    def _tell(self, socket: Socket) -> None:
        """Up to twice what it is, by a texture, maybe."""
        own = socket.default_value
        if own > 0.0 and self.chance(0.15):
            ranged = self.tree.nodes.new("ShaderNodeMapRange")
            ranged.inputs["To Min"].default_value = 1.01 if socket.name == "IOR" else 0.0
            ranged.inputs["To Max"].default_value = min(2.0 * own, 2.0 if own > 1.0 else 1.0)
            self.tree.links.new(self.value(), ranged.inputs["Value"])
            self.tree.links.new(ranged.outputs[0], socket)

    def displace(self, material: bpy.types.Material, output: Node) -> None:
        """Let a texture move the surface, bend it as if it did, or both."""
        material.displacement_method = self.dice.choice(["DISPLACEMENT", "BOTH", "BUMP"])
        if self.chance(0.7):
            node = self.made("Displacement")
            self.link(self.texture(), node, "Height")
            node.inputs["Scale"].default_value = self.dice.uniform(0.02, 0.4)
        else:
            node = self.made("VectorDisplacement")
            self.link(self.texture(), node, "Vector")
            node.inputs["Scale"].default_value = self.dice.uniform(0.02, 0.3)
        node.space = self.dice.choice(["OBJECT", "WORLD"])
        node.inputs["Midlevel"].default_value = self.dice.uniform(0.0, 1.0)
        self.tree.links.new(node.outputs[0], output.inputs["Displacement"])

    def _bumped(self) -> Socket:
        bump = self.made("Bump")
        bump.inputs["Distance"].default_value = self.dice.uniform(0.01, 0.2)
        self.link(self.texture(), bump, "Height")
        return bump.outputs[0]

    def _mapped(self) -> Socket:
        node = self.made("NormalMap")
        node.inputs["Strength"].default_value = self.dice.uniform(0.1, 1.0)
        mixed = self.tree.nodes.new("ShaderNodeMixRGB")
        mixed.inputs[0].default_value = 0.3
        mixed.inputs[1].default_value = (0.5, 0.5, 1.0, 1.0)
        self.tree.links.new(self.texture(), mixed.inputs[2])
        self.link(mixed.outputs[0], node, "Color")
        return node.outputs[0]


def picture(dice: random.Random) -> bpy.types.Image:
    """Soft spots of colours."""
    width, height = dice.choice([(64, 64), (128, 32), (57, 93)])
    image = bpy.data.images.new(
        "Spots", width, height, alpha=True, float_buffer=dice.random() < 0.3
    )
    pixels = np.random.default_rng(dice.randint(0, 1 << 30)).random((height, width, 4))
    shifts = [(i, j) for i in range(-3, 4) for j in range(-3, 4)]
    pixels = sum(np.roll(pixels, shift, (0, 1)) for shift in shifts) / len(shifts)
    pixels = np.clip((pixels - 0.5) * 4.0 + 0.5, 0.0, 1.0)
    pixels[..., 3] = 1.0
    image.pixels.foreach_set(pixels.astype(np.float32).ravel())
    image.pack()
    return image


def material(dice: random.Random) -> bpy.types.Material:
    made, tree = new_material("Material")
    output = next(node for node in tree.nodes if node.type == "OUTPUT_MATERIAL")
    tree.links.new(Nodes(dice, tree).shader(), output.inputs["Surface"])
    apart = random.Random(repr(dice.getstate()))  # so that seeds stay the scenes that they were
    if apart.random() < 0.25:
        Nodes(apart, tree).displace(made, output)
    return made


def world(dice: random.Random, scene: Any) -> bool:
    """Whether it gives light."""
    tree = new_world(scene)
    kind = dice.choice(["dark", "colour", "sky", "nodes", "image"])
    nodes = Nodes(dice, tree, is_world=True)
    background = nodes.made("Background")
    background.inputs["Strength"].default_value = dice.uniform(0.1, 0.7) * (kind != "dark")
    if kind == "sky":
        sky = nodes.made("TexSky")
        sky.sun_elevation = dice.uniform(0.1, 1.4)
        background.inputs["Strength"].default_value *= 0.3
        nodes.link(sky.outputs[0], background, "Color")
    elif kind == "nodes":
        nodes.link(nodes.value(), background, "Color")
    elif kind == "image":
        texture = nodes.made("TexEnvironment")
        texture.image = picture(dice)
        nodes.link(texture.outputs[0], background, "Color")
    finish(tree, background)
    return kind != "dark"
