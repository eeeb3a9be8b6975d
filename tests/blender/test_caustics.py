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


@pytest.mark.thorough
@pytest.mark.parametrize("off", ("both", "reflective", "refractive", "none"))
def test_switches(scene, cycles_mean, export, device, off) -> None:
    """With one off its light is missing as in Cycles: 1.2 % in the mean, 2 % in blocks."""
    two_balls(scene)
    for name in ("reflective", "refractive"):
        setattr(scene.cycles, f"caustics_{name}", off not in (name, "both"))
    theirs = cycles_mean(256, 1)[..., :3].astype(float)
    found, _ = export()
    settings: Any = {"width": 64, "height": 32, "photons": 1 << 16, "passes": 12}
    settings |= {"mirror_depth": 32, "radius_decay": 2 / 3}
    ours = render(device, found, **settings)["Combined"][..., :3].astype(float)

    def blocks(image: Any) -> Any:
        return image.reshape(4, 8, 8, 8, 3).mean(axis=(1, 3, 4))

    away = np.median(np.abs(blocks(ours) - blocks(theirs))) / theirs.mean()
    mean = ours.mean() / theirs.mean() - 1
    print(f"\n{off}: mean {theirs.mean():.4f}, {mean:.2%}, blocks {away:.2%}")
    assert abs(mean) < 0.012 and away < 0.02
    other = {} if off == "none" else {"caustics": CAUSTICS}
    settings["passes"] = 4  # by far enough for that
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


def room(scene: Any, walls: Any, roughness: float) -> None:
    """Two balls in it, of glass and of metal so rough, and a lamp; a camera sees all."""
    bpy.ops.mesh.primitive_cube_add(size=1.0, location=(0, 0, 1.5))
    bpy.context.object.scale = (5, 5, 3)
    bpy.context.object.data.materials.append(walls)
    for x, shader, rough in ((-0.9, GLASS, 0.0), (0.9, GLOSSY, roughness)):
        bpy.ops.mesh.primitive_uv_sphere_add(location=(x, 0.6, 0.8), radius=0.7)
        bpy.ops.object.shade_smooth()
        bpy.context.object.data.materials.append(shader_material(shader, Roughness=rough))
    add_light("Lamp", "AREA", energy=60.0, size=1.0, location=(0, 0, 2.9))
    scene.camera.location, scene.camera.rotation_euler = (0, -2.4, 1.5), (1.4, 0, 0)
    scene.camera.data.lens = 18
    long_paths(scene)


WALLS = {
    "rough": (DIFFUSE, {"Color": (0.8, 0.8, 0.8, 1), "Roughness": 0.8}),
    "plastic": (PRINCIPLED, {"Base Color": (0.8, 0.8, 0.8, 1), "Roughness": 0.3}),
    "coated": (
        PRINCIPLED,
        {
            "Base Color": (0.8, 0.8, 0.8, 1),
            "Roughness": 0.6,
            "Coat Weight": 1.0,
            "Coat Tint": (0.8, 0.9, 1, 1),
        },
    ),
}


@pytest.mark.thorough
@pytest.mark.parametrize("off", ("both", "reflective", "refractive"))
@pytest.mark.parametrize("walls", WALLS)
def test_lobes_that_are_left_out(scene, cycles_mean, export, device, walls, off) -> None:
    """Rays of diffuse lobes find none, nor what they are layered over any darker for them."""
    shader, inputs = WALLS[walls]
    # Rough diffuse walls gather photons unless broad gloss is there, too.
    room(scene, shader_material(shader, "Walls", **inputs), 0.6 if walls == "rough" else 0.0)
    if walls == "rough":
        sheet = add_mesh("Sheet", location=(-1.2, -0.8, 1.0), rotation_euler=(1.57, 0, 0))
        sheet.data.materials.append(shader_material("ShaderNodeBsdfTranslucent", "Sheet"))
    for name in ("reflective", "refractive"):
        setattr(scene.cycles, f"caustics_{name}", off not in (name, "both"))
    theirs = cycles_mean(256, 1)[..., :3].astype(float)
    found, _ = export()
    settings: Any = {"width": 64, "height": 32, "photons": 1 << 15, "passes": 16}
    ours = render(device, found, mirror_depth=32, **settings)["Combined"][..., :3].astype(float)
    mean = ours.mean() / theirs.mean() - 1
    blocks = [image.reshape(4, 8, 8, 8, 3).mean(axis=(1, 3)) for image in (ours, theirs)]
    apart = np.median(np.abs(blocks[0] / blocks[1] - 1))
    print(f"\n{walls}, {off}: mean {theirs.mean():.4f}, {mean:.2%}, blocks {apart:.2%}")
    # The report says what is not exact: layers seen through glass.
    assert abs(mean) < (0.02 if off == "reflective" and walls != "rough" else 0.01)
    assert apart < (0.03 if walls == "rough" else 0.02)  # noise of rays


def test_thin_sheets_cast_none(scene, export) -> None:
    """What lets light through evenly is no caster, and no switch is for it."""
    sheet = shader_material("ShaderNodeBsdfTranslucent", "Sheet")
    add_mesh("Sheet").data.materials.append(sheet)
    add_light("Lamp", "POINT", energy=10.0, location=(0, 0, 2))
    for is_on in (True, False):
        scene.cycles.caustics_refractive = is_on
        _, report = export()
        assert not [entry for entry in report.of("approximated") if "austics" in entry.feature]
        assert is_on == (not [x for x in report.of("exact") if "austics" in x.feature])


@pytest.mark.parametrize(
    ("off", "shader", "inputs", "expected"),
    [
        (("reflective",), PRINCIPLED, {"Roughness": 0.3}, ["Reflective caustics"]),
        (("refractive",), PRINCIPLED, {"Roughness": 0.3}, []),
        (("reflective",), "ShaderNodeBsdfTranslucent", {}, ["Caustics"]),
        (("refractive",), DIFFUSE, {"Roughness": 0.5}, ["Caustics"]),
        (("refractive",), DIFFUSE, {"Roughness": 0.0}, []),
        (("reflective", "refractive"), PRINCIPLED, {"Roughness": 0.3}, []),
        (("reflective", "refractive"), DIFFUSE, {"Roughness": 0.5}, []),
    ],
)
def test_glass_by_one_kind_alone_is_noted(scene, export, off, shader, inputs, expected) -> None:
    """What is not as in Cycles beside rough glass, and nothing without any."""
    for name in off:
        setattr(scene.cycles, f"caustics_{name}", False)
    add_mesh("Floor").data.materials.append(shader_material(shader, "Floor", **inputs))
    _, report = export()
    assert not report.of("approximated")
    add_mesh("Pane").data.materials.append(shader_material(GLASS, "Pane", Roughness=0.3))
    _, report = export()
    assert [entry.feature for entry in report.of("approximated")] == expected
