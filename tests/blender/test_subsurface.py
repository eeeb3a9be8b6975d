# SPDX-License-Identifier: GPL-3.0-or-later
"""Light that scatters below surfaces, as Blender's nodes say."""

import math

import bpy
import numpy as np
import pytest

from addon.blender.export import SpecularModel
from addon.blender.export.shaders.subsurface import PATH, skin_paths
from tests.measure import render

from .build import add_light, add_mesh, features, shader_material

PRINCIPLED, NODE = "ShaderNodeBsdfPrincipled", "ShaderNodeSubsurfaceScattering"
COLOUR = (0.8, 0.4, 0.2)


@pytest.mark.parametrize(
    ("kind", "given"),
    [
        (PRINCIPLED, {"Subsurface_Weight": 0.5, "Subsurface_Anisotropy": 0.3}),
        (NODE, {"Anisotropy": 0.3}),
    ],
)
@pytest.mark.parametrize("model", SpecularModel)
def test_what_is_lost_is_said(convert, kind, given, model) -> None:
    found = features(convert(shader_material(kind, **given), model)[1], "approximated")
    diffuse = ["Subsurface"] if model is SpecularModel.PHONG else []
    anisotropy = [] if kind == PRINCIPLED and diffuse else ["Subsurface Anisotropy"]
    assert sorted({x for x in found if x.startswith("Subsurface")}) == diffuse + anisotropy


@pytest.mark.parametrize("method", ["RANDOM_WALK", "RANDOM_WALK_SKIN"])
def test_programs_of_how_rays_enter_are_said(convert, method) -> None:
    """Skin has an alpha of its own."""
    material = shader_material(PRINCIPLED, Subsurface_Weight=1.0)
    tree = material.node_tree
    tree.nodes["Principled BSDF"].subsurface_method = method
    noise = tree.nodes.new("ShaderNodeTexNoise")
    tree.links.new(noise.outputs["Fac"], tree.nodes["Principled BSDF"].inputs["Roughness"])
    expected = ["Subsurface"] if method == "RANDOM_WALK" else []
    assert features(convert(material)[1], "approximated") == expected


@pytest.mark.parametrize("kind", [PRINCIPLED, NODE])
def test_parameters(convert, kind) -> None:
    """The mean free path is a quarter of the radius over pi, and since Blender 5.2 the radius."""
    name = "Subsurface " if kind == PRINCIPLED else ""
    given = {f"{name}Radius": (1.0, 0.5, 0.2), f"{name}Scale": 0.1, "Roughness": 0.5, "IOR": 1.3}
    given |= {"Base Color" if name else "Color": (*COLOUR, 1.0)}
    given |= {"Subsurface Weight": 1.0} if name else {}
    given = {name.replace(" ", "_"): value for name, value in given.items()}
    material, report = convert(shader_material(kind, **given))
    lobe = material.lobes[-1]
    assert (lobe.kind, lobe.colour) == ("subsurface", pytest.approx(COLOUR))
    paths = [lobe.parameters[f"radius_{channel}"] for channel in "rgb"]
    is_later = bpy.app.version >= (5, 2)
    path = 0.1 if is_later else 0.1 * 0.25 / math.pi
    assert paths == pytest.approx([x * path for x in (1.0, 0.5, 0.2)])
    numbers = {name: lobe.parameters[name] for name in ("entry", "ior")}
    entry = 4.0 * is_later + (0.25 if name else 0.5)
    assert numbers == pytest.approx({"entry": entry, "ior": 1.3})
    assert lobe.parameters["albedo"] == pytest.approx(COLOUR)
    assert features(report, "exact") == ["Shader"]


@pytest.mark.parametrize("radius", [(0.0, 0.0, 0.0), None])
def test_what_is_diffuse(convert, radius) -> None:
    """Where light goes no way below; of a radius that nodes tell the report says so."""
    material = shader_material(NODE, Color=(*COLOUR, 1.0), Radius=radius or (1.0, 1.0, 1.0))
    if radius is None:
        tree = material.node_tree
        noise = tree.nodes.new("ShaderNodeTexNoise")
        tree.links.new(noise.outputs["Fac"], tree.nodes["Subsurface Scattering"].inputs["Scale"])
    found, report = convert(material)
    assert found.diffuse == pytest.approx(COLOUR) and not found.lobes
    assert features(report, "approximated") == ([] if radius else ["Subsurface"])


def test_paths_of_skin() -> None:
    """Of what scatters all light none is short; of black the dipole's length is sqrt(3)."""
    dark, bright = skin_paths((0.0, 1.0), 1.4)
    assert dark == pytest.approx(math.sqrt(3.0)) and bright < 0.01


@pytest.mark.thorough("RANDOM_WALK_SKIN", "slab")
@pytest.mark.parametrize("method", ["RANDOM_WALK", "RANDOM_WALK_SKIN"])
@pytest.mark.parametrize("shape", ["slab", "ball"])
def test_pictures(scene, export, device, cycles_mean, thorough, shape, method) -> None:
    """Mean and blocks of 8 x 8 pixels."""
    # Not so far that light comes through, which lights nothing else.
    far = PATH if bpy.app.version >= (5, 2) and method == "RANDOM_WALK" else 1.0
    given = {"Base_Color": (*COLOUR, 1.0), "Subsurface_Weight": 1.0, "Subsurface_Scale": 0.3 * far}
    given |= {"Subsurface_Radius": (1.0, 0.4, 0.2), "Roughness": 0.5}
    material = shader_material(PRINCIPLED, **given)
    material.node_tree.nodes["Principled BSDF"].subsurface_method = method
    if shape == "ball":
        bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32, radius=1)
        bpy.ops.object.shade_smooth()
        grey = shader_material("ShaderNodeBsdfDiffuse", Color=(0.5, 0.5, 0.5, 1))
        add_mesh("Floor", location=(0, 0, -1), scale=(4, 4, 1)).data.materials.append(grey)
        bpy.context.view_layer.objects.active = bpy.data.objects["Sphere"]
    else:
        bpy.ops.mesh.primitive_cube_add(size=8, location=(0, 0, -4))
    bpy.context.object.data.materials.append(material)
    where = {"location": (3, 0.5, 3), "rotation_euler": (0, 0.8, 0)}
    add_light("Lamp", "AREA", energy=300, size=0.5, **where)
    scene.camera.location, scene.camera.rotation_euler = (0, -5, 1.5), (1.3, 0, 0)
    scene.render.resolution_x = scene.render.resolution_y = 48
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BOX", 1.0
    scene.cycles.max_bounces, scene.cycles.diffuse_bounces = 12, 8
    times = 4 if thorough else 1
    theirs = cycles_mean(times * 128, 1)[..., :3]
    settings = {"width": 48, "height": 48, "passes": times * 24, "transparent": True}
    ours = render(device, export()[0], mirror_depth=12, **settings)["Combined"][..., :3]
    mean = theirs.mean(axis=(0, 1))
    assert ours.mean(axis=(0, 1)) == pytest.approx(mean, rel=0.02 / times**0.5)
    one, other = (x.reshape(6, 8, 6, 8, 3).mean(axis=(1, 3)) for x in (ours, theirs))
    off = np.abs(one - other) / np.maximum(other, 0.1 * mean)
    assert np.median(off) < 0.04 / times**0.5
