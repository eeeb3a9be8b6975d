# SPDX-License-Identifier: GPL-3.0-or-later
"""Export point lights and spotlights with the powers that Cycles gives them."""

from __future__ import annotations

import math
from dataclasses import replace

import bpy
import numpy as np
from numpy.typing import NDArray

from ...photon.scene import MOST_BOUNCES, Light, point_light, spot_light
from .nodes import Graph, colour_of, value_of
from .report import Notes

# Two axes count as equally long within matrix_world's float32 rounding.
EVEN_SCALE = 1e-4
# How a light's sphere would be seen, by the RNA names of its object's ray visibility.
VISIBLE = {"visible_camera": "directly", "visible_glossy": "in mirrors"}
# RNA names of what only EEVEE knows, with their neutral values.
EEVEE_FACTORS = {"diffuse_factor": "Diffuse", "specular_factor": "Specular"}


def export_light(obj: bpy.types.Object, matrix: NDArray[np.float64], notes: Notes) -> Light | None:
    """Return the light placed by `matrix`, or None for kinds that are not simulated."""
    data = obj.data
    name = f"Light '{obj.name}'"
    if data.type not in ("POINT", "SPOT"):
        notes.ignored(name, f"{data.type.capitalize()} light", "only point and spot lights light")
        return None
    if not np.isfinite(matrix).all():
        notes.ignored(name, "Transform", "it is not finite, so the light is left out")
        return None
    note_light(obj, name, notes)
    power = light_power(data, name, notes)
    position, radius = _triple(matrix[:3, 3]), max(0.0, float(data.shadow_soft_size))
    light = point_light(obj.name, position, power, radius)
    if data.type == "SPOT":
        axis = -matrix[:3, 2]
        length = float(np.linalg.norm(axis))
        if length == 0.0:
            notes.ignored(name, "Transform", "its scale is zero, so the light is left out")
            return None
        scale = np.linalg.norm(matrix[:3, :3], axis=0)
        if scale.max() > scale.min() * (1.0 + EVEN_SCALE):
            notes.approximated(name, "Uneven scale", "its cone is drawn round, as if unscaled")
        size, blend = float(data.spot_size), float(data.spot_blend)
        direction = _triple(axis / length)
        light = spot_light(
            obj.name, position, power, direction, size=size, blend=blend, radius=radius
        )
    if not notes.mention(name):
        notes.exact(name, f"{data.type.capitalize()} light")
    return limited(light, data)


def light_power(data: bpy.types.Light, name: str, notes: Notes) -> tuple[float, float, float]:
    """Return P [W] per channel: energy, colour, exposure, temperature and a constant shader.

    Each factor was checked against the irradiance that Cycles renders.
    """
    power = np.array(data.color[:], np.float64) * data.energy
    power *= 2.0 ** getattr(data, "exposure", 0.0)  # Blender 4.4 on
    if getattr(data, "use_temperature", False):  # Blender 4.5 on
        power *= np.array(data.temperature_color[:], np.float64)
    if not getattr(data, "normalize", True):
        # Cycles multiplies by the sphere's area then, and by 4 when the radius is zero.
        radius = data.shadow_soft_size
        power *= 4.0 * math.pi * radius * radius if radius > 0.0 else 4.0
    # 5.1 deprecates the switch: there, a light with a tree uses it.
    if data.node_tree and (bpy.app.version >= (5, 1) or data.use_nodes):
        power *= shader_factor(data.node_tree, name, notes)
    if not np.isfinite(power).all():
        notes.approximated(name, "Power", f"{_numbers(power)} W is not finite: set to 0")
        power = np.where(np.isfinite(power), power, 0.0)
    if power.min() < 0.0:
        notes.approximated(name, "Negative power", f"{_numbers(power)} W is clamped to 0")
        power = power.clip(0.0)
    return _triple(power)


def shader_factor(tree: bpy.types.NodeTree, name: str, notes: Notes) -> NDArray[np.float64]:
    """Return colour times strength of the light's Emission node."""
    graph = Graph(tree, name, notes)
    node, scope = graph.surface("OUTPUT_LIGHT")
    if node is None or node.type != "EMISSION":
        notes.approximated(name, "Nodes", "no plain Emission: its own colour is used")
        return np.ones(3)
    strength = value_of(graph, node.inputs["Strength"], scope)
    return np.array(colour_of(graph, node.inputs["Color"], scope)) * strength


def limited(light: Light, data: bpy.types.Light) -> Light:
    """The light with its Cast Shadow and Max Bounces."""
    cycles = getattr(data, "cycles", None)
    bounces = min(getattr(cycles, "max_bounces", MOST_BOUNCES), MOST_BOUNCES)
    # Cycles had a switch of its own up to Blender 4.2.
    shadow = data.use_shadow and getattr(cycles, "cast_shadow", True)
    return replace(light, casts_shadow=bool(shadow), max_bounces=bounces)


def note_light(obj: bpy.types.Object, name: str, notes: Notes) -> None:
    """Write down what the light asks for and the renderer does not know."""
    data = obj.data
    cycles = getattr(data, "cycles", None)
    if getattr(cycles, "max_bounces", MOST_BOUNCES) < MOST_BOUNCES:
        what = "its light in mirrors may have bounced as often before; none of its caustics escape"
        notes.approximated(name, "Max Bounces", what)
    if data.shadow_soft_size > 0.0 and getattr(data, "use_soft_falloff", False):
        notes.approximated(
            name, "Soft Falloff", "rendered as a sphere; the light nearer than its size differs"
        )
    seen = " or ".join(how for flag, how in VISIBLE.items() if getattr(obj, flag, True))
    if data.shadow_soft_size > 0.0 and seen:
        notes.approximated(name, "Radius", f"its sphere lights, but is not seen {seen}")
    if getattr(data, "use_square", False):
        notes.approximated(name, "Square spot", "its cone is drawn round")
    if getattr(cycles, "is_portal", False):
        notes.ignored(name, "Portal")
    for flag, label in EEVEE_FACTORS.items():
        if getattr(data, flag, 1.0) != 1.0:
            notes.ignored(name, f"{label} factor", "as in Cycles")
    for flag, label in (("visible_diffuse", "Diffuse"), ("visible_glossy", "Glossy")):
        if not getattr(obj, flag, True):
            notes.ignored(name, "Ray Visibility", f"{label.lower()} surfaces are lit all the same")
    linking = getattr(obj, "light_linking", None)
    if linking and (linking.receiver_collection or linking.blocker_collection):
        notes.ignored(name, "Light Linking", "it lights every object")


def _triple(values: NDArray[np.float64]) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in values)
    return x, y, z


def _numbers(values: NDArray[np.float64]) -> str:
    return "(" + ", ".join(f"{value:g}" for value in values) + ")"
