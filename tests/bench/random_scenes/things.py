# SPDX-License-Identifier: GPL-3.0-or-later
"""A whole scene by chance: a floor, things on and above it, lamps, a camera that looks at them."""

from __future__ import annotations

import math
import random
from typing import Any

import bpy
from mathutils import Vector

from tests.blender.build import add_light, add_object

from .media import fill
from .nodes import material, world

SIZE = 96  # [px]
SHAPES = [
    "cube",
    "uv_sphere",
    "ico_sphere",
    "cone",
    "cylinder",
    "torus",
    "monkey",
    "grid",
    "circle",
]
MODIFIERS = ["SUBSURF", "BEVEL", "ARRAY", "SOLIDIFY", "WIREFRAME", "DISPLACE", "DECIMATE"]
AMOUNTS = {"BEVEL": "width", "SOLIDIFY": "thickness", "WIREFRAME": "thickness"}
RAYS = ("camera", "diffuse", "glossy", "transmission", "shadow")
BOUNCES = 12


def build(seed: int) -> Any:
    """The scene of a seed, which is then the open one."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene, dice = bpy.context.scene, random.Random(seed)
    materials = [material(dice) for _ in range(3)]
    bpy.ops.mesh.primitive_plane_add(size=8)
    bpy.context.object.data.materials.append(None if dice.random() < 0.7 else materials[0])
    for _ in range(dice.randint(1, 3)):
        _thing(dice, materials)
    is_lit = world(dice, scene)
    if is_lit and dice.random() < 0.2:
        setattr(scene.world.cycles_visibility, dice.choice(RAYS[:4]), False)
    for _ in range(dice.randint(0 if is_lit else 1, 3)):
        _lamp(dice)
    _camera(dice, scene)
    _settings(scene)
    fill(seed, scene, materials)
    _link(random.Random(f"links {seed}"), scene)
    return scene


def _point(
    dice: random.Random, reach: float, low: float, high: float
) -> tuple[float, float, float]:
    return dice.uniform(-reach, reach), dice.uniform(-reach, reach), dice.uniform(low, high)


def _thing(dice: random.Random, materials: list[Any]) -> None:
    """A primitive, turned, scaled, maybe modified, of one or two materials."""
    add = getattr(bpy.ops.mesh, f"primitive_{dice.choice(SHAPES)}_add")
    add(location=_point(dice, 2.0, 0.3, 2.2))
    thing = bpy.context.object
    thing.rotation_euler = [dice.uniform(-3, 3) for _ in "xyz"]
    thing.scale = [dice.uniform(0.3, 0.9) for _ in "xyz"]
    if dice.random() < 0.1:
        thing.scale.x *= -1.0
    is_smooth = dice.random() < 0.4
    for face in thing.data.polygons:
        face.use_smooth = is_smooth
    _normals(dice, thing.data)
    _hide(dice, thing, RAYS)
    if dice.random() < 0.4:
        colours = thing.data.color_attributes.new("Col", "FLOAT_COLOR", "CORNER")
        for item in colours.data:
            item.color = [dice.random() for _ in "rgba"]
    if dice.random() < 0.5 and not is_smooth:
        modifier = thing.modifiers.new("Modifier", dice.choice(MODIFIERS))
        if modifier.type in AMOUNTS:
            setattr(modifier, AMOUNTS[modifier.type], 0.12)
    for _ in range(dice.choice([1, 1, 2])):
        thing.data.materials.append(dice.choice(materials))
    for face in thing.data.polygons:
        face.material_index = dice.randrange(len(thing.data.materials))


def _normals(dice: random.Random, mesh: Any) -> None:
    """Sharp edges, or normals of its own, that lean a little."""
    kind = dice.choice([*[""] * 8, "edges", "own"])
    if kind == "edges":
        for edge in mesh.edges:
            edge.use_edge_sharp = dice.random() < 0.3
    elif kind == "own":
        leaning = [
            Vector(x.vector) + Vector(_point(dice, 0.2, -0.2, 0.2)) for x in mesh.corner_normals
        ]
        mesh.normals_split_custom_set([x.normalized() for x in leaning])


def _hide(dice: random.Random, thing: Any, rays: tuple[str, ...]) -> None:
    """From rays of one kind, maybe."""
    if dice.random() < 0.2:
        setattr(thing, f"visible_{dice.choice(rays)}", False)


def _link(dice: random.Random, scene: Any) -> None:
    """Let lamps light some things alone, or not some, maybe."""
    things = [obj for obj in scene.objects if obj.type == "MESH"]
    for lamp in scene.objects:
        if lamp.type != "LIGHT" or dice.random() < 0.8:
            continue
        some = bpy.data.collections.new("Some")
        lamp.light_linking.receiver_collection = some
        for thing in dice.sample(things, dice.randint(1, len(things))):
            some.objects.link(thing)
        for entry in some.collection_objects:
            entry.light_linking.link_state = dice.choice(["INCLUDE", "EXCLUDE"])


def _lamp(dice: random.Random) -> None:
    kind = dice.choice(["POINT", "SPOT", "AREA", "SUN"])
    lamp = add_light("Lamp", kind)
    data = lamp.data
    lamp.location = _point(dice, 2.5, 2.5, 4.5)
    lamp.rotation_euler = _point(dice, 0.7, -3.0, 3.0)
    data.color = [dice.uniform(0.3, 1.0) for _ in "rgb"]
    _hide(dice, lamp, RAYS[:4])
    data.use_shadow = dice.random() < 0.9
    data.energy = dice.uniform(0.5, 4.0) if kind == "SUN" else dice.uniform(50.0, 400.0)
    if kind == "SUN":
        data.angle = dice.choice([0.0, dice.uniform(0.01, 0.5)])
    elif kind == "AREA":
        data.shape = dice.choice(["SQUARE", "RECTANGLE", "DISK", "ELLIPSE"])
        data.size, data.size_y = dice.uniform(0.3, 2.0), dice.uniform(0.3, 2.0)
        data.spread = dice.choice([math.pi, dice.uniform(0.5, 3.0)])
    else:
        data.shadow_soft_size = dice.choice([0.0, dice.uniform(0.05, 0.4)])
    if kind == "SPOT":
        data.spot_size, data.spot_blend = dice.uniform(0.5, 2.2), dice.random()


def _camera(dice: random.Random, scene: Any) -> None:
    data = bpy.data.cameras.new("Camera")
    camera = scene.camera = add_object("Camera", data)
    around, up, far = dice.uniform(0, 6.28), dice.uniform(0.15, 1.2), dice.uniform(6, 8)
    away = Vector((math.cos(around) * math.cos(up), math.sin(around) * math.cos(up), math.sin(up)))
    camera.location = Vector((0.0, 0.0, 0.9)) + far * away
    camera.rotation_euler = away.to_track_quat("Z", "Y").to_euler()
    data.lens = dice.uniform(30.0, 50.0)
    if dice.random() < 0.1:
        data.type, data.ortho_scale = "ORTHO", dice.uniform(4.0, 7.0)
    if dice.random() < 0.1:
        data.dof.use_dof, data.dof.focus_distance = True, far
        data.dof.aperture_fstop = dice.uniform(0.3, 2.0)


def _settings(scene: Any) -> None:
    """Nothing that the two have apart: no clamps, no caustics, which Cycles has in part alone."""
    cycles, render = scene.cycles, scene.render
    cycles.device = "CPU"
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.blur_glossy = 0.0
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.caustics_reflective = cycles.caustics_refractive = False
    for kind in ("max", "diffuse", "glossy", "transmission", "transparent_max"):
        setattr(cycles, f"{kind}_bounces", BOUNCES)
    render.resolution_x = render.resolution_y = SIZE
    render.resolution_percentage = 100
    render.image_settings.file_format = "OPEN_EXR"
    render.image_settings.color_mode, render.image_settings.color_depth = "RGB", "32"
