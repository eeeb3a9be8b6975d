# SPDX-License-Identifier: GPL-3.0-or-later
"""To which rays objects are visible: by themselves, what instances them, and their collections."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

from addon.photon.scene import ALL_RAYS, CATCHER, HOLDOUT, RAY_BITS, RAYS

from .build import (
    add_light,
    add_mesh,
    add_node,
    add_object,
    features,
    finish,
    new_material,
    new_mesh,
    new_world,
    shader_material,
)

pytestmark = pytest.mark.blender


def bits_of(export) -> dict[str, int]:
    scene, report = export()
    assert not report.of("ignored") and not report.of("approximated")
    return dict(zip(scene.surfaces, scene.visible.tolist(), strict=True))


@pytest.mark.parametrize("kind", ["mesh", "curve", "instance", "instancer"])
@pytest.mark.parametrize("ray", RAYS)
def test_ray_visibility(export, kind, ray) -> None:
    """An instancer's counts for what it instances."""
    add_mesh("Beside")
    if kind == "mesh":
        obj = add_mesh("Thing")
    elif kind == "curve":
        curve = bpy.data.curves.new("Curve", "CURVE")
        curve.splines.new("POLY").points.add(1)
        curve.splines[0].points[1].co = (1, 0, 0, 1)
        curve.extrude = 0.1
        obj = add_object("Thing", curve)
    else:
        parts, part = (
            bpy.data.collections.new("Parts"),
            bpy.data.objects.new("Thing", new_mesh("Part")),
        )
        parts.objects.link(part)
        obj = add_object("Group", None, instance_type="COLLECTION", instance_collection=parts)
        obj = part if kind == "instance" else obj
    setattr(obj, f"visible_{ray}", False)
    assert bits_of(export) == {"Beside": ALL_RAYS, "Thing": ALL_RAYS - RAY_BITS[ray]}


def test_nothing_is_said_where_all_is_visible(export) -> None:
    add_mesh("Thing", visible_volume_scatter=False)  # there are no volumes
    scene, _ = export()
    assert scene.visible.shape == (0,) and scene.visible.dtype == np.uint8


@pytest.mark.parametrize(
    ("flag", "bits"),
    [("holdout", ALL_RAYS + HOLDOUT), ("indirect_only", ALL_RAYS - RAY_BITS["camera"])],
)
def test_collections(export, flag, bits) -> None:
    add_mesh("Beside")
    scene = bpy.context.scene
    inside = bpy.data.collections.new("Inside")
    scene.collection.children.link(inside)
    inside.objects.link(bpy.data.objects.new("Thing", new_mesh("Mesh")))
    assert export()[0].visible.shape == (0,)
    setattr(bpy.context.view_layer.layer_collection.children["Inside"], flag, True)
    assert bits_of(export) == {"Beside": ALL_RAYS, "Thing": bits}


def test_an_instancer_catches_shadows_and_has_a_light_group(export) -> None:
    """For what it instances, if that has none of its own."""
    bpy.context.view_layer.lightgroups.add(name="Key")
    bpy.context.view_layer.lightgroups.add(name="Own")
    parts = bpy.data.collections.new("Parts")
    things = [bpy.data.objects.new(name, new_mesh(name)) for name in ("Thing", "Other")]
    things[1].lightgroup = "Own"
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    for obj in (*things, lamp):
        parts.objects.link(obj)
    group = add_object("Group", None, instance_type="COLLECTION", instance_collection=parts)
    group.is_shadow_catcher, group.lightgroup = True, "Key"
    scene, _ = export()
    groups = dict(zip(scene.surfaces, scene.surface_groups, strict=True))
    assert groups == {"Thing": "Key", "Other": "Own"} and scene.lights[0].group == "Key"
    assert scene.visible.tolist() == [ALL_RAYS + CATCHER] * 2


def test_holdout_of_an_object(export) -> None:
    """It is more than Indirect Only, as in Cycles."""
    add_mesh("Thing", is_holdout=True)
    assert bits_of(export) == {"Thing": ALL_RAYS + HOLDOUT}


def test_holdout_shader(convert) -> None:
    hole, report = convert(shader_material("ShaderNodeHoldout"))
    assert hole.holdout and not any(hole.diffuse) and not hole.lobes
    assert features(report, "exact") == ["Shader"]


@pytest.mark.parametrize("share", [0.3, 1.0])
def test_partly_holdout(convert, share) -> None:
    material, tree = new_material()
    mixed = add_node(tree, "ShaderNodeMixShader")
    mixed.inputs[0].default_value = share
    for socket, kind in ((1, "ShaderNodeBsdfDiffuse"), (2, "ShaderNodeHoldout")):
        tree.links.new(add_node(tree, kind).outputs[0], mixed.inputs[socket])
    finish(tree, mixed)
    mixture, report = convert(material)
    assert mixture.holdout == (share == 1.0)
    assert features(report, "approximated") == ["Partly holdout"] * (share < 1.0)


def test_light_groups(export) -> None:
    """Those of the view layer: what is in another is in none."""
    bpy.context.view_layer.lightgroups.add(name="Key")
    for name in ("Key", "Elsewhere"):
        add_mesh(f"In {name}", lightgroup=name)
        add_light(f"Lamp {name}", "POINT", energy=5.0).lightgroup = name
    scene, report = export()
    assert scene.light_groups == ("Key",)
    assert dict(zip(scene.surfaces, scene.surface_groups, strict=True)) == {
        "In Key": "Key",
        "In Elsewhere": "",
    }
    groups = {light.name: light.group for light in scene.lights}
    assert groups == {"Lamp Key": "Key", "Lamp Elsewhere": ""}
    assert not report.of("ignored")


@pytest.mark.parametrize("hidden", ["diffuse", "transmission", "glossy", ""])
@pytest.mark.parametrize("kind", ["Translucent", "Glass"])
def test_emission_that_shadow_rays_do_not_find(export, kind: str, hidden: str) -> None:
    """Of an object that is hidden from diffuse rays: those through Translucent BSDFs find it."""
    rays = {f"visible_{hidden}": False} if hidden else {}
    add_mesh("Glow", **rays).data.materials.append(shader_material("ShaderNodeEmission"))
    add_mesh("Pane").data.materials.append(shader_material(f"ShaderNodeBsdf{kind}"))
    said = [str(entry) for entry in export()[1].entries if entry.feature == "Ray Visibility"]
    assert len(said) == (kind == "Translucent" and hidden == "diffuse")
    assert all("Object 'Glow'" in text for text in said)


@pytest.mark.parametrize(
    ("ray", "roughness", "count"),
    [("glossy", 0.2, 1), ("transmission", 0.2, 1), ("glossy", 0.0, 0), ("diffuse", 0.2, 0)],
)
def test_lamps_that_rough_glass_shows_in_cycles(export, ray, roughness, count) -> None:
    """Shadow rays of it find those that are hidden from glossy rays or those of transmission."""
    setattr(add_light("Lamp", "AREA"), f"visible_{ray}", False)
    material = shader_material("ShaderNodeBsdfGlass", Roughness=roughness)
    add_mesh("Pane").data.materials.append(material)
    said = [str(entry) for entry in export()[1].entries if entry.feature == "Ray Visibility"]
    assert len(said) == count and all("Light 'Lamp'" in text for text in said)


@pytest.mark.parametrize(
    ("hidden", "strength"),
    [("shadow", 1.0), ("shadow", 0.0), ("diffuse", 1.0), ("diffuse", 0.0), ("glossy", 1.0)],
)
def test_what_the_world_lights_through(scene, export, hidden, strength) -> None:
    """In Cycles diffuse rays that look for it meet what shadow rays pass."""
    add_mesh("Thing", **{f"visible_{hidden}": False})
    tree = new_world(scene)
    finish(tree, add_node(tree, "ShaderNodeBackground", Strength=strength))
    said = [str(entry) for entry in export()[1].entries if entry.feature == "Ray Visibility"]
    assert len(said) == (hidden != "glossy" and strength > 0.0)


def test_shadow_catchers(export) -> None:
    """Where the eye sees them; a holdout is more."""
    add_mesh("Thing", is_shadow_catcher=True)
    add_mesh("Unseen", is_shadow_catcher=True, visible_camera=False)
    add_mesh("Hole", is_shadow_catcher=True, is_holdout=True)
    assert bits_of(export) == {
        "Thing": ALL_RAYS + CATCHER,
        "Unseen": ALL_RAYS - RAY_BITS["camera"],
        "Hole": ALL_RAYS + HOLDOUT,
    }
