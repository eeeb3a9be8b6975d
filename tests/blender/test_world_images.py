# SPDX-License-Identifier: GPL-3.0-or-later
"""Images of the world: read as Cycles has them, made finer or smaller, missing."""

from __future__ import annotations

import math
from typing import Any

import bpy
import numpy as np
import pytest

from addon.blender.export import environment, finer, pixels, world_nodes
from addon.blender.export.pixels import floats_of

from .build import add_node, finish, gone, new_world

pytestmark = pytest.mark.blender


def image_of(pixels: np.ndarray, **options: Any) -> bpy.types.Image:
    height, width = pixels.shape[:2]
    image = bpy.data.images.new("Sky", width, height, **options)
    image.pixels.foreach_set(pixels.astype(np.float32).ravel())
    return image


def with_texture(scene: bpy.types.Scene, image: bpy.types.Image | None) -> bpy.types.Node:
    tree = new_world(scene)
    node = tree.nodes.new("ShaderNodeTexEnvironment")
    node.image = image
    finish(tree, add_node(tree, "ShaderNodeBackground", Color=node.outputs[0], Strength=2.0))
    return node


RANDOM = np.random.default_rng(2).random((8, 16, 4))
RANDOM[..., 3] = 1.0


def test_environment_texture(scene, export) -> None:
    """Its pixels as they are; a Mapping node turns the light."""
    node = with_texture(scene, image_of(RANDOM, float_buffer=True))
    tree = scene.world.node_tree
    place = tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"]
    mapping = add_node(tree, "ShaderNodeMapping", Vector=place, Rotation=(0.0, 0.0, math.pi / 2))
    tree.links.new(mapping.outputs[0], node.inputs[0])
    exported, report = export()
    (light,), (image,) = exported.lights, exported.images
    assert (light.kind, light.power, light.parameters) == ("environment", (2.0,) * 3, {"image": 0})
    np.testing.assert_array_equal(image.pixels, RANDOM[..., :3].astype(np.float32))
    assert light.direction == pytest.approx((0.0, 0.0, 1.0), abs=1e-6)
    # What is at -Y is looked up at +X: in the middle.
    assert light.across == pytest.approx((0.0, -1.0, 0.0), abs=1e-6)
    assert [e.status for e in report.entries if "World" in e.object] == ["exact"]


def test_bytes_are_decoded(scene, export) -> None:
    stored = np.rint(RANDOM * 255) / 255
    with_texture(scene, image_of(stored))
    (image,) = export()[0].images
    low, high = stored / 12.92, ((stored + 0.055) / 1.055) ** 2.4
    linear = np.where(stored <= 0.04045, low, high)[..., :3]
    times = image.pixels.shape[0] // 8
    middles = image.pixels[times // 2 :: times, times // 2 :: times]
    np.testing.assert_allclose(middles, linear, rtol=1e-5, atol=1e-6)


@pytest.mark.thorough("Linear", "Smart")
@pytest.mark.parametrize("interpolation", ["Closest", "Linear", "Cubic", "Smart"])
def test_between_pixels(scene, export, interpolation) -> None:
    """As Cycles finds it there: of coded colours before they are decoded."""
    node = with_texture(scene, image_of(RANDOM))
    node.interpolation = interpolation
    exported, report = export()
    (image,) = exported.images
    height, width = image.pixels.shape[:2]
    expected = world_nodes.evaluate(node, node.outputs[0], (), least=width)
    assert (height, width) == expected.shape[:2] and width >= 1024
    apart = np.abs(image.pixels - expected)
    assert apart.mean() < 3e-3 * expected.mean() and np.percentile(apart, 99.9) < 0.02
    (entry,) = (e for e in report.of("approximated") if "World" in e.object)
    assert interpolation.lower() in entry.detail


@pytest.mark.parametrize(("width", "height"), [(1, 300), (300, 1), (1, 1)])
def test_narrow_images_stay_small(width, height) -> None:
    times = finer.times_finer(width, height)
    found = finer.finer(np.full((height, width, 3), 0.5, np.float32), "Cubic", times)
    assert times % 2 == 1 and max(found.shape) < 2048
    np.testing.assert_allclose(found, 0.5, rtol=1e-6)


def test_large_images_are_finer_by_no_texel(scene, export, monkeypatch) -> None:
    """What is as wide as that is looked up between its own pixels."""
    monkeypatch.setattr(finer, "LENGTH", 16)
    node = with_texture(scene, image_of(RANDOM, float_buffer=True))
    node.interpolation = "Cubic"
    (image,) = export()[0].images
    weights = np.zeros((8, 16))
    weights[np.ix_((-1, 0, 1), (-1, 0, 1))] = np.outer((1, 4, 1), (1, 4, 1)) / 36
    spectrum = np.fft.fft2(RANDOM[..., :3], axes=(0, 1)) * np.fft.fft2(weights)[..., None]
    expected = np.fft.ifft2(spectrum, axes=(0, 1)).real
    np.testing.assert_allclose(image.pixels, expected, rtol=1e-5)


MULTIPLIED = 1.0 if bpy.app.version >= (5, 2) else 0.4  # what Alpha Mode says is so already


@pytest.mark.parametrize(
    ("mode", "factor"),
    [("STRAIGHT", 0.4), ("PREMUL", MULTIPLIED), ("CHANNEL_PACKED", 1.0), ("NONE", 1.0)],
)
def test_bytes_that_let_something_through(scene, export, mode, factor) -> None:
    """Where they are no masks, Cycles multiplies colours by their alpha as they are stored."""
    image = image_of(np.tile((0.8, 0.6, 0.4, 0.4), (8, 16, 1)), alpha=True)
    image.alpha_mode = mode
    with_texture(scene, image)
    exported, _ = export()
    (light,) = exported.lights
    shown = exported.images[0].pixels.mean(axis=(0, 1)) if exported.images else 1.0
    stored = factor * np.array((0.8, 0.6, 0.4))
    expected = np.where(stored <= 0.04045, stored / 12.92, ((stored + 0.055) / 1.055) ** 2.4)
    np.testing.assert_allclose(shown * np.array(light.power), 2.0 * expected, rtol=0.05)


def test_floats_that_let_something_through(scene, export) -> None:
    """Of straight ones Blender 5.2's Cycles multiplies by alpha what Blender has multiplied."""
    image = image_of(np.full((8, 16, 4), 0.25), float_buffer=True, alpha=True)
    image.alpha_mode = "STRAIGHT"
    with_texture(scene, image)
    exported, _ = export()
    (light,) = exported.lights
    shown = exported.images[0].pixels.mean(axis=(0, 1)) if exported.images else 1.0
    expected = 2.0 * 0.25 * (0.25 if bpy.app.version >= (5, 2) else 1.0)
    np.testing.assert_allclose(shown * np.array(light.power), expected, rtol=1e-3)


def test_an_image_of_one_colour_is_a_colour(scene, export) -> None:
    pixels = np.full((8, 16, 4), 0.25)
    pixels[..., 3] = 1.0
    with_texture(scene, image_of(pixels, float_buffer=True))
    exported, _ = export()
    assert not exported.images and exported.lights[0].power == (0.5,) * 3


def test_missing_image_is_magenta(scene, export) -> None:
    with_texture(scene, None)
    exported, report = export()
    assert exported.lights[0].power == (2.0, 0.0, 2.0)
    assert "magenta" in next(e.detail for e in report.of("approximated") if "World" in e.object)


def test_alpha_of_a_missing_image_is_one(scene, export) -> None:
    tree = new_world(scene)
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image = gone()
    alpha = add_node(tree, "ShaderNodeMath", Value=texture.outputs["Alpha"])
    alpha.operation = "SINE"
    finish(tree, add_node(tree, "ShaderNodeBackground", Color=alpha.outputs[0]))
    exported, _ = export()
    assert exported.lights[0].power == pytest.approx((math.sin(1.0),) * 3, rel=1e-3)


@pytest.mark.parametrize("kind", ["ShaderNodeTexEnvironment", "ShaderNodeTexImage"])
def test_missing_image_behind_nodes_is_magenta(scene, export, kind) -> None:
    """They are evaluated as for one pixel of it."""
    tree = new_world(scene)
    texture = tree.nodes.new(kind)
    texture.image = gone()
    turned = add_node(tree, "ShaderNodeHueSaturation", Saturation=0.5, Color=texture.outputs[0])
    node = add_node(tree, "ShaderNodeBackground", Color=turned.outputs[0], Strength=2.0)
    finish(tree, node)
    exported, report = export()
    assert exported.lights[0].power == pytest.approx((2.0, 1.0, 2.0), rel=1e-3)
    assert "magenta" in next(e.detail for e in report.of("approximated") if "World" in e.object)


def test_large_images_become_smaller(scene, export, monkeypatch) -> None:
    monkeypatch.setattr(environment, "MOST_PIXELS", 32)
    with_texture(scene, image_of(RANDOM, float_buffer=True))
    exported, report = export()
    expected = RANDOM[..., :3].reshape(4, 2, 8, 2, 3).mean(axis=(1, 3))
    np.testing.assert_allclose(exported.images[0].pixels, expected, rtol=1e-6)
    (detail,) = (e.detail for e in report.of("approximated") if "World" in e.object)
    assert "2 x 2 of its 16x8 pixels" in detail and "GB" in detail


def test_images_of_one_channel_are_grey(scene, export, monkeypatch) -> None:
    """In nodes that Blender evaluates."""
    monkeypatch.setattr(pixels, "floats_of", lambda image: floats_of(image)[..., :1])
    tree = new_world(scene)
    node = tree.nodes.new("ShaderNodeTexEnvironment")
    node.image = image_of(RANDOM, float_buffer=True)
    root = add_node(tree, "ShaderNodeGamma", Color=node.outputs[0], Gamma=0.5)
    finish(tree, add_node(tree, "ShaderNodeBackground", Color=root.outputs[0]))
    (image,) = export()[0].images
    assert np.ptp(image.pixels, axis=2).max() < 1e-6
    assert image.pixels.mean() == pytest.approx(np.sqrt(RANDOM[..., 0]).mean(), rel=0.05)
