# SPDX-License-Identifier: GPL-3.0-or-later
"""Alpha, Transparent BSDF and what they are mixed with, against Cycles."""

from __future__ import annotations

import math
from typing import Any

import bpy
import numpy as np
import pytest

from addon.blender.settings import transparent_bounces_of
from tests.measure import render

from .build import (
    add_light,
    add_mesh,
    add_node,
    features,
    finish,
    new_material,
    shader_material,
)
from .lobes import DIFFUSE, GLASS, PRINCIPLED

pytestmark = pytest.mark.blender

TRANSPARENT = "ShaderNodeBsdfTransparent"
SAMPLES = 64


def mixed(factor: Any, colour: Any, first: str = TRANSPARENT) -> bpy.types.Material:
    """A shader and a green one, by a factor that may be the name of a texture node."""
    material, tree = new_material()
    node = add_node(tree, "ShaderNodeMixShader")
    tree.links.new(add_node(tree, first, Color=colour).outputs[0], node.inputs[1])
    diffuse = add_node(tree, DIFFUSE, Color=(0.2, 0.6, 0.1, 1))
    tree.links.new(diffuse.outputs[0], node.inputs[2])
    if isinstance(factor, str):
        texture = add_node(tree, factor, Scale=6.0)
        output = texture.outputs["Fac"] if "Fac" in texture.outputs else texture.outputs["Factor"]
        tree.links.new(output, node.inputs[0])
    else:
        node.inputs[0].default_value = factor
    finish(tree, node)
    return material


def leaf() -> bpy.types.Material:
    """Principled, cut out by a texture."""
    material, tree = new_material()
    texture = add_node(tree, "ShaderNodeTexChecker", Scale=7.0)
    node = add_node(tree, PRINCIPLED, Base_Color=(0.2, 0.6, 0.1, 1), Roughness=0.4)
    tree.links.new(texture.outputs["Fac"], node.inputs["Alpha"])
    finish(tree, node)
    return material


def sheets(material: bpy.types.Material, count: int) -> None:
    """Over a floor, under a sun, and the camera looks down through them."""
    floor = shader_material(DIFFUSE, "Floor", Color=(0.7, 0.6, 0.5, 1))
    add_mesh("Floor", scale=(5, 5, 1)).data.materials.append(floor)
    for number in range(count):
        sheet = add_mesh(f"Sheet {number}", location=(0.3, 0.1, 0.6 + 0.05 * number))
        sheet.scale = (1.5, 1.2, 1.0)
        sheet.data.materials.append(material)
    sun = add_light("Sun", "SUN", energy=3.0, angle=0.0)
    sun.rotation_euler = (math.radians(25), math.radians(-20), 0)
    bpy.context.scene.camera.location = (0, 0, 8)
    bpy.context.scene.cycles.max_bounces = 32


def shading(material: bpy.types.Material) -> bpy.types.Material:
    """The material with its Transparent Shadows off."""
    material.use_transparent_shadow = False
    return material


CASES = {
    "one": (lambda: mixed(0.4, (0.9, 0.5, 0.3, 1)), 1),
    "twenty": (lambda: mixed(0.05, (0.99, 0.95, 0.9, 1)), 20),
    "alpha": (lambda: shader_material(PRINCIPLED, Alpha=0.3, Base_Color=(0.8, 0.2, 0.2, 1)), 3),
    "colour": (lambda: shader_material(TRANSPARENT, Color=(0.8, 0.5, 0.2, 1)), 2),
    "leaf": (leaf, 1),
    "checker": (lambda: mixed("ShaderNodeTexChecker", (1, 1, 1, 1)), 2),
    "shading": (lambda: shading(leaf()), 2),
}


QUICK = ("alpha", "shading")
EACH = [x if x in QUICK else pytest.param(x, marks=pytest.mark.thorough) for x in CASES]


@pytest.mark.stability(70)
@pytest.mark.parametrize("case", EACH)
def test_sheets_are_those_of_cycles(scene, cycles_mean, export, device, case) -> None:
    """Blocks of pixels to 1 %, colours and alpha."""
    make, count = CASES[case]
    sheets(make(), count)
    scene.cycles.transparent_max_bounces = 64
    scene.cycles.pixel_filter_type = "BOX"
    exported, report = export()
    assert not [entry for entry in report.of("ignored") if entry.object.startswith("Material")]
    theirs = np.mean([cycles_mean(SAMPLES, seed) for seed in (1, 2)], axis=0, dtype=float)
    ours = render(
        device,
        exported,
        width=64,
        height=32,
        passes=48,
        photons=8192,
        mirror_depth=16,
        radius_decay=2 / 3,
        transparent=True,
        transparent_depth=transparent_bounces_of(scene),
    )["Combined"].astype(float)

    def blocks(image: Any) -> Any:
        return image.reshape(4, 8, 8, 8, 4).mean(axis=(1, 3))

    away = np.abs(blocks(ours) / blocks(theirs) - 1)
    print(f"{case}: median {np.median(away):.2%}, most {away.max():.2%}")
    assert np.median(away) < 0.01 and np.quantile(away, 0.95) < 0.03
    assert ours.mean(axis=(0, 1)) == pytest.approx(theirs.mean(axis=(0, 1)), rel=0.01)


def test_transparent_shadows_off(scene, export) -> None:
    """What is opaque has none to speak of; what is clear stops lamps, and is there for that."""
    material = shading(shader_material(DIFFUSE))
    add_mesh("Plane").data.materials.append(material)
    assert not export()[1].lines()
    clear = shading(shader_material(TRANSPARENT, "Clear", Color=(1, 1, 1, 1)))
    add_mesh("Pane").data.materials.append(clear)
    exported, report = export()
    assert [x.filters_no_lamps for x in exported.materials] == [False, True]
    assert [x.feature for x in report.of("approximated")] == ["Transparent Shadows"]


def test_transparent_shadows_off_beside_a_volume(scene, export) -> None:
    """In Cycles they are on there, whatever it is."""
    for kind in (TRANSPARENT, GLASS):
        material = shading(shader_material(kind, kind, Color=(1, 1, 1, 1)))
        tree = material.node_tree
        volume = add_node(tree, "ShaderNodeVolumeAbsorption", Density=0.5)
        finish(tree, volume, "Volume")
        add_mesh(kind).data.materials.append(material)
    exported, report = export()
    assert not any(x.shades_lamps for x in exported.materials)
    assert "Transparent Shadows" not in [entry.feature for entry in report.entries]
    assert [material.medium.is_there for material in exported.materials] == [True, True]


def test_volume_absorption(convert) -> None:
    """Density * (1 - colour) of what is constant; the surface is what it was."""
    material = shader_material(GLASS, IOR=1.3, Roughness=0.0)
    tree = material.node_tree
    volume = add_node(tree, "ShaderNodeVolumeAbsorption", Color=(0.9, 0.5, 0.2, 1), Density=4.0)
    finish(tree, volume, "Volume")
    converted, report = convert(material)
    assert converted.medium.absorption == pytest.approx((0.4, 2.0, 3.2), rel=1e-5)
    assert [lobe.kind for lobe in converted.lobes] == ["glass"]
    assert features(report, "exact") == ["Shader"]


def test_the_length_of_rays(scene, export, cycles_mean, device) -> None:
    """From the eye on, or where a mirror sent it, whatever transparent sheets it has passed."""
    clear = shader_material(TRANSPARENT, Color=(0.5, 0.5, 0.5, 1))
    material, tree = new_material("Far")
    far = tree.nodes.new("ShaderNodeLightPath").outputs["Ray Length"]
    finish(tree, add_node(tree, "ShaderNodeEmission", Color=far))
    for height in (1.0, 2.0):
        add_mesh("Sheet", location=(0, 0, height), scale=(3, 3, 1)).data.materials.append(clear)
    add_mesh("Floor", scale=(3, 3, 1)).data.materials.append(material)
    scene.camera.location.z, scene.camera.data.lens = 5.0, 80.0
    scene.render.resolution_x = scene.render.resolution_y = 8
    shown = cycles_mean(1, 0)[..., :3].mean()
    ours = render(device, export()[0], width=8, height=8, passes=1, photons=0)["Combined"]
    assert ours[..., :3].mean() == pytest.approx(shown, rel=1e-2)
    assert shown == pytest.approx(5.0 / 4.0, rel=0.02)
