# SPDX-License-Identifier: GPL-3.0-or-later
"""The passes of a picture, in Blender's files and compositor."""

from __future__ import annotations

import math

import bpy
import numpy as np
import OpenEXR
import pytest

from addon.blender import engine
from addon.blender.session import SESSION

from .build import add_mesh, shader_material
from .render_passes import render_exr

pytestmark = pytest.mark.blender

COMPONENTS = ("Direct", "Indirect", "Mirror", "Emission", "Background")


def test_components_sum_to_combined(room, tmp_path) -> None:
    passes = render_exr(room, tmp_path / "a.exr")
    assert set(passes) == {"Combined", "Depth", "Normal", "Error", *COMPONENTS}
    total = sum(passes[name] for name in COMPONENTS)
    np.testing.assert_allclose(total, passes["Combined"][..., :3], rtol=1e-5, atol=1e-6)
    for name in COMPONENTS:
        assert passes[name].max() > 0.0 or name == "Emission", name
        assert np.isfinite(passes[name]).all(), name
    assert (passes["Combined"][..., 3] == 1.0).all()
    assert passes["Depth"].min() == pytest.approx(10.0, abs=3.0)


def test_caustics(room, tmp_path) -> None:
    """A part of other passes, where it is asked for."""
    room.view_layers[0].photon_stream.use_pass_caustics = True
    passes = render_exr(room, tmp_path / "a.exr")
    assert set(passes) == {"Combined", "Depth", "Normal", "Error", "Caustics", *COMPONENTS}
    assert passes["Caustics"].shape == passes["Indirect"].shape
    assert (passes["Caustics"] <= passes["Indirect"] + passes["Mirror"] + 1e-6).all()


def test_illuminance(room, tmp_path) -> None:
    """In lux; and its view, which tells places by their colours."""
    own = room.view_layers[0].photon_stream
    own.use_pass_illuminance = own.use_pass_illuminance_view = True
    room.render.resolution_x = 96
    passes = render_exr(room, tmp_path / "a.exr")
    lux, view = passes["Illuminance"][..., 0], passes["Illuminance View"]
    on_floor = 683 * 500 / (4 * math.pi) / 36 + 683 * math.pi * 0.2  # spot and sky, about
    assert np.median(lux[lux > 0]) == pytest.approx(on_floor, rel=0.7)
    assert view.shape == (32, 96, 3) and np.isfinite(view).all()
    left = view[:, :48]
    assert left.max() > 0.3 and not left[lux[:, :48] == 0].any()


def test_denoising(room, tmp_path) -> None:
    """Passes by the names that Blender's Denoise node wants them by; Combined alone is denoised."""
    plain = render_exr(room, tmp_path / "a.exr")
    room.photon_stream.denoise = True
    room.view_layers[0].photon_stream.denoising_store_passes = True
    passes = render_exr(room, tmp_path / "b.exr")
    assert passes.keys() - plain.keys() == {"Denoising Albedo", "Denoising Normal"}
    changed = {name for name in plain if not np.array_equal(plain[name], passes[name])}
    assert changed == {"Combined"} and SESSION.info["denoiser"].startswith("OpenImageDenoise 2.")
    albedo, normal = passes["Denoising Albedo"], passes["Denoising Normal"]
    assert albedo.shape == normal.shape == (32, 32, 3)
    assert albedo.min() >= 0.0 and 0.1 < albedo.mean() < albedo.max() <= 1.0
    assert np.linalg.norm(normal, axis=-1).max() == pytest.approx(1.0, abs=1e-3)
    assert not any("denoised" in x for x in SESSION.reports[room.name].warnings)


def test_denoising_data_of_cycles(room, tmp_path) -> None:
    """A file that denoises Cycles' picture in its compositor finds the passes that it is about."""
    room.view_layers[0].cycles.denoising_store_passes = True
    passes = render_exr(room, tmp_path / "a.exr")
    assert {"Denoising Albedo", "Denoising Normal", "Noisy Image"} < passes.keys()
    np.testing.assert_array_equal(passes["Noisy Image"], passes["Combined"])
    assert not any("Noisy" in line for line in SESSION.reports[room.name].lines())
    room.photon_stream.denoise, room.view_layers[0].samples = True, 3
    render_exr(room, tmp_path / "b.exr")
    lines = SESSION.reports[room.name].lines()
    assert any("Noisy Image" in line for line in lines) and any("Samples" in x for x in lines)


@pytest.mark.parametrize("falloff", ["QUADRATIC", "LINEAR", "INVERSE_QUADRATIC"])
def test_mist_and_what_shines_as_in_cycles(room, tmp_path, falloff) -> None:
    """Blender's own passes, which compositors ask for by Cycles' names."""
    colour = (0.3, 0.3, 0.3, 1.0)
    veil = shader_material("ShaderNodeBsdfTransparent", "Veil", Color=colour)
    glow = shader_material("ShaderNodeEmission", "Glow", Color=(1.0, 0.5, 0.2, 1.0), Strength=3.0)
    for name, material, at, scale in (
        ("Veil", veil, (1.5, 0.5, 4.0), 1.5),
        ("Lit", glow, (-2.0, -0.5, 1.5), 1.4),  # of so many pixels that one at its edge says little
    ):
        add_mesh(name, scale=(scale,) * 3, location=at).data.materials.append(material)
    layer, mist = room.view_layers[0], room.world.mist_settings
    layer.use_pass_mist = layer.use_pass_emit = layer.use_pass_environment = True
    mist.start, mist.depth, mist.falloff = 2.0, 12.0, falloff
    room.camera.data.lens, room.photon_stream.passes = 20.0, 64
    ours = render_exr(room, tmp_path / "a.exr")
    lines = SESSION.reports[room.name].lines()
    assert [line for line in lines if "Pass" in line and "Mirror" not in line] == []
    room.render.engine, room.cycles.device, room.cycles.samples = "CYCLES", "CPU", 64
    room.cycles.use_denoising = room.cycles.use_adaptive_sampling = False
    theirs = render_exr(room, tmp_path / "b.exr")
    shines, beyond = (engine.OWN[f"use_pass_{x}"].name for x in ("emit", "environment"))
    within = {"Mist": theirs["Mist"] >= 0.0}  # each pass where it is wholly of one thing
    within[shines] = theirs[shines] == theirs[shines].max(axis=(0, 1))
    within[beyond] = theirs[beyond] == theirs[beyond].max(axis=(0, 1))
    for name, there in within.items():
        assert ours[name].shape == theirs[name].shape and there.any(), name
        np.testing.assert_allclose(ours[name][there].mean(), theirs[name][there].mean(), rtol=0.01)
    apart = np.abs(ours["Mist"] - theirs["Mist"])
    assert apart.mean() < 5e-3 and np.median(apart) < 1e-3 and theirs["Mist"].std() > 0.05


@pytest.mark.skipif(bpy.app.version < (5, 0), reason="compositor trees were scenes' own")
def test_blenders_own_denoise_node(room, tmp_path) -> None:
    """It finds both passes by their names, and does with them what it does."""
    room.view_layers[0].photon_stream.denoising_store_passes = True
    tree = bpy.data.node_groups.new("Denoised", "CompositorNodeTree")
    tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
    layers, out = tree.nodes.new("CompositorNodeRLayers"), tree.nodes.new("NodeGroupOutput")
    room.view_layers[0].update_render_passes()
    node = tree.nodes.new("CompositorNodeDenoise")
    for name, source in (
        ("Image", "Image"),
        *((x, f"Denoising {x}") for x in ("Normal", "Albedo")),
    ):
        tree.links.new(layers.outputs[source], node.inputs[name])
    tree.links.new(node.outputs["Image"], out.inputs[0])
    plain = render_exr(room, tmp_path / "a.exr")["Combined"]
    room.compositing_node_group, room.render.use_compositing = tree, True
    composed = render_exr(room, tmp_path / "b.exr")["Composite.Combined"]
    rough, smooth = (float(np.abs(np.diff(x[..., :3], axis=0)).mean()) for x in (plain, composed))
    assert smooth < 0.98 * rough and composed.mean() == pytest.approx(plain.mean(), rel=0.05)


def test_metadata(room, tmp_path) -> None:
    """A file says what it was made with, and how good it is."""
    room.photon_stream.passes, room.photon_stream.seed = 8, 7
    render_exr(room, tmp_path / "a.exr")
    with OpenEXR.File(str(tmp_path / "a.exr"), separate_channels=True) as file:
        header = dict(file.header())
    found = {name: header[f"photon_stream.ViewLayer.{name}"] for name in engine.METADATA}
    assert (found["seed"], found["passes"], found["photons"]) == ("7", "8", "32768")
    error, noise, bias = (float(found[name]) for name in ("error", "noise", "bias"))
    assert 0 < error < 1 and error == pytest.approx(math.hypot(noise, bias))
    assert found["device"] == SESSION.info["device"] and float(found["radius"]) > 0
    assert found["version"].count(".") == 2


def test_same_seed_same_bits(room, tmp_path) -> None:
    first, second = (render_exr(room, tmp_path / name) for name in ("a.exr", "b.exr"))
    for name in first:
        np.testing.assert_array_equal(first[name], second[name])
    room.photon_stream.seed = 1
    third = render_exr(room, tmp_path / "c.exr")
    assert (third["Indirect"] != first["Indirect"]).any()


def test_transparent_film(room, tmp_path) -> None:
    room.render.film_transparent = True
    room.camera.data.lens = 15.0
    alpha = render_exr(room, tmp_path / "a.exr")["Combined"][..., 3]
    assert alpha.min() == 0.0 and alpha.max() == 1.0


@pytest.mark.parametrize("crop", [False, True])
def test_border_is_that_part_of_the_picture(room, tmp_path, crop) -> None:
    room.photon_stream.use_radius = True  # the automatic one may look at the region
    room.photon_stream.radius = 0.5
    whole = render_exr(room, tmp_path / "whole.exr")
    room.render.use_border, room.render.use_crop_to_border = True, crop
    room.render.border_min_x, room.render.border_max_x = 0.25, 0.8
    room.render.border_min_y, room.render.border_max_y = 0.4, 0.9
    x0, y0, x1, y1 = engine.border_region(room.render, (32, 32))
    rows, columns = slice(32 - y1, 32 - y0), slice(x0, x1)
    part = render_exr(room, tmp_path / "part.exr")
    for name in ("Combined", "Direct", "Depth"):
        found = part[name] if crop else part[name][rows, columns]
        np.testing.assert_allclose(found, whole[name][rows, columns], rtol=1e-5, atol=1e-6)
    if not crop:
        assert part["Combined"][0, 0, 3] == 0.0


def test_each_view_layer(room, tmp_path) -> None:
    second = room.view_layers.new("Second")
    second.material_override = shader_material("ShaderNodeBsdfDiffuse", "Clay")
    passes = render_exr(room, tmp_path / "a.exr")
    assert passes["Combined"].max() > 0.0 and passes["Second.Combined"].max() > 0.0
    assert (passes["Combined"] != passes["Second.Combined"]).any()


def test_light_groups_are_passes(room, tmp_path) -> None:
    """What is in none of them is in Combined alone."""
    groups = room.view_layers[0].lightgroups
    for name in ("Key", "Empty"):
        groups.add(name=name)
    bpy.data.objects["Spot"].lightgroup = "Key"
    passes = render_exr(room, tmp_path / "a.exr")
    key, whole = passes["Combined_Key"], passes["Combined"][..., :3]
    assert not passes["Combined_Empty"].any() and key.any()
    assert (whole - key).max() > 0.0 and (whole - key).min() > -1e-5  # the world


def test_compositor_offers_the_passes(room) -> None:
    if bpy.app.version >= (5, 0):
        tree = room.compositing_node_group = bpy.data.node_groups.new("C", "CompositorNodeTree")
    else:
        room.use_nodes = True
        tree = room.node_tree
    layers = tree.nodes.new("CompositorNodeRLayers")
    layers.scene = room
    room.view_layers[0].photon_stream.use_pass_mirror = False
    room.view_layers.update()
    room.view_layers[0].update_render_passes()
    offered = {socket.name for socket in layers.outputs if socket.enabled}
    assert {"Image", "Depth", "Normal", "Direct", "Indirect", "Background"} <= offered
    assert "Mirror" not in offered
