# SPDX-License-Identifier: GPL-3.0-or-later
"""IES files: what is read of them, from text blocks and from the disk, and what light it makes."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest

from addon.blender.export.lights.ies import COLUMNS, ROWS, WATTS, read_ies

from .build import add_light, add_node, nodes_of

pytestmark = pytest.mark.blender

POLAR = (0.0, 30.0, 60.0, 90.0)


def ies(vertical, horizontal, candela, kind: int = 1, tilt: str = "NONE") -> str:
    """A file of a lamp, of twice the candela that stand in it."""
    rows = [" ".join(f"{candela(h, v):.4f}" for v in vertical) for h in horizontal]
    sizes = f"1 1000 2.0 {len(vertical)} {len(horizontal)} {kind} 1 0 0 0"
    head = ["IESNA:LM-63-2002", "[TEST] none", f"TILT={tilt}", sizes, "1.0 1.0 100"]
    angles = [" ".join(map(str, vertical)), ",".join(map(str, horizontal))]
    return "\n".join([*head, *angles, *rows, ""])


def bowl(h: float, v: float) -> float:
    return 100.0 + v + 10.0 * math.cos(math.radians(h))


@pytest.mark.parametrize(
    "horizontal", [(0, 90), (0, 90, 180), (0, 90, 180, 270, 360), (0, 90, 180, 270)]
)
def test_what_is_given_of_it_is_mirrored(horizontal) -> None:
    """Where it is given, it is what the file says."""
    found = read_ies(ies(POLAR, horizontal, bowl))
    assert found
    np.testing.assert_allclose(found.horizontal, (0, 90, 180, 270, 360))
    given = np.array([90.0 * x for x in range(4)])
    at = found.at(given, np.array(POLAR))
    expected = [[bowl(h if h <= horizontal[-1] else 360 - h, v) for h in given] for v in POLAR]
    if horizontal == (0, 90):
        expected = [[bowl(min(h % 180, 180 - h % 180), v) for h in given] for v in POLAR]
    np.testing.assert_allclose(at, 2 * WATTS * np.array(expected), rtol=1e-4)
    assert not found.at(given, np.array([90.1, 180.0])).any()  # of what is not given


def test_type_b() -> None:
    """About an axis at a right angle: its vertical angles are our horizontal ones."""
    angles = (-90.0, -45.0, 0.0, 45.0, 90.0)
    found = read_ies(ies(angles, (0.0, 45.0, 90.0), lambda h, v: 100 + h + 0.1 * v, kind=2))
    assert found
    np.testing.assert_allclose(found.vertical, (0, 45, 90, 135, 180))
    np.testing.assert_allclose(found.horizontal, (0, 45, 90, 135, 180, 360))
    np.testing.assert_allclose(
        found.factors[1] / (2 * WATTS), [190 - 4.5, 145 - 4.5, 100 - 4.5, 145 - 4.5, 190 - 4.5]
    )


def test_tilt_is_skipped() -> None:
    text = ies(POLAR, (0.0,), bowl)
    tilted = text.replace("TILT=NONE", "TILT=INCLUDE\n1\n2\n0 90\n1.0 1.0")
    assert read_ies(tilted).profile() == read_ies(text).profile()


@pytest.mark.parametrize("text", ["", "TILT", "\nTILT=NONE\n1 2 3", "\nTILT=NONE\n1 x"])
def test_what_cannot_be_read(text) -> None:
    assert read_ies(text) is None


@pytest.mark.parametrize("mode", ["INTERNAL", "EXTERNAL", "missing"])
def test_of_a_light(export, tmp_path, mode) -> None:
    light = add_light("Lamp", "POINT", energy=2.0).data
    tree = nodes_of(light)
    node = add_node(tree, "ShaderNodeTexIES", Strength=3.0)
    text = ies(POLAR, (0.0,), bowl)
    if mode == "INTERNAL":
        node.mode, node.ies = mode, bpy.data.texts.new("lamp.ies")
        node.ies.write(text)
    else:
        file = tmp_path / "lamp.ies"
        file.write_text(text if mode == "EXTERNAL" else "")
        node.mode, node.filepath = "EXTERNAL", str(file)
    emission = next(node for node in tree.nodes if node.type == "EMISSION")
    tree.links.new(node.outputs[0], emission.inputs["Strength"])
    scene, report = export()
    (found,) = scene.lights
    if mode == "missing":
        assert not found.profile and found.power == pytest.approx((600.0,) * 3)
        assert [e.feature for e in report.of("approximated")] == ["IES Texture 'IES Texture'"]
        return
    assert found.power == pytest.approx((6.0,) * 3)
    profile = np.array(found.profile)
    assert profile.shape == (ROWS, 1)
    np.testing.assert_allclose(profile[60, 0], 2 * WATTS * bowl(0, 30), rtol=1e-6)


def test_a_lamp_that_is_not_round() -> None:
    assert np.shape(read_ies(ies(POLAR, (0, 90), bowl)).profile()) == (ROWS, COLUMNS)
