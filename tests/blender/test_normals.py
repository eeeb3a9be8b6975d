# SPDX-License-Identifier: GPL-3.0-or-later
"""Normals that nodes bend: lit spheres and tiles against Cycles, 99 % of pixels within 1 %."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import bpy
import numpy as np
import pytest

from tests.measure import render
from tests.regression.blocks import block_means, compare_means

from .build import add_light, add_node, features, finish, new_material, new_world

pytestmark = pytest.mark.blender

CELL = 32  # [px] of a subject, in a cell 3 m wide
NEAR, FLOOR = 0.01, 0.02  # of a pixel; of the brightest one, where it is darker
DIFFUSE, PRINCIPLED = "ShaderNodeBsdfDiffuse", "ShaderNodeBsdfPrincipled"
TRANSLUCENT = "ShaderNodeBsdfTranslucent"
Tree = bpy.types.NodeTree
Build = Callable[[Tree, bpy.types.Node], None]  # bends the normal of a shader


def waves(tree: Tree, source: str = "Object", scale: float = 20.0) -> bpy.types.NodeSocket:
    """Heights that go up and down."""
    place = add_node(tree, "ShaderNodeTexCoord").outputs[source]
    inner = add_node(tree, "ShaderNodeMath")
    inner.operation, inner.inputs[1].default_value = "MULTIPLY", scale
    tree.links.new(place, inner.inputs[0])
    outer = add_node(tree, "ShaderNodeMath")
    outer.operation = "SINE"
    tree.links.new(inner.outputs[0], outer.inputs[0])
    return outer.outputs[0]


def normal_map(space: str, strength: float = 1.0, varies: bool = True) -> Build:
    def build(tree: Tree, shader: bpy.types.Node) -> None:
        node = add_node(tree, "ShaderNodeNormalMap", Strength=strength)
        node.space = space
        back = -1.0 if space.startswith("BLENDER") else 1.0
        if varies:
            place = add_node(tree, "ShaderNodeTexCoord").outputs["Generated"]
            colour = add_node(tree, "ShaderNodeVectorMath")
            colour.operation = "MULTIPLY_ADD"
            colour.inputs[1].default_value = (0.8, 0.8 * back, 0.3 * back)
            colour.inputs[2].default_value = (0.1, 0.5 - 0.4 * back, 0.5 + 0.15 * back)
            tree.links.new(place, colour.inputs[0])
            tree.links.new(colour.outputs[0], node.inputs["Color"])
        else:
            node.inputs["Color"].default_value = (0.7, 0.35, 0.8, 1.0)
        tree.links.new(node.outputs[0], shader.inputs["Normal"])

    return build


def bump(source: str = "Object", on: Build | None = None, scale: float = 20.0, **inputs) -> Build:
    def build(tree: Tree, shader: bpy.types.Node) -> None:
        given = {
            "Distance": 0.05,
            **{key: value for key, value in inputs.items() if key != "invert"},
        }
        node = add_node(tree, "ShaderNodeBump", Height=waves(tree, source, scale), **given)
        node.invert = inputs.get("invert", False)
        if on:
            on(tree, node)
        tree.links.new(node.outputs[0], shader.inputs["Normal"])

    return build


def displacement(space: str, vector: bool = False, also: Build | None = None) -> Build:
    def build(tree: Tree, shader: bpy.types.Node) -> None:
        kind, name = ("VectorDisplacement", "Vector") if vector else ("Displacement", "Height")
        node = add_node(tree, f"ShaderNode{kind}", Scale=0.05, **{name: waves(tree)})
        node.space = space
        output = next(x for x in tree.nodes if x.type == "OUTPUT_MATERIAL")
        tree.links.new(node.outputs[0], output.inputs["Displacement"])
        if also:
            also(tree, shader)

    return build


BENT = "displaced and bent"
# The displaced surface's normal is packed to 0.001, which shows where light grazes it.
WITHIN = {BENT: 0.98, "Reflection": 0.97}
SPACES = ("TANGENT", "OBJECT", "WORLD", "BLENDER_OBJECT", "BLENDER_WORLD")
CASES: Mapping[str, Build] = {
    **{f"map {space}": normal_map(space) for space in SPACES},
    "map, a constant": normal_map("TANGENT", varies=False),
    "map, weak": normal_map("TANGENT", 0.5),
    "map, strong": normal_map("TANGENT", 2.0, varies=False),
    "map, half of the world's": normal_map("WORLD", 0.5),
    **{f"bump by {source}": bump(source) for source in ("Object", "UV", "Generated", "Normal")},
    "bump, weak": bump(Strength=0.3),
    "bump, inverted": bump(invert=True),
    "bump, wide": bump(Filter_Width=0.5),
    "bump on map": bump(on=normal_map("TANGENT", varies=False)),
    "bump on bump": bump(on=bump(scale=13.0)),
    "displaced": displacement("OBJECT"),
    "displaced in the world": displacement("WORLD"),
    BENT: displacement("OBJECT", also=bump(scale=13.0)),
    **{f"vector {space}": displacement(space, vector=True) for space in SPACES[:3]},
}
COLOUR = (0.8, 0.7, 0.6, 1.0)
SHADERS: Mapping[str, tuple[str, dict[str, Any]]] = {
    DIFFUSE: (DIFFUSE, {"Color": COLOUR}),
    PRINCIPLED: (PRINCIPLED, {"Base_Color": (0.6, 0.5, 0.4, 1.0), "Roughness": 0.4}),
    "rough": (DIFFUSE, {"Color": COLOUR, "Roughness": 0.9}),
    "rough below gloss": (
        PRINCIPLED,
        {"Base_Color": COLOUR, "Roughness": 0.4, "Diffuse_Roughness": 0.9},
    ),
    "coated": (  # by a smooth coat, seen also where what it lies over leans away
        PRINCIPLED,
        {
            "Base_Color": COLOUR,
            "Roughness": 0.6,
            "Coat_Weight": 0.9,
            "Coat_Roughness": 0.4,
            "Coat_IOR": 1.8,
            "Coat_Tint": (0.9, 0.6, 0.4, 1.0),
        },
    ),
    "emission": ("ShaderNodeEmission", {}),
    "sheen": ("ShaderNodeBsdfSheen", {"Color": COLOUR, "Roughness": 0.5}),
    "velvet": (
        "ShaderNodeBsdfSheen",
        {"Color": COLOUR, "Roughness": 0.5, "distribution": "ASHIKHMIN"},
    ),
    "toon": ("ShaderNodeBsdfToon", {"Color": COLOUR, "Size": 0.7, "Smooth": 0.3}),
    TRANSLUCENT: (TRANSLUCENT, {"Color": COLOUR}),
}
# Of emission a normal's rounding shows as it is; tables of sheen are coarse, velvet has edges.
NEAR_OF = {"emission": 0.05, "sheen": 0.04, "velvet": 0.03}


def tile() -> None:
    bpy.ops.mesh.primitive_plane_add(size=2.4)


def ball() -> None:
    bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24, radius=1.2)
    bpy.ops.object.shade_smooth()


def back() -> None:
    bpy.ops.mesh.primitive_plane_add(size=2.4)
    for polygon in bpy.context.object.data.polygons:
        polygon.flip()


def lay_out(cases: Mapping[str, Build], subject: Callable[[], None], shader: str) -> int:
    """A subject a case, turned and stretched, in rows under a sun; returns the rows' length."""
    across = int(np.ceil(np.sqrt(len(cases))))
    for number, build in enumerate(cases.values()):
        subject()
        obj = bpy.context.object
        obj.location = 3.0 * (number % across), 3.0 * (number // across), 0.0
        obj.scale, obj.rotation_euler = (1.0, 0.8, 1.1), (0.2, 0.15, 0.7)
        material, tree = new_material()
        kind, inputs = SHADERS[shader]
        node = add_node(tree, kind, **{k: v for k, v in inputs.items() if k != "distribution"})
        if "distribution" in inputs:
            node.distribution = inputs["distribution"]
        finish(tree, node)
        build(tree, node)
        obj.data.materials.append(material)
    sun = add_light("Sun", "SUN", energy=3.0, angle=0.0)
    sun.rotation_euler = 0.7 + math.pi * (shader == TRANSLUCENT), 0.4, 0.0  # behind what is seen
    scene = bpy.context.scene
    scene.camera.data.type, scene.camera.data.ortho_scale = "ORTHO", 3.0 * across
    scene.camera.location = 1.5 * across - 1.5, 1.5 * across - 1.5, 10.0
    scene.render.resolution_x = scene.render.resolution_y = CELL * across
    return across


def difference(ours: Any, cycles: Any, floor: float = FLOOR) -> Any:
    """Of each pixel that is lit, relative; where it is darker, to so much of the brightest one."""
    lit = (ours.max(-1) > 0) | (cycles.max(-1) > 0)
    least = max(floor * cycles.max(), 1e-9)
    return (np.abs(ours - cycles).max(-1) / np.maximum(cycles.max(-1), least))[lit]


def pictures(export, cycles_mean, device, samples: int = 1, **settings: Any) -> tuple[Any, Any]:
    """Ours and Cycles', of the middles of pixels, of direct light."""
    scene, report = export()
    known = {"Emission by nodes"}  # as a light it is coarser
    lost = [str(x) for x in report.entries if x.status != "exact" and x.feature not in known]
    assert not lost, lost
    size = bpy.context.scene.render.resolution_x
    cycles = of_middles(cycles_mean, samples)
    return shown(device, scene, **{"width": size, "height": size, **settings}), cycles


def of_middles(cycles_mean, samples: int = 1) -> Any:
    """Cycles', of the middles of pixels, of direct light."""
    cycles = bpy.context.scene.cycles
    cycles.light_sampling_threshold = cycles.max_bounces = 0
    cycles.pixel_filter_type, cycles.filter_width = "BOX", 0.01
    return cycles_mean(samples, 0)[..., :3]


def shown(device, scene, **settings: Any) -> Any:
    """Ours of the same."""
    exact = {"pixel_filter": "gauss", "pixel_width": 1e-4, "photons": 0, "mirror_depth": 0}
    return render(device, scene, **{**exact, **settings})["Combined"][..., :3]


def _thorough(*values: Any) -> Any:
    return pytest.param(*values, marks=pytest.mark.thorough)


@pytest.mark.parametrize(
    ("subject", "shader"),
    [
        (ball, DIFFUSE),
        (back, PRINCIPLED),
        (ball, "rough"),
        (ball, "coated"),
        _thorough(ball, "rough below gloss"),
        _thorough(ball, "sheen"),
        _thorough(ball, "velvet"),
        _thorough(ball, "toon"),
        _thorough(tile, DIFFUSE),
        _thorough(back, DIFFUSE),
        _thorough(ball, PRINCIPLED),
        _thorough(tile, PRINCIPLED),
    ],
)
def test_every_option(export, cycles_mean, device, subject, shader) -> None:
    all_alike(CASES, subject, shader, export, cycles_mean, device)


def all_alike(
    cases: Mapping[str, Build],
    subject: Callable[[], None],
    shader: str,
    export: Any,
    cycles_mean: Any,
    device: Any,
) -> None:
    """Whether a subject of each case is as Cycles shows it."""
    across = lay_out(cases, subject, shader)
    ours, cycles = pictures(export, cycles_mean, device)
    assert (cycles.max(-1) > 0).mean() > 0.1
    bad = {}
    for number, name in enumerate(cases):
        x, y = number % across * CELL, number // across * CELL
        cell = np.s_[y : y + CELL, x : x + CELL]
        found = difference(ours[cell], cycles[cell])
        within = (
            float((found < NEAR_OF.get(shader, NEAR)).mean()) if len(found) else 1.0
        )  # both are dark
        if within < WITHIN.get(name, 0.99):
            bad[name] = f"{within:.1%}"
    assert not bad, bad


@pytest.mark.parametrize("light", ["lamp", "world"])
def test_light_from_behind(scene, export, cycles_mean, device, light) -> None:
    """In the mean: shadow rays go to either side by chance; rays of the lobe find a world, too."""
    across = lay_out(CASES, tile, TRANSLUCENT)
    if light == "world":
        bpy.data.objects.remove(bpy.data.objects["Sun"])
        tree = new_world(scene)
        finish(tree, add_node(tree, "ShaderNodeBackground", Strength=1.0))
        scene.world.cycles_visibility.camera = False
    samples, rays = (16, 1) if light == "world" else (1, 0)
    ours, cycles = pictures(export, cycles_mean, device, samples, passes=64, mirror_depth=rays)
    shape = (across, CELL, across, CELL, 3)
    of_cells = [picture.reshape(shape).mean(axis=(1, 3, 4)).ravel() for picture in (ours, cycles)]
    ratios = np.divide(*(cells[: len(CASES)] for cells in of_cells))
    off = dict(zip(CASES, np.abs(ratios - 1.0).round(3), strict=True))
    if light == "lamp":
        assert max(off.values()) < 0.02, off
    else:  # of which Cycles' shadow rays, which bumps darken, find less than ours
        assert np.median([*off.values()]) < 0.03 and max(off.values()) < 0.08, off


@pytest.mark.thorough("compute")
@pytest.mark.parametrize("backend", ["compute", "native"])
def test_other_ways(export, cycles_mean, device, backend) -> None:
    names = "map TANGENT", "bump by UV", BENT, "vector TANGENT"
    lay_out({name: CASES[name] for name in names}, ball, PRINCIPLED)
    ours, cycles = pictures(export, cycles_mean, device, backend=backend)
    assert (difference(ours, cycles) < NEAR).mean() > WITHIN[BENT]


def test_perspective(export, cycles_mean, device) -> None:
    """Bumps are as fine as the eye sees them, also at the picture's edge."""
    lay_out({"bump": bump(scale=30.0)}, ball, DIFFUSE)
    camera = bpy.context.scene.camera
    camera.data.type, camera.data.lens, camera.location = "PERSP", 20.0, (0.0, 0.0, 2.2)
    ours, cycles = pictures(export, cycles_mean, device)
    assert (difference(ours, cycles) < NEAR).mean() > 0.99


def test_no_uv_map(export, cycles_mean, device) -> None:
    """Without the UV map that a node names the mesh's own normals are used."""
    lay_out({"map": normal_map("TANGENT", varies=False)}, ball, DIFFUSE)
    tree = bpy.context.object.data.materials[0].node_tree
    next(node for node in tree.nodes if node.type == "NORMAL_MAP").uv_map = "None such"
    ours, cycles = pictures(export, cycles_mean, device)
    assert (difference(ours, cycles) < NEAR).mean() > 0.99


def test_one_normal_a_material(convert) -> None:
    """Of shaders mixed, that of the one which reflects more; and it is said."""
    material, tree = new_material()
    bent, plain = (add_node(tree, DIFFUSE, Color=(v, v, v, 1.0)) for v in (0.2, 0.9))
    bump()(tree, bent)
    mixed = add_node(tree, "ShaderNodeMixShader", Fac=0.5)
    tree.links.new(bent.outputs[0], mixed.inputs[1])
    tree.links.new(plain.outputs[0], mixed.inputs[2])
    finish(tree, mixed)
    found, report = convert(material)
    assert "Different normals" in features(report, "approximated")
    assert "normal" not in found.varying and not found.program
    bent.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    assert "normal" in convert(material)[0].varying


@pytest.mark.parametrize("shader", [DIFFUSE, _thorough("rough")])
def test_photons_see_bent_normals(export, device, shader) -> None:
    """Direct light by photons is that by shadow rays, on bumps too, and what they scatter is."""
    cases = {name: CASES[name] for name in ("map OBJECT", "bump by UV", "displaced", BENT)}
    lay_out(cases, tile, shader)
    scene, _ = export()
    size = bpy.context.scene.render.resolution_x
    ours = {"width": size, "height": size, "pixel_filter": "gauss", "pixel_width": 1e-4}
    exact = render(device, scene, photons=0, **ours)["Combined"][..., :3]
    photons = {"photons": 400_000, "passes": 4, "radius_decay": 2.0 / 3.0}
    found = render(device, scene, direct_by_photons=True, **photons, **ours)["Combined"][..., :3]
    lit = exact.max(-1) > 0.1 * exact.max()
    ratio = found.sum(-1)[lit] / exact.sum(-1)[lit]
    assert abs(np.median(ratio) - 1.0) < 0.01
    assert np.quantile(np.abs(ratio - 1.0), 0.95) < 0.1
    assert np.corrcoef(found[lit].sum(-1), exact[lit].sum(-1))[0, 1] > 0.98


@pytest.mark.thorough
@pytest.mark.parametrize("shader", [DIFFUSE, "rough"])
@pytest.mark.parametrize("bent", ["map, a constant", "bump by Object"])
def test_room(export, cycles_mean, device, bent, shader) -> None:
    """Indirect light on a bent floor, and what the floor sends on."""
    walls = {
        "floor": ((0, 0, 0), (0, 0, 0), (0.7, 0.7, 0.7, 1.0)),
        "ceiling": ((0, 0, 2), (math.pi, 0, 0), (0.7, 0.7, 0.7, 1.0)),
        "left": ((-1, 0, 1), (0, math.pi / 2, 0), (0.8, 0.2, 0.1, 1.0)),
        "right": ((1, 0, 1), (0, -math.pi / 2, 0), (0.1, 0.3, 0.8, 1.0)),
        "back": ((0, 1, 1), (math.pi / 2, 0, 0), (0.7, 0.7, 0.7, 1.0)),
    }
    for name, (location, turn, colour) in walls.items():
        bpy.ops.mesh.primitive_plane_add(size=2.0, location=location, rotation=turn)
        material, tree = new_material(name)
        roughness = SHADERS[shader][1].get("Roughness", 0.0)
        node = add_node(tree, DIFFUSE, Color=colour, Roughness=roughness)
        finish(tree, node)
        if name == "floor":
            CASES[bent](tree, node)
        bpy.context.object.data.materials.append(material)
    add_light(
        "Spot",
        "SPOT",
        energy=60.0,
        spot_size=1.0,
        spot_blend=0.3,
        shadow_soft_size=0.0,
        location=(0.3, 0.0, 0.6),
        rotation_euler=(0.0, 1.658, 0.0),
    )
    camera = bpy.context.scene.camera
    camera.location, camera.rotation_euler = (0.0, -2.2, 1.6), (1.082, 0.0, 0.0)
    camera.data.lens = 32.0
    bpy.context.scene.render.resolution_x = bpy.context.scene.render.resolution_y = 64
    scene, _ = export()
    passes = {"passes": 64, "photons": 60_000, "radius_decay": 2.0 / 3.0}
    ours = render(device, scene, width=64, height=64, **passes)["Combined"][..., :3]
    cycles = bpy.context.scene.cycles
    cycles.light_sampling_threshold = cycles.sample_clamp_indirect = 0.0
    cycles.max_bounces = cycles.diffuse_bounces = 64
    cycles.pixel_filter_type, cycles.filter_width = "BOX", 1.0
    means = [block_means(picture) for picture in (ours, cycles_mean(2048, 0)[..., :3])]
    # Where it is darker Cycles is noisier than what is asked of us.
    light = means[1].mean(-1)
    found = compare_means(*means, light > 0.15 * light.mean())
    assert found.median < 0.01 and found.high < 0.03
