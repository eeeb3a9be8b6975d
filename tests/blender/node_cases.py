# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes beside each other on one sheet: what a node gives is a square's colour under a sun straight
above, so that what is seen is the colour itself."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import bpy
import numpy as np
from mathutils import Euler, Matrix
from numpy.typing import NDArray

from addon.photon.scene import Scene
from addon.streams import Device
from tests.measure import MIDDLES, render

from .build import add_light, add_mesh, add_node, finish, new_material

Tree = bpy.types.NodeTree
Socket = bpy.types.NodeSocket
Build = Callable[[Tree], Socket]  # adds nodes to a material, and returns the output to look at
Picture = NDArray[np.float32]

TILT = Matrix.LocRotScale((0.3, -0.2, 0.4), Euler((0.3, 0.5, -0.7)), (1.3, 0.8, 0.6))
CELL = 16  # [px] of a square, which is 1 m wide
# A pixel is right if it is this near to Cycles', relative to it; or to a tenth, where it is darker.
NEAR, DARK = 0.01, 0.1
TELLING = 0.1  # least share of a square that is neither black nor white
FACES = 6  # along an uneven square's edge


@dataclass(frozen=True)
class Case:
    """A square of the sheet. What the output gives is mapped from [low, high] to [0, 1]."""

    name: str  # the node's, a colon, and what is special
    build: Build
    low: float = 0.0
    high: float = 1.0
    uneven: bool = False  # a smooth wave instead of a flat square
    dress: Callable[[bpy.types.Object], None] = field(default=lambda obj: None)


def node(
    kind: str,
    inputs: Mapping[str | int, Any] | None = None,
    output: str | int = 0,
    **options: Any,
) -> Build:
    """What builds a node: its inputs by name or index, each a number, numbers or what builds a
    socket; the output that is asked for; its properties."""

    def build(tree: Tree) -> Socket:
        made = add_node(tree, kind)
        for name, value in options.items():
            setattr(made, name, value)
        for key, value in (inputs or {}).items():
            socket = found(made.inputs, key)
            if callable(value):
                tree.links.new(value(tree), socket)
            else:
                socket.default_value = value
        return found(made.outputs, output)

    return build


def found(sockets: Sequence[Socket], key: str | int) -> Socket:
    """A socket by its index, or the one of a name that is in use."""
    if isinstance(key, int):
        return sockets[key]
    named = [socket for socket in sockets if key in (socket.name, socket.identifier)]
    return next((socket for socket in named if socket.enabled), named[0])


UV = node("ShaderNodeTexCoord", output="UV")  # from 0 to 1 across a square
U, V = (node("ShaderNodeSeparateXYZ", {0: UV}, output=axis) for axis in (0, 1))


def scaled(number: Build, low: float, high: float) -> Build:
    """From [0, 1] to [low, high]."""
    return node("ShaderNodeMath", {0: number, 1: high - low, 2: low}, operation="MULTIPLY_ADD")


def three(x: Any, y: Any, z: Any) -> Build:
    """A vector, or a colour, of three numbers."""
    return node("ShaderNodeCombineXYZ", {0: x, 1: y, 2: z})


# Every hue, in many strengths, and no two channels alike in a pixel; and others than these.
COLOUR = three(U, V, scaled(U, 0.98, 0.03))
OTHER = three(scaled(V, 0.9, 0.1), U, scaled(V, 0.2, 0.7))
# Each coordinate from -1.5 to 1.5.
VECTOR = three(scaled(U, -1.5, 1.5), scaled(V, -1.5, 1.5), scaled(U, 1.5, -1.5))


def turned(obj: bpy.types.Object) -> None:
    """The square as it is, but of a turned, stretched and moved object."""
    bpy.context.view_layer.update()
    placed = obj.matrix_world.copy()
    obj.matrix_world = placed @ TILT
    obj.data.transform(TILT.inverted())


def lay_out(cases: Sequence[Case]) -> tuple[int, int]:
    """Make the sheet in the open scene, row by row from below; how many squares wide and high."""
    columns = math.ceil(math.sqrt(len(cases)))
    rows = math.ceil(len(cases) / columns)
    for number, case in enumerate(cases):
        across, up = number % columns + 0.5, number // columns + 0.5
        obj = add_mesh(case.name, location=(across, up, 0.0), scale=(0.5, 0.5, 0.5))
        obj.data = _wave() if case.uneven else obj.data
        _unwrap(obj.data)
        obj.data.materials.append(_material(case))
        case.dress(obj)
    scene = bpy.context.scene
    camera = scene.camera
    camera.location = (columns / 2, rows / 2, 10.0)
    camera.data.type, camera.data.ortho_scale = "ORTHO", max(columns, rows)
    scene.render.resolution_x, scene.render.resolution_y = CELL * columns, CELL * rows
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "GAUSSIAN", 0.01
    add_light("Sun", "SUN", energy=math.pi, angle=0.0, location=(0.0, 0.0, 5.0))
    return columns, rows


def _material(case: Case) -> bpy.types.Material:
    material, tree = new_material(case.name)
    output = case.build(tree)
    if (case.low, case.high) != (0.0, 1.0):
        size = 1.0 / (case.high - case.low)
        inputs = {0: lambda _: output, 1: (size,) * 3, 2: (-case.low * size,) * 3}
        output = node("ShaderNodeVectorMath", inputs, operation="MULTIPLY_ADD")(tree)
    finish(tree, add_node(tree, "ShaderNodeBsdfDiffuse", Color=output))
    return material


def _wave() -> bpy.types.Mesh:
    """QUAD, but smooth and uneven: up to 0.3 high."""
    ends = np.linspace(-1.0, 1.0, FACES + 1)
    heights = np.sign(ends) * np.abs(ends) ** 1.07  # no pixel's middle is on an edge
    points = [
        (x, y, 0.3 * math.sin(3.0 * x + 1.0) * math.cos(2.0 * y)) for y in heights for x in ends
    ]
    at = [row * (FACES + 1) + column for row in range(FACES) for column in range(FACES)]
    mesh = bpy.data.meshes.new("Wave")
    mesh.from_pydata(points, [], [(i, i + 1, i + FACES + 2, i + FACES + 1) for i in at])
    mesh.shade_smooth()
    return mesh


def _unwrap(mesh: bpy.types.Mesh) -> None:
    uv = mesh.uv_layers.new(name="UVMap").data
    for loop in mesh.loops:
        x, y, _ = mesh.vertices[loop.vertex_index].co
        uv[loop.index].uv = (0.5 + 0.5 * x, 0.5 + 0.5 * y)


def render_sheet(device: Device, scene: Scene, columns: int, rows: int, backend: str) -> Picture:
    """The direct light of an exported sheet, (h, w, 3)."""
    frame = {"width": CELL * columns, "height": CELL * rows}
    images = render(device, scene, backend=backend, photons=0, **frame, **MIDDLES)
    return np.asarray(images["Direct"][..., :3], np.float32)


def wrong_pixels(
    cases: Sequence[Case], columns: int, ours: Picture, cycles: Picture
) -> dict[str, float]:
    """By the case's name, the share of pixels that are not near to Cycles'; 1 if hardly any would
    tell. Albedos end at 1 with us."""
    cycles = cycles.clip(0.0, 1.0)
    tolerance = NEAR * np.maximum(np.abs(cycles), DARK)
    bad = ~(np.abs(ours - cycles) <= tolerance).all(axis=2)  # also where something is NaN
    shares = {}
    for number, case in enumerate(cases):
        across, up = CELL * (number % columns), CELL * (number // columns)
        square = slice(up, up + CELL), slice(across, across + CELL)
        tells = (cycles[square] > 0.0) & (cycles[square] < 1.0)
        shares[case.name] = float(bad[square].mean()) if tells.mean() > TELLING else 1.0
    return shares


def first_of_each(sheets: Mapping[str, Sequence[Case]]) -> list[Case]:
    """One case of each node: names begin with the node's and a colon."""
    firsts: dict[str, Case] = {}
    for cases in sheets.values():
        for case in cases:
            firsts.setdefault(case.name.partition(":")[0], case)
    return list(firsts.values())
