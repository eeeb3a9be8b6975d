# SPDX-License-Identifier: GPL-3.0-or-later
"""A ball and a sheet of glass over a floor, against Cycles, which finds such light."""

from __future__ import annotations

import math
from typing import Any

import bpy
import numpy as np
import pytest

from tests.measure import render

from .build import (
    CUBE,
    add_light,
    add_mesh,
    add_node,
    add_object,
    finish,
    long_paths,
    new_world,
    shader_material,
)
from .lobes import DIFFUSE, GLASS, PRINCIPLED, REFRACTION

pytestmark = pytest.mark.blender

# Of other faces of a body of glass.
SHADERS_BESIDE = "ShaderNodeBsdfTransparent", "ShaderNodeBsdfTranslucent", "ShaderNodeBsdfDiffuse"

SAMPLES = 256
CASES: dict[str, tuple[str, dict[str, Any]]] = {
    "smooth": (GLASS, {"Roughness": 0.0, "IOR": 1.5}),
    "rough": (GLASS, {"Roughness": 0.5, "IOR": 1.45, "Color": (0.9, 0.7, 0.5, 1)}),
    "principled": (
        PRINCIPLED,
        {"Transmission_Weight": 0.7, "Roughness": 0.3, "Base_Color": (0.3, 0.6, 0.8, 1)},
    ),
    "refraction": (REFRACTION, {"Roughness": 0.0, "IOR": 1.2, "Color": (0.9, 0.9, 0.6, 1)}),
    "air": (GLASS, {"Roughness": 0.2, "IOR": 0.75}),
}


@pytest.mark.thorough
@pytest.mark.parametrize("case", CASES)
def test_ball_of_glass(scene, cycles_mean, export, device, case) -> None:
    """Blocks of pixels about the ball: 1 % in the median, 3 % at the 95th percentile."""
    shader, inputs = CASES[case]
    world = scene.world = bpy.data.worlds.new("World")
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.8, 0.9, 1.0, 1)
    floor = shader_material(DIFFUSE, "Floor", Color=(0.7, 0.4, 0.2, 1))
    add_mesh("Floor", scale=(6, 6, 1)).data.materials.append(floor)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32, location=(0, 0, 1.1))
    bpy.ops.object.shade_smooth()
    bpy.context.object.data.materials.append(shader_material(shader, "Ball", **inputs))
    scene.camera.location, scene.camera.rotation_euler = (0, -5, 2.6), (1.25, 0, 0)
    scene.camera.data.lens = 60
    long_paths(scene)
    theirs = np.mean([cycles_mean(SAMPLES, seed) for seed in (1, 2)], axis=0, dtype=float)
    settings: Any = {"width": 64, "height": 32, "photons": 65536, "mirror_depth": 32}
    settings |= {"passes": 48, "radius_decay": 2 / 3, "transparent": True}
    ours = render(device, export()[0], **settings)["Combined"].astype(float)

    def blocks(image: Any) -> Any:
        return image[..., :3].reshape(4, 8, 8, 8, 3).mean(axis=(1, 3))

    there = blocks(theirs) > 0.02  # and no sky
    away = np.abs(blocks(ours)[there] / blocks(theirs)[there] - 1)
    mean = ours[4:28, 16:48, :3].mean() / theirs[4:28, 16:48, :3].mean() - 1
    high = np.quantile(away, 0.95)
    print(f"\n{case}: mean {mean:.2%}, median {np.median(away):.2%}, 95th {high:.2%}")
    assert np.median(away) < 0.01 and high < 0.03 and abs(mean) < 0.015


@pytest.mark.thorough("eye outside-0.4")
@pytest.mark.parametrize("roughness", (0.0, 0.4))
@pytest.mark.parametrize("case", ("eye outside", "eye inside", "eye inside, upside down"))
def test_sheet_of_glass(scene, cycles_mean, export, device, case, roughness, thorough) -> None:
    """Over a floor that a lamp below it lights, or the sky above it: 1 % in the mean."""
    if not thorough and (case, roughness) != ("eye outside", 0.4):
        pytest.skip("runs with --thorough")
    floor = shader_material(DIFFUSE, "Floor", Color=(0.7, 0.4, 0.2, 1))
    add_mesh("Floor", scale=(2, 2, 1)).data.materials.append(floor)
    sheet = add_mesh("Sheet", location=(0, 0, 1), scale=(2, 2, 1))
    if case.endswith("down"):
        sheet.rotation_euler.x = math.pi
    sheet.data.materials.append(shader_material(GLASS, "Sheet", Roughness=roughness, IOR=1.5))
    if case == "eye outside":
        add_light("Lamp", "AREA", energy=50.0, size=1.0, location=(0, 0, 0.8))
        scene.camera.location, scene.camera.data.lens = (0, 0, 4), 40
    else:
        scene.world = bpy.data.worlds.new("World")
        scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (1, 1, 1, 1)
        scene.camera.location, scene.camera.data.lens = (0, 0, 0.9), 15
    scene.cycles.blur_glossy, scene.cycles.max_bounces = 0.0, 32
    for kind in ("diffuse", "glossy", "transmission"):
        setattr(scene.cycles, f"{kind}_bounces", 32)
    theirs = cycles_mean(256, 1)[..., :3].mean(axis=(0, 1), dtype=float)
    found, report = export()
    settings: Any = {"width": 64, "height": 32, "photons": 1 << 17, "passes": 12}
    settings |= {"mirror_depth": 32, "radius": 0.05}
    ours = render(device, found, **settings)["Combined"][..., :3].mean(axis=(0, 1), dtype=float)
    print(f"\n{case}, {roughness}: {ours / theirs - 1}")
    assert ours == pytest.approx(theirs, rel=0.01)
    assert "exact: Object 'Sheet': Glass: an open mesh: as in Cycles" in map(str, report.entries)


def test_what_is_a_sheet(export) -> None:
    """A mesh with a rim, unless vertices on both sides of it coincide."""
    glass = shader_material(GLASS, "Glass", Roughness=0.0, IOR=1.5)
    points, faces = CUBE
    split = [points[i] for face in faces for i in face], np.arange(24).reshape(6, 4).tolist()
    shapes = {"Whole": CUBE, "Split": split, "Cut": (points, faces[1:])}
    for name, shape in shapes.items():
        add_mesh(name, shape).data.materials.append(glass)
    found, report = export()
    opened = [
        found.materials[found.material[found.surface == number][0]].lobes[0].parameters["open"]
        for number in map(found.surfaces.index, shapes)
    ]
    assert opened == [0.0, 0.0, 1.0]
    assert [x.object for x in report.entries if x.feature == "Glass"] == ["Object 'Cut'"]


@pytest.mark.parametrize("other", [*SHADERS_BESIDE, "mixed"])
def test_light_that_leaves_by_other_ways(scene, export, device, other) -> None:
    """Through other faces, or as if there were no glass: before a white world all is white."""
    material = shader_material(GLASS, "Glass", Roughness=0.0, IOR=1.5)
    cube = add_mesh("Body", CUBE)
    cube.data.materials.append(material)
    if other == "mixed":
        tree = material.node_tree
        glass = tree.nodes["Glass BSDF"]
        mix = add_node(tree, "ShaderNodeMixShader", Fac=0.4)
        clear = add_node(tree, "ShaderNodeBsdfTransparent", Color=(1, 1, 1, 1))
        for socket, shader in zip(mix.inputs[1:], (glass, clear), strict=True):
            tree.links.new(shader.outputs[0], socket)
        finish(tree, mix)
    else:
        cube.data.materials.append(shader_material(other, "Other", Color=(1, 1, 1, 1)))
        for face in cube.data.polygons:
            face.material_index = face.index % 2
    tree = new_world(scene)
    finish(tree, add_node(tree, "ShaderNodeBackground", Strength=1.0, Color=(1, 1, 1, 1)))
    scene.cycles.transparent_max_bounces = 64
    scene.camera.location, cube.rotation_euler = (0, 0, 4), (0.4, 0.3, 0.2)
    settings: Any = {"width": 64, "height": 32, "photons": 1 << 14, "passes": 16}
    found, _ = export()
    seen = render(device, found, mirror_depth=64, **settings)["Combined"][..., :3]
    lobes = [lobe for material in found.materials for lobe in material.lobes]
    is_open = [lobe.parameters["open"] == 1.0 for lobe in lobes if "open" in lobe.parameters]
    assert is_open == [other != "ShaderNodeBsdfDiffuse"]
    if other != "ShaderNodeBsdfDiffuse":
        assert seen.mean(axis=(0, 1)) == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize(("is_smooth", "named"), [(True, 1), (False, 0)])
def test_normals_that_lean_far_are_named(export, is_smooth, named) -> None:
    """Of a cube shaded smooth, as one forgets to mark its edges; once for all that share a mesh."""
    box = add_mesh("Box", CUBE)
    box.data.materials.append(shader_material("ShaderNodeBsdfGlass"))
    box.data.polygons.foreach_set("use_smooth", [is_smooth] * 6)
    add_object("Other", box.data, location=(5.0, 0.0, 0.0))
    found = [e for e in export()[1].of("approximated") if e.feature == "Smooth normals of glass"]
    assert len(found) == named and all("55 degrees" in entry.detail for entry in found)
