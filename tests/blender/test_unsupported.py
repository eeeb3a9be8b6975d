# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings that Cycles hears and we don't are in the report; what a view layer leaves out is."""

from __future__ import annotations

import bpy
import pytest

from .build import add_mesh, shader_material
from .lobes import DIFFUSE

pytestmark = pytest.mark.blender


def test_scene_wide_features_are_named(scene, export) -> None:
    """Rolling Shutter and Overscan among them, which are no part of the picture."""
    scene.render.use_motion_blur = True
    scene.cycles.rolling_shutter_type = "TOP"
    scene.eevee.use_overscan = True
    report = export()[1]
    assert [e.feature for e in report.of("ignored")] == ["Rolling Shutter", "Overscan"]


def test_where_shadow_rays_begin(scene, export) -> None:
    """An object's Geometry Offset is exported where it is not what new objects have."""
    obj = add_mesh("Plane")
    assert not len(export()[0].terminators)
    obj.shadow_terminator_geometry_offset = 0.0
    exported, report = export()
    assert exported.terminators.tolist() == [0.0] and not report.of("ignored")


@pytest.mark.parametrize("name", ["Camera Cull", "Distance Cull"])
def test_culling_is_named(scene, export, name) -> None:
    """While Simplify is on."""
    setattr(scene.cycles, f"use_{name.lower().replace(' ', '_')}", True)
    assert not export()[1].of("ignored")
    scene.render.use_simplify = True
    assert [entry.feature for entry in export()[1].of("ignored")] == [name]


@pytest.mark.parametrize(
    ("path", "value", "feature"),
    [
        ("scene.cycles.diffuse_bounces", 0, "Diffuse Bounces"),
        ("scene.cycles.use_fast_gi", True, "Fast GI Approximation"),
        ("scene.cycles.film_transparent_glass", True, "Transparent Glass"),
        ("layer.use_pass_vector", True, "Passes"),
        ("layer.cycles.use_pass_shadow_catcher", True, "Passes"),
        ("obj.shadow_terminator_shading_offset", 0.5, "Shadow Terminator Shading Offset"),
        ("material.cycles.use_bump_map_correction", False, "Bump Map Correction"),
    ],
)
def test_settings_are_named(scene, export, path, value, feature) -> None:
    """And nothing else is, as Blender sets them."""
    material = shader_material(DIFFUSE)
    obj = add_mesh("Plane")
    obj.data.materials.append(material)
    scene.render.film_transparent = True
    assert not export()[1].lines()
    root, *names, name = path.split(".")
    owner = {"scene": scene, "layer": scene.view_layers[0], "obj": obj, "material": material}[root]
    for each in names:
        owner = getattr(owner, each)
    if not hasattr(owner, name):
        pytest.skip(f"{bpy.app.version_string} has no {name}")
    setattr(owner, name, value)
    assert [entry.feature for entry in export()[1].of("ignored")] == [feature]


def test_view_layers_leave_out(scene, export) -> None:
    """Its Sky the world, its Solid meshes."""
    add_mesh("Plane")
    scene.world = bpy.data.worlds.new("World")
    if bpy.app.version < (5, 0):
        scene.world.use_nodes = False
    layer = scene.view_layers[0]
    whole = export()[0]
    assert whole.lights and len(whole.triangles)
    layer.use_sky = False
    assert not export()[0].lights
    layer.use_solid = False
    assert not len(export()[0].triangles)


@pytest.mark.parametrize(("kind", "left_out"), [("GAS", True), ("LIQUID", False)])
def test_the_box_of_smoke_is_left_out(export, kind, left_out) -> None:
    """A domain of a liquid, whose mesh is the water, is not."""
    fluid = add_mesh("Domain").modifiers.new("Fluid", "FLUID")
    fluid.fluid_type = "DOMAIN"
    fluid.domain_settings.domain_type = kind
    exported, report = export()
    assert left_out == (not len(exported.triangles))
    assert left_out == any(entry.feature == "Smoke or fire" for entry in report.of("ignored"))


def test_grease_pencils_are_no_loss(scene, export) -> None:
    """Blender draws them over every engine's picture."""
    kinds = [kind for kind in ("grease_pencils_v3", "grease_pencils") if hasattr(bpy.data, kind)]
    pencil = getattr(bpy.data, kinds[0]).new("Pencil")
    scene.collection.objects.link(bpy.data.objects.new("Pencil", pencil))
    report = export()[1]
    assert [e.feature for e in report.entries if e.object == "Object 'Pencil'"] == ["Grease Pencil"]
    assert not report.of("ignored")
