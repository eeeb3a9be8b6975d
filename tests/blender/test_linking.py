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


def collection_of(name: str, *objects: bpy.types.Object) -> bpy.types.Collection:
    made = bpy.data.collections.new(name)
    for obj in objects:
        made.objects.link(obj)
    return made


def instanced(name: str, *objects: bpy.types.Object) -> bpy.types.Object:
    """What an empty places that stands for a collection."""
    inside = collection_of(f"In {name}", *objects)
    return add_object(name, None, instance_type="COLLECTION", instance_collection=inside)


def taken_out(obj: bpy.types.Object) -> bpy.types.Object:
    """Out of the scene's own collections."""
    whole = bpy.context.scene.collection
    for collection in (whole, *whole.children):
        if obj.name in collection.objects:
            collection.objects.unlink(obj)
    return obj


def one_in_an_included_collection_excluded(lamp, left, right) -> None:
    linked(lamp, "EXCLUDE", left)
    lamp.light_linking.receiver_collection.children.link(collection_of("Inner", left, right))


def one_in_an_excluded_collection_included(lamp, left, right) -> None:
    linked(lamp, "INCLUDE", left)
    outer = lamp.light_linking.receiver_collection
    outer.children.link(collection_of("Inner", left, right))
    outer.collection_children[0].light_linking.link_state = "EXCLUDE"


def states_within(lamp, left, right) -> None:
    """Of a collection that is another light's: they are of no account here."""
    inner = collection_of("Inner", left)
    inner.collection_objects[0].light_linking.link_state = "EXCLUDE"
    linked(lamp, "INCLUDE")
    lamp.light_linking.receiver_collection.children.link(inner)


def an_instancer_included(lamp, left, right) -> None:
    linked(lamp, "INCLUDE", instanced("Instancer", taken_out(left)))


def an_instance_included(lamp, left, right) -> None:
    linked(lamp, "INCLUDE", left)
    instanced("Instancer", taken_out(left))


def a_lamp_instanced(lamp, left, right) -> None:
    linked(lamp, "INCLUDE", right)
    instanced("Instancer", taken_out(lamp))


@pytest.mark.parametrize(
    "arrange",
    [
        one_in_an_included_collection_excluded,
        one_in_an_excluded_collection_included,
        states_within,
        an_instancer_included,
        an_instance_included,
        a_lamp_instanced,
    ],
)
def test_whom_it_is_about(scene, export, cycles_mean, device, arrange) -> None:
    """Of two sheets each is lit, or not, as in Cycles."""
    left, right = (
        add_mesh(name, location=(x, 0, 0), scale=(0.9, 1, 1))
        for name, x in (("Left", -1.0), ("Right", 1.0))
    )
    for sheet in (left, right):
        sheet.data.materials.append(shader_material(DIFFUSE, Color=(0.6, 0.6, 0.6, 1)))
    arrange(add_light("Lamp", "POINT", energy=100.0, location=(0, 0, 2)), left, right)
    scene.camera.location.z, scene.camera.data.lens = 5.0, 40.0
    scene.render.resolution_x = scene.render.resolution_y = 16
    ours = render(device, export()[0], width=16, height=16, passes=1, photons=0)["Combined"]
    found, shown = (
        [half[..., :3].mean() > 0.01 for half in np.split(x, 2, axis=1)]
        for x in (ours, cycles_mean(4, 0))
    )
    assert found == shown and any(shown) and not all(shown)


def test_too_many_sets(export) -> None:
    """It is said; what is too much is lit as what no collection names."""
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
