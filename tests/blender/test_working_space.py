# SPDX-License-Identifier: GPL-3.0-or-later
"""Files whose colours are not linear Rec.709 (Blender 5.0 on)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import bpy
import numpy as np
import pytest

from addon.blender.export import sky

from .build import add_mesh, add_node, finish, new_world
from .node_cases import COLOUR, Case, U, node, scaled
from .test_nodes import compare

pytestmark = [
    pytest.mark.blender,
    pytest.mark.skipif(bpy.app.version < (5, 0), reason="all files are linear Rec.709"),
]

BLACKBODY = "ShaderNodeBlackbody"
CASES = (
    Case("blackbody of one temperature", node(BLACKBODY, {0: 3000.0}), 0.0, 2.0),
    Case("blackbody", node(BLACKBODY, {0: scaled(U, 2500.0, 9000.0)}), 0.0, 2.0),
    Case("a wavelength", node("ShaderNodeWavelength", {0: scaled(U, 420.0, 660.0)})),
    Case("grey", node("ShaderNodeRGBToBW", {0: COLOUR})),
    Case("grey of one colour", node("ShaderNodeRGBToBW", {0: (0.9, 0.5, 0.1, 1.0)})),
    Case("a colour as a number", node("ShaderNodeMath", {0: COLOUR, 1: 0.0}, operation="ADD")),
)


@pytest.fixture
def wide(scene) -> Iterator[None]:
    """In ACEScg."""
    bpy.ops.wm.set_working_color_space(working_space="ACEScg", convert_colors=False)
    yield
    bpy.ops.wm.set_working_color_space(working_space="Linear Rec.709", convert_colors=False)


def test_nodes(wide, export, cycles_mean, device) -> None:
    compare(export, cycles_mean, device, "fragment", CASES)


def test_worlds(wide, scene, export) -> None:
    """What Blender evaluates, as in this file."""
    add_mesh("Plane")
    scene.world = bpy.data.worlds.new("World")
    tree = scene.world.node_tree
    body = add_node(tree, BLACKBODY, Temperature=3000.0)
    background = add_node(tree, "ShaderNodeBackground")
    tree.links.new(body.outputs[0], background.inputs[0])
    finish(tree, background)
    (light,) = export()[0].lights
    lamp = bpy.data.lights.new("Lamp", "POINT")
    lamp.use_temperature, lamp.temperature = True, 3000.0
    assert np.allclose(light.power, lamp.temperature_color[:], rtol=0.01)


def test_the_middle_of_a_sun(wide, scene, monkeypatch) -> None:
    """Of its luminance in this file: as red on one side as it is blue on another, a quarter of the
    horizon away."""
    dark = np.zeros((4, 8, 3), np.float32)
    bright = dark.copy()
    bright[2, 1], bright[2, 3] = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)

    def evaluated(*given: Any) -> Any:
        return bright if "sun_size" in given[-1] else dark

    monkeypatch.setattr(sky, "evaluate", evaluated)
    node = new_world(scene).nodes.new("ShaderNodeTexSky")
    _, disc = sky.read_sky(node, node.outputs[0], ())
    x, y, _ = disc.direction
    angles = 0.625 * math.pi, 0.125 * math.pi
    red, blue = (-(x * math.cos(angle) + y * math.sin(angle)) for angle in angles)
    # Of ACEScg adapted to D65 by Bradford's matrix; of Rec.709 it is 2.9.
    assert red / blue == pytest.approx(0.2676 / 0.0580, rel=0.01)
