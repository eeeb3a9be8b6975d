# SPDX-License-Identifier: GPL-3.0-or-later
"""Files whose colours are not linear Rec.709 (Blender 5.0 on)."""

from __future__ import annotations

from collections.abc import Iterator

import bpy
import numpy as np
import pytest

from .build import add_mesh, add_node, finish
from .node_cases import COLOUR, Case, U, node, scaled
from .test_nodes import compare

pytestmark = [
    pytest.mark.blender,
    pytest.mark.skipif(bpy.app.version < (5, 0), reason="all files are linear Rec.709"),
]

BLACKBODY = "ShaderNodeBlackbody"
CASES = (
    Case("a glow of one temperature", node(BLACKBODY, {0: 3000.0}), 0.0, 2.0),
    Case("a glow", node(BLACKBODY, {0: scaled(U, 2500.0, 9000.0)}), 0.0, 2.0),
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
    glow = add_node(tree, BLACKBODY, Temperature=3000.0)
    background = add_node(tree, "ShaderNodeBackground")
    tree.links.new(glow.outputs[0], background.inputs[0])
    finish(tree, background)
    (light,) = export()[0].lights
    lamp = bpy.data.lights.new("Lamp", "POINT")
    lamp.use_temperature, lamp.temperature = True, 3000.0
    assert np.allclose(light.power, lamp.temperature_color[:], rtol=0.01)
