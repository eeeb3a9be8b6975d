# SPDX-License-Identifier: GPL-3.0-or-later
"""Light Linking: which lamps and emissive objects light which things, as Cycles has it."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

from addon.photon.scene import MOST_LINKED_SETS
from tests.measure import render

from .build import CUBE, add_light, add_mesh, add_object, shader_material
from .lobes import DIFFUSE, GLOSSY

pytestmark = pytest.mark.blender

SIZE = 32
RED, GREEN, BLUE = (1.0, 0.2, 0.2), (0.2, 1.0, 0.2), (0.2, 0.2, 1.0)


def linked(light: bpy.types.Object, state: str, *objects: bpy.types.Object) -> None:
    """Let a light's collection hold these."""
    found = bpy.data.collections.new(f"Of {light.name}")
    light.light_linking.receiver_collection = found
    for obj in objects:
        found.objects.link(obj)
    for entry in found.collection_objects:
        entry.light_linking.link_state = state


def things() -> dict[str, bpy.types.Object]:
    """A floor, a diffuse box, a mirror, and something rough and shiny; a lamp, a sun and a glowing
    plate."""
    grey = shader_material(DIFFUSE, Color=(0.6, 0.6, 0.6, 1))
    found = {
        "floor": add_mesh("Floor", scale=(3, 3, 1)),
        "box": add_mesh("Box", CUBE, location=(-0.8, 0.4, 0.4), scale=(0.3, 0.3, 0.4)),
        "mirror": add_mesh("Mirror", CUBE, location=(0.1, 1.0, 0.6), scale=(0.6, 0.05, 0.6)),
        "gloss": add_mesh("Gloss", CUBE, location=(0.9, 0.2, 0.4), scale=(0.3, 0.3, 0.4)),
        "plate": add_mesh("Plate", location=(0.0, -0.6, 1.8), scale=(0.3, 0.3, 1)),
    }
    for name in ("floor", "box"):
        found[name].data.materials.append(grey)
    found["mirror"].data.materials.append(shader_material(GLOSSY, Roughness=0.0))
    found["gloss"].data.materials.append(shader_material(GLOSSY, Roughness=0.4))
    glow = shader_material("ShaderNodeEmission", "Glow", Color=(*BLUE, 1), Strength=8.0)
    found["plate"].data.materials.append(glow)
    at = {"location": (1.5, -1.0, 2.0), "shadow_soft_size": 0.2, "energy": 60.0}
    sky = {"energy": 0.6, "angle": 0.6, "rotation_euler": (0.5, -0.3, 0.0)}  # which rays meet
    found["lamp"] = add_light("Lamp", "POINT", color=RED, **at)
    found["sun"] = add_light("Sun", "SUN", color=GREEN, **sky)
    return found


CASES = {
    "none": (),
    "box alone by the lamp": (("lamp", "INCLUDE", ("box",)),),
    "floor not by the sun": (("sun", "EXCLUDE", ("floor",)),),
    "mirror and gloss not by the lamp": (("lamp", "EXCLUDE", ("mirror", "gloss")),),
    "floor alone by the plate": (("plate", "INCLUDE", ("floor",)),),
    "gloss not by the plate": (("plate", "EXCLUDE", ("gloss", "mirror")),),
    "all at once": (
        ("lamp", "INCLUDE", ("box", "gloss")),
        ("sun", "EXCLUDE", ("box", "floor")),
        ("plate", "EXCLUDE", ("floor",)),
    ),
    "nothing by the lamp": (("lamp", "INCLUDE", ()), ("sun", "INCLUDE", ("sun",))),
}


@pytest.mark.thorough("0-none", "0-box", "0-floor", "0-gloss", "0-mirror", "12-none", "12-gloss")
@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("bounces", [0, 12])
def test_pictures(scene, export, cycles_mean, device, name, bounces) -> None:
    """Direct light, what rays find, and what photons bring."""
    made = things()
    for light, state, objects in CASES[name]:
        linked(made[light], state, *(made[x] for x in objects))
    scene.camera.location, scene.camera.rotation_euler = (0, -4.5, 2.4), (1.13, 0, 0)
    scene.camera.data.lens = 45.0
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BOX", 1.0
    scene.cycles.max_bounces, scene.cycles.blur_glossy = bounces, 0.0
    shown = cycles_mean(512, 1)[..., :3]
    exported, report = export()
    assert not any("Linking" in entry.feature for entry in report.entries)
    settings = {"width": SIZE, "height": SIZE, "passes": 48, "mirror_depth": bounces}
    settings |= {"photons": 20000 if bounces else 0, "transparent": True}
    ours = render(device, exported, **settings)["Combined"][..., :3]
    assert ours.mean(axis=(0, 1)) == pytest.approx(shown.mean(axis=(0, 1)), rel=0.02)
    blocks = [x.reshape(8, 4, 8, 4, 3).mean(axis=(1, 3)) for x in (ours, shown)]
    off = np.abs(blocks[0] - blocks[1]) / np.maximum(blocks[1], 0.1 * shown.mean())
    assert np.median(off) < 0.04 and np.percentile(off, 95) < 0.3


def test_instances_go_by_their_instancer(export) -> None:
    """And what is inside a collection by that."""
    inside = bpy.data.collections.new("Inside")
    part = bpy.data.objects.new("Part", add_mesh("Other").data)
    inside.objects.link(part)
    empty = add_object("Empty", None, instance_type="COLLECTION", instance_collection=inside)
    lamp = add_light("Lamp", "POINT")
    linked(lamp, "INCLUDE", empty)
    scene, _ = export()
    (light,) = scene.lights
    sets = dict(zip(scene.surfaces, scene.linked.tolist(), strict=True))
    assert sets == {"Other": 0, "Part": 1} and light.excludes == 1


def test_collections_in_collections(export) -> None:
    """One that is excluded excludes all in it."""
    first, second = add_mesh("First"), add_mesh("Second")
    lamp = add_light("Lamp", "POINT")
    linked(lamp, "INCLUDE")
    outer = lamp.light_linking.receiver_collection
    inner = bpy.data.collections.new("Inner")
    outer.children.link(inner)
    inner.objects.link(first)
    outer.collection_children[0].light_linking.link_state = "EXCLUDE"
    scene, _ = export()
    sets = dict(zip(scene.surfaces, scene.linked.tolist(), strict=True))
    assert sets == {first.name: 1, second.name: 0} and scene.lights[0].excludes == 2


def test_too_many_sets(export) -> None:
    """It is said; what is too much is lit by all."""
    for number in range(MOST_LINKED_SETS + 2):
        lamp = add_light(f"Lamp {number}", "POINT")
        linked(lamp, "EXCLUDE", add_mesh(f"Thing {number}"))
    scene, report = export()
    assert scene.linked.max() == MOST_LINKED_SETS - 1
    assert sum(light.excludes == 0 for light in scene.lights) == 3
    assert "Light Linking" in [entry.feature for entry in report.of("approximated")]


def test_nothing_is_linked(export) -> None:
    add_mesh("Thing")
    add_light("Lamp", "POINT")
    scene, _ = export()
    assert not len(scene.linked) and scene.lights[0].excludes == 0
