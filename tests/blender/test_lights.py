# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights keep Blender's units, and what is not simulated is named."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest

from addon.photon.stage.kinds import light_kinds

from .build import add_light

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


@pytest.mark.parametrize(
    ("radius", "camera", "glossy", "said"),
    [
        (0.5, False, True, "its sphere lights, but is not seen in mirrors"),
        (0.5, True, True, "its sphere lights, but is not seen directly or in mirrors"),
        (0.5, True, False, "its sphere lights, but is not seen directly"),
        (0.5, False, False, ""),
        (0.0, True, True, ""),
    ],
)
def test_point_with_radius(export, radius, camera, glossy, said) -> None:
    """The sphere that Cycles would show is named."""
    obj = add_light("Point", "POINT", energy=10.0, shadow_soft_size=radius)
    obj.visible_camera, obj.visible_glossy = camera, glossy
    if hasattr(obj.data, "use_soft_falloff"):
        obj.data.use_soft_falloff = False
    scene, report = export()
    (light,) = scene.lights
    assert (light.kind, light.parameters) == ("point", {"radius": radius})
    assert list(light.parameters) == list(light_kinds()["point"].parameters)
    assert [e.detail for e in report.of("approximated") if e.feature == "Radius"] == [said] * bool(
        said
    )
    exact = ("Light 'Point'", "Point light") in reported(report, "exact")
    assert exact == (not said and glossy)


def test_several_at_once(export) -> None:
    for index in range(3):
        add_light(f"Light {index}", "POINT")
    assert [light.name for light in export()[0].lights] == ["Light 0", "Light 1", "Light 2"]


@pytest.mark.parametrize(
    ("properties", "factor"),
    [
        ({"exposure": 2.0}, (4.0, 4.0, 4.0)),
        ({"normalize": False, "shadow_soft_size": 0.5}, (math.pi,) * 3),
        ({"normalize": False, "shadow_soft_size": 0.0}, (4.0, 4.0, 4.0)),
        # What Blender 5.0 shows for 3000 K.
        ({"use_temperature": True, "temperature": 3000.0}, (1.77084, 0.84428, 0.27222)),
    ],
)
def test_power_as_cycles_has_it(export, properties, factor) -> None:
    obj = add_light("Light", "POINT", energy=10.0)
    if not hasattr(obj.data, next(iter(properties))):
        pytest.skip("this Blender's lights lack the property")
    for key, value in properties.items():
        setattr(obj.data, key, value)
    power = np.array(export()[0].lights[0].power)
    np.testing.assert_allclose(power, 10.0 * np.array(factor), rtol=1e-3)


def test_constant_light_shader_multiplies(export) -> None:
    light = add_light("Light", "POINT", energy=10.0).data
    light.use_nodes = True
    emission = next(node for node in light.node_tree.nodes if node.type == "EMISSION")
    emission.inputs["Color"].default_value = (1.0, 0.5, 0.0, 1.0)
    emission.inputs["Strength"].default_value = 3.0
    assert export()[0].lights[0].power == pytest.approx((30.0, 15.0, 0.0))


def test_negative_energy_is_clamped_and_reported(export) -> None:
    add_light("Dark", "POINT", energy=-5.0)
    scene, report = export()
    assert scene.lights[0].power == (0.0, 0.0, 0.0)
    (entry,) = [e for e in report.of("approximated") if e.feature == "Negative power"]
    assert entry.object == "Light 'Dark'" and "-5" in entry.detail


@pytest.mark.parametrize("kind", ["SUN", "AREA"])
def test_other_kinds_are_named(export, kind) -> None:
    add_light("Lamp", kind)
    scene, report = export()
    assert scene.lights == ()
    assert ("Light 'Lamp'", f"{kind.capitalize()} light") in reported(report, "ignored")


def test_unknown_features_are_named(export) -> None:
    obj = add_light("Lamp", "SPOT", scale=(1.0, 1.0, 2.0), shadow_soft_size=0.0)
    obj.visible_glossy = False
    report = export()[1]
    assert ("Light 'Lamp'", "Ray Visibility") in reported(report, "ignored")
    assert ("Light 'Lamp'", "Uneven scale") in reported(report, "approximated")


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
