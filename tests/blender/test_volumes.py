# SPDX-License-Identifier: GPL-3.0-or-later
"""Volumes as Cycles has them, inside meshes and in the world, and what is said of others."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import bpy
import numpy as np
import pytest

from addon.blender.export.blackbody import blackbody
from addon.blender.settings import settings_from
from addon.photon.scene import NO_MEDIUM
from tests.measure import render
from tests.scenes import icosphere

from .build import (
    CUBE,
    add_light,
    add_mesh,
    add_node,
    features,
    finish,
    new_material,
    new_world,
    shader_material,
)
from .lobes import DIFFUSE
from .test_motion import go

pytestmark = pytest.mark.blender

SIZE, BLOCK = 32, 8
BALL = tuple(x.tolist() for x in icosphere(3))
ABSORBS, SCATTERS = "ShaderNodeVolumeAbsorption", "ShaderNodeVolumeScatter"
PRINCIPLED = "ShaderNodeVolumePrincipled"


def fog(kind: str = PRINCIPLED, **inputs: Any) -> bpy.types.Material:
    """A material without a surface."""
    material, tree = new_material("Fog")
    finish(tree, add_node(tree, kind, **inputs), "Volume")
    return material


def both(tree: bpy.types.NodeTree, kind: str, *parts: bpy.types.Node) -> bpy.types.Node:
    """An Add or Mix Shader of two nodes."""
    node = tree.nodes.new(kind)
    for part, socket in zip(parts, node.inputs[-2:], strict=True):
        tree.links.new(part.outputs[0], socket)
    return node


def box(scene: bpy.types.Scene) -> None:
    """The sun comes through its sides."""
    cube = add_mesh("Box", CUBE, location=(0, 0, 1.0), scale=(1, 1, 0.9))
    colours = {"Color": (0.9, 0.6, 0.3, 1), "Absorption_Color": (0.1, 0.3, 0.9, 1)}
    cube.data.materials.append(fog(Density=1.0, Anisotropy=0.4, **colours))
    ball = add_mesh("Ball", BALL, location=(0.3, -0.2, 1.0), scale=(0.4,) * 3)
    ball.data.materials.append(fog(SCATTERS, Density=4.0, Color=(0.2, 0.5, 0.9, 1)))
    add_light("Sun", "SUN", energy=3, rotation_euler=(0.5, 0.3, 0))


def about_all(scene: bpy.types.Scene) -> None:
    """Camera and lamp are inside; a spot's beam is seen."""
    cube = add_mesh("Box", CUBE, scale=(12, 12, 12))
    scatter = fog(SCATTERS, Color=(0.5, 0.8, 0.9, 1), Density=0.15, Anisotropy=0.3)
    cube.data.materials.append(scatter)
    add_light("Spot", "SPOT", location=(-0.5, 0, 2.2), energy=80.0, spot_size=0.9)


def in_world(scene: bpy.types.Scene) -> None:
    """The sky is lost in it. A panel lights, and what is glossy has two kinds of rays."""
    tree = new_world(scene)
    finish(tree, add_node(tree, "ShaderNodeBackground", Color=(0.5, 0.7, 1.0, 1)))
    finish(tree, add_node(tree, PRINCIPLED, Density=0.12, Color=(0.7, 0.8, 0.9, 1)), "Volume")
    panel = add_mesh("Panel", location=(0, 0, 1.4), rotation_euler=(1.0, 0.2, 0), scale=(0.4,) * 3)
    panel.data.materials.append(shader_material("ShaderNodeEmission", Strength=20.0))
    ball = add_mesh("Ball", BALL, location=(1.2, 0, 0.5), scale=(0.5,) * 3)
    glossy = shader_material("ShaderNodeBsdfPrincipled", Roughness=0.4)
    ball.data.materials.append(glossy)


def under_sky(scene: bpy.types.Scene) -> None:
    """What only the world lights, and what lets light through from behind, elsewhere."""
    tree = new_world(scene)
    finish(tree, add_node(tree, "ShaderNodeBackground", Color=(0.5, 0.7, 1.0, 1)))
    ball = add_mesh("Ball", BALL, location=(0, 0, 1.0), scale=(0.8,) * 3)
    ball.data.materials.append(fog(Density=2.0, Color=(0.9, 0.7, 0.5, 1), Anisotropy=-0.3))
    leaf = add_mesh("Leaf", location=(1.5, 0, 1.0), rotation_euler=(1.2, 0, 0), scale=(0.4,) * 3)
    leaf.data.materials.append(shader_material("ShaderNodeBsdfTranslucent"))


def clouds(scene: bpy.types.Scene) -> None:
    """By coordinates of the mesh and of objects that share a material; one differs in colour."""
    material, tree = new_material("Cloud")
    noise = add_node(tree, "ShaderNodeTexNoise", Scale=3.0)
    ramp = add_node(tree, "ShaderNodeMapRange", Value=noise.outputs[0], To_Max=4.0)
    ramp.inputs["From Min"].default_value, ramp.inputs["From Max"].default_value = 0.45, 0.65
    finish(tree, add_node(tree, PRINCIPLED, Density=ramp.outputs[0], Anisotropy=0.3), "Volume")
    turned = {"rotation_euler": (0.3, 0.5, 0.2), "scale": (1.0, 0.6, 0.5)}
    add_mesh("Box", CUBE, location=(0, 0, 1.4), **turned).data.materials.append(material)
    material, tree = new_material("Puff")
    places = tree.nodes.new("ShaderNodeTexCoord")
    gradient = add_node(tree, "ShaderNodeTexGradient", Vector=places.outputs["Object"])
    gradient.gradient_type = "SPHERICAL"
    waves = add_node(tree, "ShaderNodeTexWave", Scale=1.0)
    puff = add_node(tree, SCATTERS, Density=gradient.outputs[1], Color=waves.outputs[0])
    thick = add_node(tree, ABSORBS, Density=1.0, Color=(0.3, 0.5, 0.6, 1))
    finish(tree, both(tree, "ShaderNodeAddShader", puff, thick), "Volume")
    for x, size in ((-1.2, (0.6, 0.5, 0.5)), (1.3, (0.3, 0.3, 0.5))):
        ball = add_mesh("Ball", BALL, location=(x, -0.5, 0.7), scale=size)
        ball.data.materials.append(material)
    add_light("Sun", "SUN", energy=3, rotation_euler=(0.5, 0.3, 0))


def low_fog(scene: bpy.types.Scene) -> None:
    """Everywhere, as high as a lamp, whose beam is seen, with a sky above."""
    tree = new_world(scene)
    finish(tree, add_node(tree, "ShaderNodeBackground", Color=(0.02, 0.03, 0.05, 1)))
    geometry = tree.nodes.new("ShaderNodeNewGeometry")
    height = add_node(tree, "ShaderNodeSeparateXYZ", Vector=geometry.outputs["Position"])
    ranged = add_node(tree, "ShaderNodeMapRange", Value=height.outputs[2], To_Min=0.5, To_Max=0.0)
    ranged.inputs["From Max"].default_value = 2.5
    finish(tree, add_node(tree, SCATTERS, Density=ranged.outputs[0]), "Volume")
    add_light("Spot", "SPOT", location=(0.5, 0, 2.0), energy=100.0, spot_size=0.9)


def glows(scene: bpy.types.Scene) -> None:
    """Evenly, beside what shows it: rough, sharp, and without a lobe; through a wall of glass."""
    cube = add_mesh("Box", CUBE, location=(-0.6, 0, 0.9), scale=(0.3, 0.3, 0.6))
    cube.data.materials.append(fog("ShaderNodeEmission", Color=(1, 0.5, 0.2, 1), Strength=3.0))
    for x, roughness in ((0.9, 0.5), (1.9, 0.1)):
        ball = add_mesh("Ball", BALL, location=(x, 0, 0.5), scale=(0.5,) * 3)
        shiny = {"Metallic": 1.0, "Base_Color": (0.8, 0.8, 0.8, 1), "Roughness": roughness}
        ball.data.materials.append(shader_material("ShaderNodeBsdfPrincipled", **shiny))
    leaf = add_mesh("Leaf", location=(-1.5, 0, 1.0), rotation_euler=(1.2, 0, 0), scale=(0.4,) * 3)
    leaf.data.materials.append(shader_material("ShaderNodeBsdfTranslucent"))


def burns(scene: bpy.types.Scene) -> None:
    """By its temperature, in what absorbs and scatters; things stand in it."""
    material, tree = new_material("Fire")
    places = tree.nodes.new("ShaderNodeTexCoord")
    gradient = add_node(tree, "ShaderNodeTexGradient", Vector=places.outputs["Object"])
    gradient.gradient_type = "SPHERICAL"
    ramp = add_node(tree, "ShaderNodeMapRange", Value=gradient.outputs[1], To_Max=6000.0)
    fire = {"Density": gradient.outputs[1], "Color": (0.8, 0.8, 0.8, 1)}
    fire |= {"Temperature": ramp.outputs[0], "Blackbody_Intensity": 1.0}
    fire |= {"Blackbody_Tint": (0.02, 0.02, 0.02, 1)}
    fire |= {"Emission_Color": (0.1, 0.2, 1.0, 1), "Emission_Strength": 0.05}
    finish(tree, add_node(tree, PRINCIPLED, **fire), "Volume")
    ball = add_mesh("Ball", BALL, location=(0, 0, 0.8), scale=(1.0, 0.8, 1.2))
    ball.data.materials.append(material)
    grey = shader_material(DIFFUSE, Color=(0.6, 0.6, 0.6, 1))
    add_mesh("Log", CUBE, location=(0.3, 0, 0.2), scale=(0.5, 0.1, 0.1)).data.materials.append(grey)


# Of the means of pictures and of the median block, by how much they may be off: of many samples
# half as much.
CASES = [
    (box, 0, 0.004, 0.008),
    (about_all, 0, 0.012, 0.012),
    (in_world, 0, 0.006, 0.01),
    (under_sky, 0, 0.004, 0.006),
    (clouds, 0, 0.004, 0.006),
    (low_fog, 0, 0.012, 0.025),
    (clouds, 4, 0.006, 0.008),
    (glows, 0, 0.006, 0.01),
    (burns, 0, 0.01, 0.015),
    (burns, 4, 0.01, 0.015),
    (box, 4, 0.01, 0.012),
    (in_world, 4, 0.008, 0.012),
    (under_sky, 4, 0.004, 0.006),
]


def look_at_the_floor(scene: bpy.types.Scene) -> None:
    """By small pictures."""
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    scene.camera.location, scene.camera.data.angle = (0, -5, 1.6), 0.7
    scene.camera.rotation_euler = (math.radians(83), 0, 0)
    grey = shader_material(DIFFUSE, Color=(0.8, 0.6, 0.4, 1))
    add_mesh("Floor", scale=(3, 3, 1)).data.materials.append(grey)
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BOX", 1.0


@pytest.mark.thorough("about_all", "in_world", "clouds", "low_fog", "glows", "burns", "-4-")
@pytest.mark.parametrize(("place", "bounces", "of_mean", "of_block"), CASES)
def test_pictures(
    scene: bpy.types.Scene,
    export: Callable[..., Any],
    cycles_mean: Callable[..., Any],
    device: Any,
    thorough: bool,
    place: Callable[..., None],
    bounces: int,
    of_mean: float,
    of_block: float,
) -> None:
    times = 4 if thorough else 1
    look_at_the_floor(scene)
    place(scene)
    scene.cycles.volume_bounces = bounces
    theirs = cycles_mean(times * 1024, 1)
    exported, _ = export()
    settings = {"width": SIZE, "height": SIZE, "passes": times * 48, "photons": 20000}
    settings |= {"mirror_depth": 12, "volume_bounces": bounces, "transparent": True}
    ours = render(device, exported, **settings)["Combined"]
    mean = theirs[..., :3].mean(axis=(0, 1))
    assert ours[..., :3].mean(axis=(0, 1)) == pytest.approx(mean, rel=of_mean / times**0.5)
    one, other = (
        x.reshape(SIZE // BLOCK, BLOCK, -1, BLOCK, 4).mean(axis=(1, 3)) for x in (ours, theirs)
    )
    off = np.abs(one - other)[..., :3] / np.maximum(other[..., :3], 0.1 * mean)
    assert np.median(off) < of_block / times**0.5
    assert np.abs(one - other)[..., 3].max() < max(0.012, of_block)


@pytest.mark.parametrize(
    ("kind", "inputs", "absorption", "scattering", "anisotropy"),
    [
        (ABSORBS, {"Density": 4.0, "Color": (0.9, 0.5, 0.2, 1)}, (0.4, 2.0, 3.2), (0, 0, 0), 0.0),
        (
            SCATTERS,
            {"Density": 2.0, "Color": (0.9, 0.5, 0.2, 1), "Anisotropy": -0.4},
            (0, 0, 0),
            (1.8, 1.0, 0.4),
            -0.4,
        ),
        (
            PRINCIPLED,
            {
                **{"Density": 2.0, "Color": (0.9, 0.5, 0.2, 1), "Anisotropy": 1.0},
                "Absorption_Color": (0.25, 1.0, 0.0, 1),
            },
            (0.1, 0.0, 1.6),
            (1.8, 1.0, 0.4),
            0.999,
        ),
    ],
)
def test_nodes(convert, kind, inputs, absorption, scattering, anisotropy) -> None:
    """What each loses and scatters a metre."""
    converted, report = convert(fog(kind, **inputs))
    medium = converted.medium
    assert medium.absorption == pytest.approx(absorption, rel=1e-5, abs=1e-7)
    assert medium.scattering == pytest.approx(scattering, rel=1e-5, abs=1e-7)
    assert medium.anisotropy == pytest.approx(anisotropy, rel=1e-5)
    assert [lobe.kind for lobe in converted.lobes] == ["transparent"]
    assert features(report, "exact") == ["Shader"]


@pytest.mark.parametrize(
    ("phase", "inputs"),
    [
        ("FOURNIER_FORAND", {"Backscatter": 0.1}),
        ("DRAINE", {"Anisotropy": 0.5, "Alpha": 2.0}),
        ("DRAINE", {"Anisotropy": 0.5, "Alpha": 0.0}),
    ],
)
def test_other_phases(convert, phase, inputs) -> None:
    """Henyey & Greenstein's of the same mean cosine, by a sum over angles, or backscatter."""
    material, tree = new_material()
    node = add_node(tree, SCATTERS)
    if not hasattr(node, "phase"):
        pytest.skip("Blender 4.3 on")
    node.phase = phase
    for name, value in inputs.items():
        node.inputs[name].default_value = value
    finish(tree, node, "Volume")
    g = convert(material)[0].medium.anisotropy
    cosine = np.linspace(-1.0, 1.0, 20001)
    if phase == "FOURNIER_FORAND":
        own = (1 - g * g) / (1 + g * g - 2 * g * cosine) ** 1.5
        assert own[cosine < 0].sum() / own.sum() == pytest.approx(0.1, abs=2e-3)
    else:
        base = 1 + 0.25 - 2 * 0.5 * cosine
        own = (1 + inputs["Alpha"] * cosine**2) / base**1.5
        assert g == pytest.approx((own * cosine).sum() / own.sum(), abs=2e-3)


def test_sums_and_mixtures(convert) -> None:
    """Add and Mix Shaders add coefficients; anisotropies become one, with a word."""
    material, tree = new_material("Fog")
    first = add_node(tree, SCATTERS, Density=1.0, Color=(1, 1, 1, 1), Anisotropy=0.8)
    second = add_node(tree, SCATTERS, Density=3.0, Color=(1, 1, 1, 1), Anisotropy=-0.4)
    absorbs = add_node(tree, ABSORBS, Density=2.0, Color=(0.5, 0.5, 0.5, 1))
    mixed = both(tree, "ShaderNodeMixShader", first, second)
    mixed.inputs[0].default_value = 0.25
    finish(tree, both(tree, "ShaderNodeAddShader", mixed, absorbs), "Volume")
    converted, report = convert(material)
    assert converted.medium.absorption == pytest.approx((1.0,) * 3)
    assert converted.medium.scattering == pytest.approx((1.5,) * 3)
    assert converted.medium.anisotropy == pytest.approx((0.75 * 0.8 - 0.75 * 0.4) / 1.5)
    assert features(report, "approximated") == ["Anisotropy"]


def test_what_emits(convert) -> None:
    """A metre: a colour times its strength, what a shader mixes of it, and by temperature, whose
    colour is the Blackbody node's."""
    material, tree = new_material("Glow")
    glow = add_node(tree, "ShaderNodeEmission", Color=(1.0, 0.5, 0.0, 1), Strength=4.0)
    fire = {"Density": 0.0, "Emission_Strength": 2.0, "Emission_Color": (0.0, 0.5, 1.0, 1)}
    warm = {"Blackbody_Intensity": 0.5, "Temperature": 3000.0, "Blackbody_Tint": (1, 0, 1, 1)}
    fire = add_node(tree, PRINCIPLED, **fire, **warm)
    mixed = both(tree, "ShaderNodeMixShader", glow, fire)
    mixed.inputs[0].default_value = 0.25
    finish(tree, mixed, "Volume")
    converted, report = convert(material)
    bright = 5.670373e-14 / math.pi * (1.0 + 0.5 * (3000.0**4 - 1.0))
    expected = np.array((3.0, 1.5, 0.0)) + 0.25 * np.array((0.0, 1.0, 2.0))
    expected += 0.25 * bright * np.array((1, 0, 1)) * blackbody(3000.0)[:3]
    assert converted.medium.emission == pytest.approx(tuple(expected), rel=1e-5)
    assert not converted.medium.scatters and features(report, "exact") == ["Shader"]


def test_the_worlds_emits_nothing(scene, export) -> None:
    """It is named."""
    finish(tree := new_world(scene), add_node(tree, PRINCIPLED, Emission_Strength=1.0), "Volume")
    exported, report = export()
    assert exported.air.is_there and not exported.air.glows
    assert [x.feature for x in report.of("ignored")] == ["Emission of a volume"]


def painted(tree: bpy.types.NodeTree) -> bpy.types.Node:
    return add_node(tree, DIFFUSE)


@pytest.mark.parametrize(
    ("volume", "feature"),
    [(painted, "Volume")],
)
def test_what_is_not_rendered(convert, volume, feature) -> None:
    """It is named, and leaves the surface, and the rest of the medium."""
    material, tree = new_material()
    finish(tree, volume(tree), "Volume")
    finish(tree, add_node(tree, DIFFUSE))
    converted, report = convert(material)
    assert converted.medium == NO_MEDIUM
    assert converted.is_diffuse and features(report, "ignored") == [feature]


def test_the_world(scene, export) -> None:
    """It fills all, and the report says what it hides; and what is hidden from what it scatters."""
    tree = new_world(scene)
    finish(tree, add_node(tree, SCATTERS, Density=0.5, Color=(1.0, 0.5, 0.0, 1)), "Volume")
    add_mesh("Thing", visible_volume_scatter=False)
    exported, report = export()
    assert exported.air.scattering == pytest.approx((0.5, 0.25, 0.0))
    assert [x.feature for x in report.of("exact") if x.object.startswith("World")][-1] == "Volume"
    assert [x.object for x in report.of("approximated")] == ["Object 'Thing'"]


@pytest.mark.parametrize("hidden", [(), ("diffuse", "glossy"), ("scatter",)])
@pytest.mark.parametrize("kind", ["POINT", "world"])
def test_lights_that_media_do_not_find(scene, export, cycles_mean, device, kind, hidden) -> None:
    """Fog in whose ray visibility a light is, and nothing else, and the other way round."""
    add_mesh("Fog", BALL).data.materials.append(fog(SCATTERS, Density=0.8))
    if kind == "world":
        tree = new_world(scene)
        finish(tree, add_node(tree, "ShaderNodeBackground", Color=(0.5, 0.5, 0.5, 1.0)))
        scene.world.cycles_visibility.camera = False
        for name in hidden:
            setattr(scene.world.cycles_visibility, name, False)
    else:
        lamp = add_light("Lamp", kind, energy=500.0, location=(2.0, 0.0, 3.0))
        for name in hidden:
            setattr(lamp, "visible_volume_scatter" if name == "scatter" else f"visible_{name}", 0)
    scene.camera.location.z, scene.camera.data.lens = 5.0, 80.0
    scene.render.resolution_x = scene.render.resolution_y = 24
    scene.cycles.volume_bounces = 2
    shown = cycles_mean(128, 0)[8:16, 8:16, :3].mean()
    settings = {"width": 24, "height": 24, "passes": 16, "photons": 0, "volume_bounces": 2}
    ours = render(device, export()[0], **settings)["Combined"][8:16, 8:16, :3].mean()
    assert (shown > 0.05) == (hidden != ("scatter",))
    assert ours == pytest.approx(shown, rel=0.04, abs=1e-4)


@pytest.mark.skipif(bpy.app.version < (4, 3), reason="in Cycles it dims all the same")
def test_fog_without_shadow(scene, export, cycles_mean, device) -> None:
    """About all, the eye, too: it dims no lamp, for itself or a thing in it. What it scatters
    lights no surfaces, which is told."""
    add_light("Sun", "SUN", energy=2.0, rotation_euler=(0.4, 0.2, 0.0))
    add_light("Lamp", "POINT", energy=200.0, shadow_soft_size=0.1, location=(1.5, -1, 2))
    thin = {"Density": 0.15, "Color": (0.9, 0.8, 0.7, 1)}
    around = add_mesh("Fog", CUBE, scale=(8, 8, 8), visible_shadow=False)
    around.data.materials.append(fog(SCATTERS, **thin))
    log = shader_material(DIFFUSE, Color=(0.6, 0.6, 0.6, 1))
    add_mesh("Log", CUBE, location=(0.3, 0, 0.5), scale=(0.5, 0.2, 0.5)).data.materials.append(log)
    look_at_the_floor(scene)
    scene.cycles.max_bounces = 0
    theirs = cycles_mean(512, 1)[..., :3]
    exported, report = export()
    settings = {"width": SIZE, "height": SIZE, "passes": 32, "photons": 0, "mirror_depth": 0}
    ours = render(device, exported, **settings)["Combined"][..., :3]
    assert ours.mean(axis=(0, 1)) == pytest.approx(theirs.mean(axis=(0, 1)), rel=0.006)
    assert [x.object for x in report.of("approximated")] == ["Object 'Fog'"]


@pytest.mark.skipif(bpy.app.version < (5, 0), reason="Cycles shows them black")
def test_many_clouds_in_a_row(scene, export, cycles_mean, device) -> None:
    """What is a volume alone is none of the transparent surfaces that a ray may pass."""
    for number in range(7):
        thin = fog(ABSORBS, Density=0.2, Color=(0.3, 0.6, 0.9, 1))
        add_mesh("Cloud", BALL, location=(0, 0, number), scale=(2, 2, 0.4)).data.materials.append(
            thin
        )
    grey = shader_material(DIFFUSE, Color=(0.8, 0.6, 0.4, 1))
    add_mesh("Floor", scale=(3, 3, 1), location=(0, 0, -1)).data.materials.append(grey)
    add_light("Sun", "SUN", energy=3.0)
    scene.camera.location.z, scene.camera.data.lens = 12.0, 200.0
    scene.render.resolution_x = scene.render.resolution_y = 16
    shown = cycles_mean(64, 0)[..., :3].mean(axis=(0, 1))
    settings = {"width": 16, "height": 16, "passes": 8, "photons": 0}
    ours = render(device, export()[0], **settings)["Combined"][..., :3].mean(axis=(0, 1))
    assert shown.min() > 0.02 and ours == pytest.approx(shown, rel=0.02)


def test_bounces_are_cycles(scene) -> None:
    assert scene.cycles.bl_rna.properties["volume_bounces"].default == 0
    scene.cycles.volume_bounces = 5
    assert settings_from(scene, (8, 8)).volume_bounces == 5


def asked(kind: str, name: str, output: str) -> Callable[[bpy.types.NodeTree], bpy.types.Node]:
    """A volume whose colour is what an output of a node tells."""

    def made(tree: bpy.types.NodeTree) -> bpy.types.Node:
        node = tree.nodes.new(f"ShaderNode{kind}")
        return add_node(tree, SCATTERS, Color=node.outputs[output])

    made.__name__ = name
    return made


@pytest.mark.parametrize(
    ("volume", "feature"),
    [
        (asked("NewGeometry", "normal", "Normal"), "Normal in a volume"),
        (asked("NewGeometry", "side", "Backfacing"), "Backfacing in a volume"),
        (asked("TexCoord", "reflection", "Reflection"), "Normal in a volume"),
        (asked("LayerWeight", "facing", "Facing"), "'Layer Weight' in a volume"),
        (asked("LightPath", "path", "Is Camera Ray"), "'Light Path' in a volume"),
    ],
)
def test_what_places_do_not_know(convert, volume, feature) -> None:
    """It is 0, and named."""
    material, tree = new_material()
    finish(tree, volume(tree), "Volume")
    finish(tree, add_node(tree, DIFFUSE))
    converted, report = convert(material)
    assert not converted.medium.is_there and feature in features(report, "approximated")


@pytest.mark.parametrize(
    ("output", "is_there"), [("Generated", True), ("Object", True), ("UV", False)]
)
def test_what_places_know(convert, output, is_there) -> None:
    """Of a mesh they know Generated coordinates by its texture space, and no UV map. That they are
    asked on a grid is named."""
    material, tree = new_material()
    places = tree.nodes.new("ShaderNodeTexCoord")
    finish(tree, add_node(tree, SCATTERS, Color=places.outputs[output]), "Volume")
    finish(tree, add_node(tree, DIFFUSE))
    converted, report = convert(material)
    assert converted.medium.varies == converted.medium.is_there == is_there
    assert features(report, "approximated") == ["Volume"] * is_there


def test_what_moves_is_named(scene, export) -> None:
    """What nodes tell of a volume stands still, and what it lights is lit so; what is the same all
    through moves."""
    scene.render.use_motion_blur, scene.render.motion_blur_shutter = True, 1.0
    material, tree = new_material("Cloud")
    noise = tree.nodes.new("ShaderNodeTexNoise")
    finish(tree, add_node(tree, SCATTERS, Density=noise.outputs[0]), "Volume")
    for name, worn, ends in (
        ("Cloud", material, ((0, 0, 0), (2, 0, 0))),
        ("Still", material, ((5, 0, 0), (5, 0, 0))),
        ("Even", fog(Density=1.0), ((0, 5, 0), (2, 5, 0))),
        ("Glow", fog(Emission_Strength=1.0), ((0, 9, 0), (2, 9, 0))),
    ):
        cube = add_mesh(name, CUBE)
        cube.data.materials.append(worn)
        go(cube, location=ends)
    _, report = export()
    named = [(x.object, x.detail) for x in report.entries if x.feature == "Volume that moves"]
    assert named == [
        ("Object 'Cloud'", "what nodes tell of it stands still"),
        ("Object 'Glow'", "it lights things as if it stood still"),
    ]
