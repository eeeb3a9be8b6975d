# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights and skies of values that nobody wants: Cycles' picture, or a dark one and a word."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from tests.measure import render

from .build import add_light, add_mesh, add_node, finish, new_world
from .test_world_images import image_of, with_texture

pytestmark = pytest.mark.blender

KINDS = ("AREA", "POINT", "SPOT", "SUN")
SCALES = [(-1, 1, 1), (-2, -1, -1), (0, 1, 1), (1, 1, 0), (0, 0, 0)]
TINY: dict[str, Any] = {"width": 16, "height": 8, "passes": 2, "photons": 500}


def over_a_plane(kind: str, **properties: Any) -> Any:
    """A light three metres above a plane of ten."""
    plane = add_mesh("Plane")
    plane.scale = (5, 5, 1)
    lamp = add_light("Lamp", kind, location=(0.5, 0, 3), rotation_euler=(0.2, 0.1, 0.3))
    lamp.data.energy = 3.0 if kind == "SUN" else 200.0
    if kind != "SUN":
        lamp.data.shadow_soft_size = 0.2
    for name, value in properties.items():
        setattr(lamp if hasattr(lamp, name) else lamp.data, name, value)
    return lamp


@pytest.mark.parametrize("kind", KINDS)
def test_power(scene, export, device, kind) -> None:
    """0 is dark, and what is no number by name; 1e9 is a picture as much brighter, and what is
    negative takes as much away."""
    lamp = over_a_plane(kind)
    pictures = {}
    for power in (1.0, 1e9, 0.0, -5.0, math.nan, math.inf):
        lamp.data.energy = power
        exported, report = export()
        shown = pictures[power] = render(device, exported, **TINY)["Combined"][..., :3]
        assert np.isfinite(shown).all() and (shown.min() >= 0.0 or power == -5.0)
        named = {e.feature for e in report.of("approximated") if "Lamp" in e.object}
        if not math.isfinite(power) or power == 0.0:
            assert not shown.any() and bool(named) == (power != 0.0), (power, named)
    assert pictures[1.0].any()
    np.testing.assert_allclose(pictures[1e9], 1e9 * pictures[1.0], rtol=1e-3)
    np.testing.assert_allclose(pictures[-5.0], -5.0 * pictures[1.0], rtol=1e-3)


def has_direction(kind: str, scale: tuple[int, int, int]) -> bool:
    """Whether Cycles has a direction to turn a light to: without, what it shows is by chance."""
    return kind in ("POINT", "AREA") or (scale[2] != 0 and (kind == "SUN" or min(scale[:2]) != 0))


@pytest.mark.thorough("(0, 1, 1)-POINT", "(1, 1, 0)-SPOT", "(0, 1, 1)-SUN", "(-2, -1, -1)")
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    "scale", [(-1, 1, 1), (-2, -1, -1), (0, 1, 1), (1, 1, 0), (0, 0, 0)], ids=str
)
def test_scale(scene, export, device, cycles_mean, kind, scale) -> None:
    """Mirrored and flattened lights light what they light in Cycles."""
    scene.render.resolution_x, scene.render.resolution_y = 32, 16
    over_a_plane(kind, scale=scale)
    exported, report = export()
    ours = render(device, exported, width=32, height=16, passes=64, photons=0)["Combined"]
    assert np.isfinite(ours).all()
    if not has_direction(kind, scale):
        assert not ours[..., :3].any()
        assert any("scale is zero" in entry.detail for entry in report.of("ignored"))
        return
    theirs = cycles_mean(128, 1)
    halves = [image[..., :3].reshape(16, 2, 16, 3).mean(axis=(0, 2)) for image in (ours, theirs)]
    np.testing.assert_allclose(halves[0], halves[1], rtol=0.03)


@pytest.mark.thorough("half")
@pytest.mark.parametrize("name", ["one", "half", "odd"])
def test_skies(scene, export, device, cycles_mean, name) -> None:
    """Of one texel, and of half black, as Cycles has them. Texels that are no numbers are black:
    in Cycles then all is."""
    texels = {
        "one": np.array([[[2.0, 2.0, 2.0, 1.0]]]),
        "half": np.repeat([[[0.0, 0.0, 0.0, 1.0]]] * 32 + [[[4.0, 4.0, 4.0, 1.0]]] * 32, 128, 1),
        "odd": np.array([[[np.nan] * 4, [np.inf] * 4], [[1.0] * 4, [-np.inf] * 4]]),
    }
    scene.render.resolution_x, scene.render.resolution_y = 32, 16
    add_mesh("Plane").scale = (5, 5, 1)
    with_texture(scene, image_of(texels[name], float_buffer=True))
    exported, _ = export()
    shown = render(device, exported, width=32, height=16, passes=64, photons=0)["Combined"][..., :3]
    assert np.isfinite(shown).all() and shown.min() >= 0.0 and shown.any()
    if name != "odd":
        assert shown.mean() == pytest.approx(cycles_mean(64, 1)[..., :3].mean(), rel=0.01)


def test_portals_do_not_light(export) -> None:
    """They tell Cycles where the world shines in; other kinds than areas are none."""
    for kind in ("AREA", "POINT"):
        over_a_plane(kind).data.cycles.is_portal = True
    exported, report = export()
    assert [light.kind for light in exported.lights] == ["point"]
    assert not [entry for entry in report.entries if entry.status != "exact"]


@pytest.mark.parametrize("shift", [0.0, -0.5])
def test_negative_skies_are_named(scene, export, shift) -> None:
    """Cycles takes their light away; here it is none."""
    tree = new_world(scene)
    gradient = add_node(tree, "ShaderNodeTexGradient").outputs["Color"]
    moved = add_node(tree, "ShaderNodeVectorMath")
    moved.inputs[1].default_value = (shift,) * 3
    tree.links.new(gradient, moved.inputs[0])
    finish(tree, add_node(tree, "ShaderNodeBackground", Color=moved.outputs[0]))
    exported, report = export()
    pixels = exported.images[0].pixels
    assert pixels.min() == 0.0 and pixels.max() == pytest.approx(1.0 + shift, abs=0.01)
    named = [entry for entry in report.of("approximated") if entry.feature == "Negative light"]
    assert len(named) == (1 if shift < 0.0 else 0)
