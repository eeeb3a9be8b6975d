# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene's switches of caustics, against Cycles; and the line that says who casts some."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
import pytest

from addon.photon.scene import CAUSTICS
from tests.measure import render, replace

from .build import add_light, add_mesh, long_paths, shader_material
from .lobes import DIFFUSE, GLASS, GLOSSY, PRINCIPLED

pytestmark = pytest.mark.blender


def two_balls(scene: Any) -> None:
    """One of glass and one of metal, over the floor that a camera below them sees, under a lamp."""
    floor = shader_material(DIFFUSE, "Floor", Color=(0.8, 0.8, 0.8, 1))
    add_mesh("Floor", scale=(4, 4, 1)).data.materials.append(floor)
    shaders = (
        (GLASS, "Glass", {"Roughness": 0.0, "IOR": 1.5}),
        (GLOSSY, "Metal", {"Roughness": 0.2}),
    )
    for x, (shader, name, inputs) in zip((-1.0, 1.0), shaders, strict=True):
        bpy.ops.mesh.primitive_uv_sphere_add(
            segments=32, ring_count=16, location=(x, 0, 1.5), radius=0.8
        )
        bpy.ops.object.shade_smooth()
        bpy.context.object.name = f"Ball of {name}"
        bpy.context.object.data.materials.append(shader_material(shader, name, **inputs))
    add_light("Lamp", "AREA", energy=300.0, size=1.0, location=(0, 0, 4))
    scene.camera.location, scene.camera.rotation_euler = (0, -0.5, 0.6), (0.65, 0, 0)
    scene.camera.data.lens = 14
    long_paths(scene)


@pytest.mark.parametrize("off", ("both", "reflective", "refractive", "none"))
def test_switches(scene, cycles_mean, export, device, off, thorough) -> None:
    """With one off its light is missing as in Cycles: 1.2 % in the mean, 2 % in blocks."""
    if not thorough and off != "both":
        pytest.skip("runs with --thorough")
    two_balls(scene)
    for name in ("reflective", "refractive"):
        setattr(scene.cycles, f"caustics_{name}", off not in (name, "both"))
    theirs = cycles_mean(256 if thorough else 128, 1)[..., :3].astype(float)
    found, _ = export()
    settings: Any = {"width": 64, "height": 32, "photons": 1 << 17, "passes": 12}
    settings |= {"mirror_depth": 32, "radius_decay": 2 / 3}
    ours = render(device, found, **settings)["Combined"][..., :3].astype(float)

    def blocks(image: Any) -> Any:
        return image.reshape(4, 8, 8, 8, 3).mean(axis=(1, 3, 4))

    away = np.median(np.abs(blocks(ours) - blocks(theirs))) / theirs.mean()
    mean = ours.mean() / theirs.mean() - 1
    print(f"\n{off}: mean {theirs.mean():.4f}, {mean:.2%}, blocks {away:.2%}")
    assert abs(mean) < 0.012 and away < 0.02
    other = {} if off == "none" else {"caustics": CAUSTICS}
    with_all = render(device, replace(found, **other), **settings)["Combined"][..., :3].mean()
    assert off == "none" or ours.mean() < 0.96 * with_all


def test_report_says_who_casts_them(scene, export) -> None:
    two_balls(scene)
    casters = "'Ball of Glass' refracts by 'Glass'; 'Ball of Metal' reflects by 'Metal'"
    _, report = export()
    assert f"exact: Scene 'Scene': Caustics: {casters}" in map(str, report.entries)
    assert not report.of("ignored")
    scene.cycles.blur_glossy = 1.0
    assert [entry.feature for entry in export()[1].of("ignored")] == ["Filter Glossy"]
    scene.cycles.blur_glossy = 0.0
    scene.cycles.caustics_refractive = False
    found, report = export()
    entries = [str(entry) for entry in report.entries if "austics" in entry.feature]
    assert found.caustics == ("reflective",) and entries == [
        "exact: Scene 'Scene': Refractive caustics: off: no light comes to diffuse surfaces by such"
        " lobes",
        "exact: Scene 'Scene': Caustics: 'Ball of Metal' reflects by 'Metal'",
    ]
    assert not [entry for entry in report.entries if entry.status == "approximated"]


def test_thin_sheets_cast_none(scene, export) -> None:
    """What lets light through evenly is no caster, and no switch is for it."""
    sheet = shader_material("ShaderNodeBsdfTranslucent", "Sheet")
    add_mesh("Sheet").data.materials.append(sheet)
    add_light("Lamp", "POINT", energy=10.0, location=(0, 0, 2))
    _, report = export()
    assert not [entry for entry in report.entries if "austics" in entry.feature]
    scene.cycles.caustics_refractive = False
    _, report = export()
    noted = [entry for entry in report.entries if entry.status == "approximated"]
    assert [entry.feature for entry in noted] == ["Caustics"]


@pytest.mark.parametrize("roughness", [0.0, 0.5])
def test_rough_diffuse_surfaces_are_noted(scene, export, roughness: float) -> None:
    """Their rays may find what is switched off; Lambert's lobe sends none."""
    scene.cycles.caustics_refractive = False
    wall = shader_material("ShaderNodeBsdfDiffuse", "Wall", Roughness=roughness)
    add_mesh("Wall").data.materials.append(wall)
    _, report = export()
    noted = [entry for entry in report.entries if entry.status == "approximated"]
    assert [entry.feature for entry in noted] == ["Caustics"] * (roughness > 0.0)


def test_gloss_over_colour_is_noted(scene, export) -> None:
    scene.cycles.caustics_reflective = False
    plastic = shader_material(PRINCIPLED, "Plastic", Roughness=0.3)
    add_mesh("Floor").data.materials.append(plastic)
    _, report = export()
    noted = [entry for entry in report.entries if entry.status == "approximated"]
    assert [entry.feature for entry in noted] == ["Reflective caustics"]
