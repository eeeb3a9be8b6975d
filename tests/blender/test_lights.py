# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights keep Blender's units, and what is not simulated is named."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest

from addon.photon.stage.kinds import light_kinds
from tests.measure import render

from .build import add_light, add_mesh, add_node, add_object, nodes_of, shader_material

pytestmark = pytest.mark.blender


def reported(report, status: str) -> list[tuple[str, str]]:
    return [(entry.object, entry.feature) for entry in report.of(status)]


def test_spot(export) -> None:
    add_light(
        "Spot",
        "SPOT",
        energy=100.0,
        color=(1.0, 0.5, 0.25),
        spot_size=math.radians(60),
        spot_blend=0.25,
        shadow_soft_size=0.0,
        location=(1.0, 2.0, 3.0),
        rotation_euler=(math.pi / 2, 0.0, 0.0),
        scale=(2.0, 2.0, 2.0),
    )
    scene, report = export()
    (light,) = scene.lights
    assert (light.name, light.kind) == ("Spot", "spot")
    assert list(light.parameters) == list(light_kinds()["spot"].parameters)
    assert light.parameters["radius"] == 0.0
    assert light.power == pytest.approx((100.0, 50.0, 25.0))
    assert light.position == pytest.approx((1.0, 2.0, 3.0))
    assert light.direction == pytest.approx((0.0, 1.0, 0.0), abs=1e-6)
    assert np.linalg.norm(light.direction) == pytest.approx(1.0, abs=1e-12)
    # 1 - cos of the angle from the axis: where it ends, and where it fades from.
    outer, inner = light.parameters["outer"], light.parameters["inner"]
    assert 2 * math.acos(1 - outer) == pytest.approx(math.radians(60))
    assert 1 - inner / outer == pytest.approx(0.25)
    assert ("Light 'Spot'", "Spot light") in reported(report, "exact")


@pytest.mark.parametrize("soft", [False, True])
def test_point_with_radius(export, soft) -> None:
    obj = add_light("Point", "POINT", energy=10.0, shadow_soft_size=0.5)
    if not hasattr(obj.data, "use_soft_falloff"):
        pytest.skip("this Blender's lights lack the property")
    obj.data.use_soft_falloff = soft
    scene, report = export()
    (light,) = scene.lights
    assert (light.kind, light.parameters) == ("point", {"radius": 0.5, "soft": float(soft)})
    assert list(light.parameters) == list(light_kinds()["point"].parameters)
    assert ("Light 'Point'", "Point light") in reported(report, "exact")


LIT = ("diffuse", "glossy", "transmission", "translucent", "media")
EVERYONE = ("camera", *LIT, "chains", "passing")


@pytest.mark.parametrize(
    ("hidden", "by_rays", "found_by"),
    [
        ((), True, EVERYONE),
        ((), False, LIT),
        (("camera",), True, EVERYONE[1:]),
        (("diffuse",), True, ("camera", "glossy", "transmission", "media", "chains", "passing")),
        (
            ("glossy",),
            True,
            ("camera", "diffuse", "transmission", "translucent", "media", "passing"),
        ),
        (("transmission",), True, ("camera", "diffuse", "glossy", "media", "chains")),
        (("glossy", "transmission"), True, ("camera", "diffuse", "media")),
        (("volume_scatter",), True, ("camera", *LIT[:-1], "chains", "passing")),
    ],
)
def test_who_finds_it(export, hidden, by_rays, found_by) -> None:
    """As in renders of Cycles 5.0, for all kinds alike."""
    for kind in ("POINT", "SPOT", "AREA", "SUN"):
        obj = add_light(kind, kind)
        obj.visible_camera = True  # which lights are not by default
        for who in hidden:
            setattr(obj, f"visible_{who}", False)
        obj.data.cycles.use_multiple_importance_sampling = by_rays
    lights = export()[0].lights
    assert [light.found_by for light in lights] == [found_by] * 4


@pytest.mark.parametrize("kind", ["POINT", "SPOT", "AREA", "SUN"])
def test_the_eye_sees_lamps_if_rays_meet_any(export, kind) -> None:
    """Without Multiple Importance, too, but suns: as in renders of Cycles 4.2 and 5.0."""
    met, unmet = (add_light(name, x) for name, x in (("A", "AREA"), ("B", kind)))
    unmet.visible_camera = True
    unmet.data.cycles.use_multiple_importance_sampling = False
    found = {light.name: light.found_by for light in export()[0].lights}
    assert ("camera" in found["B"]) == (kind != "SUN")
    met.data.cycles.use_multiple_importance_sampling = False
    assert all("camera" not in light.found_by for light in export()[0].lights)


@pytest.mark.parametrize("hidden", ["by its instancer", "by its collection"])
def test_a_lamp_is_hidden_as_objects_are(export, scene, hidden) -> None:
    """From Blender 4.4 on: as in renders of Cycles 4.2, 4.5 and 5.0."""
    inside = bpy.data.collections.new("Inside")
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "AREA"))
    lamp.visible_camera = True
    inside.objects.link(lamp)
    if hidden == "by its instancer":
        empty = add_object("Empty", None, instance_type="COLLECTION", instance_collection=inside)
        empty.visible_camera = False
    else:
        scene.collection.children.link(inside)
        bpy.context.view_layer.layer_collection.children["Inside"].indirect_only = True
    (light,) = export()[0].lights
    assert ("camera" in light.found_by) == (bpy.app.version < (4, 4))


@pytest.mark.parametrize(
    ("shape", "scale", "size", "is_round"),
    [
        ("SQUARE", (1.0, 1.0, 1.0), (0.5, 0.5), 0.0),
        ("RECTANGLE", (2.0, 1.0, 3.0), (1.0, 2.0), 0.0),
        ("DISK", (1.0, 1.0, 1.0), (0.5, 0.5), 1.0),
        ("ELLIPSE", (2.0, 1.0, 3.0), (1.0, 2.0), 1.0),
    ],
)
def test_area(export, shape, scale, size, is_round) -> None:
    """Its size goes with the object's scale, axis by axis."""
    add_light(
        "Area",
        "AREA",
        energy=3.0,
        shape=shape,
        size=0.5,
        size_y=2.0,
        scale=scale,
        rotation_euler=(0.0, 0.0, math.pi / 2),
    )
    scene, report = export()
    (light,) = scene.lights
    parameters = light.parameters
    assert (parameters["width"], parameters["height"]) == pytest.approx(size)
    assert (parameters["round"], parameters["cotangent"], parameters["gain"]) == (is_round, 0, 1)
    assert light.power == pytest.approx((3.0,) * 3)
    assert light.direction == pytest.approx((0.0, 0.0, -1.0), abs=1e-6)
    assert light.across == pytest.approx((0.0, 1.0, 0.0), abs=1e-6)
    assert ("Light 'Area'", "Area light") in reported(report, "exact")


def test_an_area_light_without_size_is_dark(export) -> None:
    add_light("Area", "AREA", size=0.0)
    assert not export()[0].lights


def test_spread(export) -> None:
    add_light("Area", "AREA", spread=math.radians(60))
    parameters = export()[0].lights[0].parameters
    assert parameters["cotangent"] == pytest.approx(math.sqrt(3), rel=1e-5)
    assert parameters["gain"] == pytest.approx(1 / (1 - math.pi / 6 * math.sqrt(3)), rel=1e-5)


def test_sun(export) -> None:
    add_light("Sun", "SUN", energy=3.0, angle=0.2, rotation_euler=(0.0, math.pi / 2, 0.0))
    scene, report = export()
    (light,) = scene.lights
    assert (light.kind, light.power) == ("sun", pytest.approx((3.0,) * 3))
    assert light.parameters["widest"] == pytest.approx(1 - math.cos(0.1))
    assert light.direction == pytest.approx((-1.0, 0.0, 0.0), abs=1e-6)
    assert ("Light 'Sun'", "Sun light") in reported(report, "exact")


def test_a_stretched_spot(export) -> None:
    add_light("Spot", "SPOT", scale=(2.0, 1.0, 4.0))
    parameters = export()[0].lights[0].parameters
    assert (parameters["stretch_x"], parameters["stretch_y"]) == pytest.approx((0.5, 0.25))


def test_several_at_once(export) -> None:
    for index in range(3):
        add_light(f"Light {index}", "POINT")
    assert [light.name for light in export()[0].lights] == ["Light 0", "Light 1", "Light 2"]


@pytest.mark.parametrize(
    ("kind", "properties", "factor"),
    [
        ("POINT", {"exposure": 2.0}, (4.0, 4.0, 4.0)),
        ("POINT", {"normalize": False, "shadow_soft_size": 0.5}, (math.pi,) * 3),
        ("POINT", {"normalize": False, "shadow_soft_size": 0.0}, (4.0, 4.0, 4.0)),
        ("AREA", {"normalize": False, "size": 0.5}, (0.25,) * 3),
        ("AREA", {"normalize": False, "size": 0.5, "shape": "DISK"}, (math.pi / 16,) * 3),
        ("SUN", {"normalize": False, "angle": 0.5}, (0.19231,) * 3),
        ("SUN", {"normalize": False, "angle": 0.0}, (1.0,) * 3),
        # What Blender 5.0 shows for 3000 K.
        ("POINT", {"use_temperature": True, "temperature": 3000.0}, (1.77084, 0.84428, 0.27222)),
    ],
)
def test_power_as_cycles_has_it(export, kind, properties, factor) -> None:
    obj = add_light("Light", kind, energy=10.0)
    if not hasattr(obj.data, next(iter(properties))):
        pytest.skip("this Blender's lights lack the property")
    for key, value in properties.items():
        setattr(obj.data, key, value)
    power = np.array(export()[0].lights[0].power)
    np.testing.assert_allclose(power, 10.0 * np.array(factor), rtol=1e-3)


def test_constant_light_shader_multiplies(export) -> None:
    inputs = emission(add_light("Light", "POINT", energy=10.0).data).inputs
    inputs["Color"].default_value = (1.0, 0.5, 0.0, 1.0)
    inputs["Strength"].default_value = 3.0
    assert export()[0].lights[0].power == pytest.approx((30.0, 15.0, 0.0))


def test_negative_power_is_taken_away(export) -> None:
    """By a light of its own; a colour of both signs makes two."""
    inputs = emission(add_light("Dark", "POINT", energy=-5.0).data).inputs
    (light,) = export()[0].lights
    assert light.power == (5.0, 5.0, 5.0) and light.subtracts
    tree = inputs["Color"].id_data
    both_signs = add_node(tree, "ShaderNodeCombineXYZ", X=1.0, Y=-1.0)
    tree.links.new(both_signs.outputs[0], inputs["Color"])
    scene, report = export()
    found = [(light.power, light.subtracts) for light in scene.lights]
    assert found == [((0.0, 5.0, 0.0), False), ((5.0, 0.0, 0.0), True)]
    assert not [entry for entry in report.entries if entry.status != "exact"]


def emission(light: bpy.types.Light) -> bpy.types.Node:
    """The Emission node of a light that is given nodes."""
    return next(node for node in nodes_of(light).nodes if node.type == "EMISSION")


@pytest.mark.parametrize("kelvin", [500, 1500, 3000, 5000, 9000, 20000])
def test_blackbody(export, kelvin) -> None:
    """As Blender shows the same temperature."""
    if bpy.app.version < (4, 5):
        pytest.skip("before Blender 4.5 lights have no temperature")
    light = add_light("Light", "POINT", energy=1.0).data
    colour = emission(light).inputs["Color"]
    node = add_node(light.node_tree, "ShaderNodeBlackbody", Temperature=kelvin)
    light.node_tree.links.new(node.outputs[0], colour)
    other = add_light("Other", "POINT", energy=1.0, use_temperature=True, temperature=kelvin)
    found, wanted = (light.power for light in export()[0].lights)
    assert other.data.use_temperature
    np.testing.assert_allclose(found, wanted, atol=4e-3)


@pytest.mark.parametrize(("socket", "power"), [("Quadratic", 0), ("Linear", 1), ("Constant", 2)])
def test_light_falloff(export, socket, power) -> None:
    light = add_light("Light", "POINT", energy=2.0).data
    strength, tree = emission(light).inputs["Strength"], light.node_tree
    node = add_node(tree, "ShaderNodeLightFalloff", Strength=3.0, Smooth=0.5)
    half = add_node(tree, "ShaderNodeMath")
    half.operation = "MULTIPLY"
    half.inputs[1].default_value = 0.5
    tree.links.new(node.outputs[socket], half.inputs[0])
    tree.links.new(half.outputs[0], strength)
    scene, report = export()
    (found,) = scene.lights
    assert (found.falloff, found.smoothing, found.power) == (power, 0.5, (3.0, 3.0, 3.0))
    assert ("Light 'Light'", "Point light") in reported(report, "exact")


@pytest.mark.parametrize(
    ("kind", "output", "expected"),
    [
        ("ShaderNodeObjectInfo", "Location", (1.0, 2.0, 3.0)),
        ("ShaderNodeObjectInfo", "Color", (0.25, 0.5, 0.75)),
        ("ShaderNodeObjectInfo", "Object Index", (7.0,) * 3),
        ("ShaderNodeAttribute", "Color", (0.5, 1.5, 2.5)),
        ("ShaderNodeVertexColor", "Color", ()),
        ("ShaderNodeNewGeometry", "Backfacing", ()),
    ],
)
def test_lamps_know_their_object(export, kind, output, expected) -> None:
    light = add_light("Light", "POINT", energy=2.0, location=(1.0, 2.0, 3.0), pass_index=7)
    light.color, light["own"] = (0.25, 0.5, 0.75, 1.0), (0.5, 1.5, 2.5)
    colour = emission(light.data).inputs["Color"]
    node = add_node(light.data.node_tree, kind)
    if kind == "ShaderNodeAttribute":
        node.attribute_type, node.attribute_name = "OBJECT", "own"
    light.data.node_tree.links.new(node.outputs[output], colour)
    scene, report = export()
    found = [light.power for light in scene.lights]
    assert found == [pytest.approx([2.0 * x for x in expected])] if expected else max(*found) == 0
    assert ("Light 'Light'", "Point light") in reported(report, "exact")


def test_lamps_random_numbers_are_those_of_cycles(scene, export, device, cycles_mean) -> None:
    scene.render.resolution_x = scene.render.resolution_y = 8
    plane = add_mesh("Plane", scale=(4, 4, 1))
    plane.data.materials.append(shader_material("ShaderNodeBsdfDiffuse"))
    light = add_light("A lamp", "POINT", energy=90.0, location=(0, 0, 2), shadow_soft_size=0.0)
    strength = emission(light.data).inputs["Strength"]
    info = add_node(light.data.node_tree, "ShaderNodeObjectInfo")
    light.data.node_tree.links.new(info.outputs["Random"], strength)
    ours = render(device, export()[0], width=8, height=8, passes=16)["Direct"]
    theirs = cycles_mean(16, 0)[..., :3]
    assert ours.mean() == pytest.approx(theirs.mean(), rel=0.02)


def test_skewed_area_lights_are_named(export) -> None:
    """A parent's uneven scale skews what is turned."""
    light = add_light("Light", "AREA", rotation_euler=(0.5, 0.4, 0.0))
    light.parent = add_object("Parent", None, scale=(2.0, 1.0, 1.0))
    assert ("Light 'Light'", "Skewed transform") in reported(export()[1], "approximated")


@pytest.mark.parametrize("socket", ["Quadratic", "Linear", "Constant"])
def test_a_sun_has_no_falloff(export, socket) -> None:
    """It is as far from everywhere, in Cycles too."""
    light = add_light("Light", "SUN", energy=2.0).data
    strength, tree = emission(light).inputs["Strength"], light.node_tree
    node = add_node(tree, "ShaderNodeLightFalloff", Strength=3.0, Smooth=0.5)
    tree.links.new(node.outputs[socket], strength)
    (found,) = export()[0].lights
    assert (found.falloff, found.smoothing, found.power) == (0, 0.0, (6.0,) * 3)


def test_unknown_features_are_named(export) -> None:
    obj = add_light("Lamp", "SPOT", use_shadow=False)
    obj.light_linking.blocker_collection = bpy.data.collections.new("Shadowing")
    assert ("Light 'Lamp'", "Shadow Linking") in reported(export()[1], "ignored")


def test_max_bounces_of_the_world(scene, export) -> None:
    """Cycles' rays of surfaces find it still: it is said."""
    world = scene.world = bpy.data.worlds.new("World")
    world.cycles.max_bounces = 0
    exported, report = export()
    assert [light.max_bounces for light in exported.lights] == [0]
    (entry,) = report.of("approximated")
    assert entry.feature == "Max Bounces" and entry.object == "World 'World'"


@pytest.mark.parametrize("bounces", [0, 1023, 1024])
def test_its_own_max_bounces(export, bounces) -> None:
    """Blender's default, 1024, is as many as the scene allows."""
    obj = add_light("Lamp", "SPOT", shadow_soft_size=0.0)
    obj.data.cycles.max_bounces = bounces
    scene, report = export()
    assert scene.lights[0].max_bounces == bounces
    found = [e.object for e in report.of("approximated") if e.feature == "Max Bounces"]
    assert found == (["Light 'Lamp'"] if bounces < 1024 else [])


@pytest.mark.parametrize("shadow", [True, False])
def test_cast_shadow(export, shadow) -> None:
    add_light("Lamp", "POINT", shadow_soft_size=0.0, use_shadow=shadow)
    scene, report = export()
    assert scene.lights[0].casts_shadow == shadow
    assert not report.of("ignored") and not report.of("approximated")


def test_blender_without_cycles(export, monkeypatch) -> None:
    """Cycles is an add-on: where it is off, lights and scenes lack its settings."""
    add_light("Lamp", "SPOT", shadow_soft_size=0.0, use_shadow=False)
    for kind in ("Light", "Scene"):
        monkeypatch.delattr(getattr(bpy.types, kind), "cycles")
    scene, report = export()
    assert not scene.lights[0].casts_shadow and not report.of("ignored")


def test_hidden_light_is_off(export) -> None:
    add_light("Off", "POINT").hide_render = True
    assert export()[0].lights == ()
