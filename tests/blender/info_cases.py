# SPDX-License-Identifier: GPL-3.0-or-later
"""What nodes know of surfaces, objects and the viewer, on a sheet."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy
import numpy as np

from .node_cases import VECTOR, Case, U, node, scaled, turned

FRESNEL, LAYER = "ShaderNodeFresnel", "ShaderNodeLayerWeight"
ATTRIBUTE, COORDINATE = "ShaderNodeAttribute", "ShaderNodeTexCoord"
UNEVEN: dict[str, Any] = {"uneven": True}
DOMAINS = ("POINT", "CORNER", "FACE", "EDGE")
TYPES = {
    "FLOAT": ("value", 1),
    "INT": ("value", 1),
    "BOOLEAN": ("value", 1),
    "FLOAT2": ("vector", 2),
    "FLOAT_VECTOR": ("vector", 3),
    "FLOAT_COLOR": ("color", 4),
    "BYTE_COLOR": ("color", 4),
}


def with_attribute(name: str, kind: str, domain: str) -> Callable[[bpy.types.Object], None]:
    """Give a mesh an attribute of random numbers."""

    def dress(obj: bpy.types.Object) -> None:
        data = obj.data.attributes.new(name, kind, domain).data
        of_value, width = TYPES[kind]
        drawn = np.random.default_rng(5).random(len(data) * width)
        whole = {"INT": 4.0, "BOOLEAN": 2.0}.get(kind)
        data.foreach_set(of_value, np.floor(whole * drawn).astype(int) if whole else drawn)

    return dress


def in_pieces(obj: bpy.types.Object) -> None:
    """Four islands, from flat to uneven."""
    wave = obj.data
    places = np.empty(3 * len(wave.vertices), np.float32)
    wave.vertices.foreach_get("co", places)
    places = places.reshape(-1, 3) * (0.5, 0.5, 1.0)
    faces = np.array([face.vertices[:] for face in wave.polygons])
    pieces, count = [], len(places)
    for number, middle in enumerate(((-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5), (0.5, 0.5))):
        pieces.append(places * (1.0, 1.0, 0.3 * number) + (*middle, 0.0))
    obj.data = bpy.data.meshes.new("Pieces")
    every = np.concatenate([faces + count * number for number in range(4)])
    obj.data.materials.append(wave.materials[0])
    obj.data.from_pydata(np.concatenate(pieces).tolist(), [], every.tolist())


def with_group(obj: bpy.types.Object) -> None:
    """A vertex group, of some of the vertices."""
    group = obj.vertex_groups.new(name="Group")
    for number in range(0, len(obj.data.vertices), 2):
        group.add([number], 0.1 + 0.8 * number / len(obj.data.vertices), "REPLACE")


def with_properties(obj: bpy.types.Object) -> None:
    bpy.context.scene["amount"] = 0.6
    obj["amount"], obj["tint"] = 0.35, (0.2, 0.7, 0.4)
    obj.color, obj.pass_index = (0.3, 0.6, 0.9, 0.4), 3


def _geometry(output: str) -> Case:
    built = node("ShaderNodeNewGeometry", output=output)
    low, high = (0.0, 16.0) if output == "Position" else (-1.0, 1.0)
    return Case(f"Geometry: {output}", built, low, high, uneven=True)


def _named(kind: str, domain: str, output: str) -> Case:
    built = node(ATTRIBUTE, output=output, attribute_name="Some")
    dress = with_attribute("Some", kind, domain)
    high = 3.0 if kind == "INT" else 1.0
    return Case(f"Attribute: {kind} {domain} {output}", built, -0.5, high, uneven=True, dress=dress)


def _property(name: str, output: str, of: str = "OBJECT") -> Case:
    built = node(ATTRIBUTE, output=output, attribute_name=name, attribute_type=of)
    return Case(f"Attribute: {of} {name} {output}", built, -0.1, 1.1, dress=with_properties)


def _info(output: str, high: float = 1.1) -> Case:
    built = node("ShaderNodeObjectInfo", output=output)
    return Case(f"Object Info: {output}", built, -0.1, high, dress=with_properties)


FALLOFF = "ShaderNodeLightFalloff"
NORMAL = node("ShaderNodeVectorMath", {0: VECTOR}, operation="NORMALIZE")
CASES = (
    *map(_geometry, ("Position", "Normal", "Tangent", "True Normal", "Incoming", "Parametric")),
    Case("Geometry: Backfacing", node("ShaderNodeNewGeometry", output="Backfacing"), -1.0, 1.0),
    *(
        Case(
            f"Geometry: {x}", node("ShaderNodeNewGeometry", output=x), uneven=True, dress=in_pieces
        )
        for x in ("Pointiness", "Random Per Island")
    ),
    *(
        Case(f"Wireframe: {x}", node("ShaderNodeWireframe", {0: size}), -1.0, 2.0, uneven=True)
        for x, size in (("size", 0.1), ("varying", scaled(U, 0.3, 0.02)))
    ),
    *(Case(f"Fresnel: {x}", node(FRESNEL, {0: x}), **UNEVEN) for x in (0.7, 1.45, 4.0)),
    Case("Fresnel: varying", node(FRESNEL, {0: scaled(U, 0.6, 3.0)}), **UNEVEN),
    Case("Fresnel: by a normal", node(FRESNEL, {0: 1.5, 1: NORMAL}), **UNEVEN),
    *(
        Case(f"Layer Weight: {output} {blend}", node(LAYER, {0: blend}, output), **UNEVEN)
        for output in ("Fresnel", "Facing")
        for blend in (0.2, 0.5, 0.9)
    ),
    Case("Layer Weight: varying", node(LAYER, {0: U, 1: NORMAL}, "Facing"), **UNEVEN),
    *(
        Case(f"Camera Data: {name}", node("ShaderNodeCameraData", output=name), *ends, uneven=True)
        for name, ends in (
            ("View Vector", (-1.0, 1.2)),
            ("View Z Depth", (9.5, 10.5)),
            ("View Distance", (9.0, 13.0)),
        )
    ),
    Case("Light Path: camera", node("ShaderNodeLightPath", output="Is Camera Ray"), 0.0, 1.5),
    Case("Light Path: glossy", node("ShaderNodeLightPath", output="Is Glossy Ray"), -1.0, 1.0),
    Case("Light Path: length", node("ShaderNodeLightPath", output="Ray Length"), 8.0, 11.0, True),
    *(
        Case(f"Light Falloff: {x} {smooth}", node(FALLOFF, {0: 0.5, 1: smooth}, x), *ends, True)
        for smooth in (0.0, 40.0)
        for x, ends in (
            ("Quadratic", (0.0, 1.0)),
            ("Linear", (2.0, 6.0)),
            ("Constant", (20.0, 70.0)),
        )
    ),
    Case("Light Path: depth", node("ShaderNodeLightPath", output="Ray Depth"), -1.0, 1.0),
    *(
        Case(f"Texture Coordinate: {name}", node(COORDINATE, output=name), *ends, True, turned)
        for name, ends in (
            ("Generated", (-0.1, 1.1)),
            ("Normal", (-1.0, 1.0)),
            ("Object", (-2.0, 2.0)),
            ("Camera", (-10.0, 12.0)),
            ("Window", (-0.1, 1.1)),
            ("Reflection", (-1.0, 1.2)),
        )
    ),
    *(_named(kind, domain, "Color") for kind in TYPES for domain in DOMAINS),
    *(_named(kind, "POINT", output) for kind in TYPES for output in ("Factor", "Alpha")),
    Case("Attribute: UV map", node(ATTRIBUTE, output="Vector", attribute_name="UVMap"), -0.1, 1.1),
    Case(
        "Attribute: vertex group",
        node(ATTRIBUTE, output="Factor", attribute_name="Group"),
        -0.1,
        1.1,
        uneven=True,
        dress=with_group,
    ),
    *(
        Case(
            f"{label}: {name}, a name that Cycles keeps",
            node(kind, **{key: name}),
            -0.1,
            1.1,
            uneven=True,
            dress=with_attribute(name, "FLOAT_COLOR", "POINT"),
        )
        for name in ("color", "density", "generated", "uv")
        for label, kind, key in (
            ("Attribute", ATTRIBUTE, "attribute_name"),
            ("Color Attribute", "ShaderNodeVertexColor", "layer_name"),
        )
    ),
    Case("Attribute: none", node(ATTRIBUTE, attribute_name="Nothing"), -1.0, 1.0),
    *(_property("amount", x) for x in ("Color", "Factor", "Alpha")),
    *(_property("tint", x) for x in ("Color", "Factor", "Vector", "Alpha")),
    _property("color", "Color"),
    _property("tint", "Color", "INSTANCER"),
    _property("nothing", "Color"),
    _property("amount", "Color", "VIEW_LAYER"),
    Case(
        "Color Attribute: named",
        node("ShaderNodeVertexColor", layer_name="Some"),
        uneven=True,
        dress=with_attribute("Some", "BYTE_COLOR", "CORNER"),
    ),
    Case(
        "Color Attribute: active",
        node("ShaderNodeVertexColor", output="Alpha"),
        uneven=True,
        dress=with_attribute("Other", "FLOAT_COLOR", "POINT"),
    ),
    Case("Color Attribute: none", node("ShaderNodeVertexColor", output="Alpha"), -1.0, 1.0),
    _info("Location", 20.0),
    *map(_info, ("Color", "Alpha", "Random")),
    _info("Object Index", 4.0),
    *(
        Case(
            f"Tangent: {axis}",
            node("ShaderNodeTangent", direction_type="RADIAL", axis=axis),
            -1.1,
            1.1,
            uneven=True,
            dress=turned,
        )
        for axis in "XYZ"
    ),
    Case(
        "Tangent: UV",
        node("ShaderNodeTangent", direction_type="UV_MAP", uv_map="UVMap"),
        -1.1,
        1.1,
        uneven=True,
    ),
    *(
        Case(f"{kind} Info: none", node(f"ShaderNode{kind}Info"), -1.0, 1.0)
        for kind in ("Hair", "Point", "Particle")
    ),
)
