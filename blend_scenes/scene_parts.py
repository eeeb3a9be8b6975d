# SPDX-License-Identifier: GPL-3.0-or-later
"""What the scenes of make_scenes.py are made of: materials, meshes, camera."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence

import bpy

# isort: split
import bmesh  # these two can be imported only after bpy
from mathutils import Matrix, Vector

HALF = 5.0
HEIGHT = 10.0
SUNK = 0.01
CREASE = math.radians(50)


class PhotonStreamStub(bpy.types.RenderEngine):
    """Let files be saved with our engine's name; Blender refuses names that are not registered."""

    bl_idname = "PHOTON_STREAM"
    bl_label = "Photon Stream"


def empty_scene() -> bpy.types.Scene:
    """Start a file: our engine, 512x512, black world, and Cycles set up as a fair reference."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.preferences.filepaths.save_version = 0  # no .blend1 beside the files
    scene = bpy.context.scene
    scene.render.engine = PhotonStreamStub.bl_idname
    scene.render.resolution_x = scene.render.resolution_y = 512
    scene.render.resolution_percentage = 100
    scene.view_settings.view_transform = "Standard"
    scene.world = bpy.data.worlds.new("Black")
    scene.world.color = (0, 0, 0)
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (0, 0, 0, 1)

    # Without these Cycles clamps, blurs and cuts off light paths, and is no reference.
    cycles = scene.cycles
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = 64
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    cycles.blur_glossy = 0
    cycles.use_denoising = False
    return scene


def use_phong() -> None:
    """Let glossy shaders be the paper's lobes, as the add-on's property Specular Model says."""
    bpy.context.scene["photon_stream"] = {"specular_model": 1}


def material(name: str, diffuse=None, glossy=None, roughness: float = 0.0) -> bpy.types.Material:
    """A Diffuse BSDF, a Glossy BSDF, or their sum."""
    mat = bpy.data.materials.new(name)
    mat.use_nodes = True
    nodes, links = mat.node_tree.nodes, mat.node_tree.links
    nodes.clear()
    closures = []
    if diffuse is not None:
        node = nodes.new("ShaderNodeBsdfDiffuse")
        node.inputs["Color"].default_value = (*diffuse, 1)
        closures.append(node)
    if glossy is not None:
        node = nodes.new("ShaderNodeBsdfAnisotropic")  # what the menu calls Glossy BSDF
        node.distribution = "GGX"
        node.inputs["Color"].default_value = (*glossy, 1)
        node.inputs["Roughness"].default_value = roughness
        closures.append(node)
    surface = closures[0]
    if len(closures) == 2:
        surface = nodes.new("ShaderNodeAddShader")
        links.new(closures[0].outputs[0], surface.inputs[0])
        links.new(closures[1].outputs[0], surface.inputs[1])
    output = nodes.new("ShaderNodeOutputMaterial")
    links.new(surface.outputs[0], output.inputs["Surface"])
    for column, node in enumerate((*closures, surface, output)):
        node.location = (250 * column, 0)
    mat.diffuse_color = (*(diffuse or glossy), 1)  # the solid viewport's colour
    return mat


def add_object(name: str, data: bpy.types.ID | None) -> bpy.types.Object:
    obj = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def room(white, left, right) -> bpy.types.Object:
    """Floor, ceiling, back, left and right wall with normals inward; the front is open."""
    corners = [(x, y, z) for z in (0, HEIGHT) for y in (-HALF, HALF) for x in (-HALF, HALF)]
    floor, ceiling, back = (0, 1, 3, 2), (4, 6, 7, 5), (2, 3, 7, 6)
    left_wall, right_wall = (0, 2, 6, 4), (1, 5, 7, 3)
    mesh = bpy.data.meshes.new("Room")
    mesh.from_pydata(corners, [], [floor, ceiling, back, left_wall, right_wall])
    for mat in (white, left, right):
        mesh.materials.append(mat)
    mesh.polygons.foreach_set("material_index", (0, 0, 0, 1, 2))
    assert not mesh.validate()
    return add_object("Room", mesh)


def box(name: str, mat, size, centre, turn: float) -> bpy.types.Object:
    """A box on the floor at centre (x, y), turned about z [degrees]; it has no bottom face."""
    x, y, top = size[0] / 2, size[1] / 2, size[2]
    corners = [(a, b, c) for c in (-SUNK, top) for b in (-y, y) for a in (-x, x)]
    faces = [(4, 5, 7, 6), (0, 1, 5, 4), (1, 3, 7, 5), (3, 2, 6, 7), (2, 0, 4, 6)]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], faces)
    mesh.materials.append(mat)
    assert not mesh.validate()
    obj = add_object(name, mesh)
    obj.location = (*centre, 0)
    obj.rotation_euler = (0, 0, math.radians(turn))
    return obj


def sphere(name: str, mat, radius: float, centre, subdivisions: int) -> bpy.types.Object:
    """A smooth-shaded icosphere."""
    mesh = bpy.data.meshes.new(name)
    work = bmesh.new()
    bmesh.ops.create_icosphere(work, subdivisions=subdivisions, radius=radius)
    work.to_mesh(mesh)
    work.free()
    mesh.polygons.foreach_set("use_smooth", [True] * len(mesh.polygons))
    mesh.materials.append(mat)
    obj = add_object(name, mesh)
    obj.location = centre
    obj.cycles.shadow_terminator_geometry_offset = 0  # moves shadows; physics does not
    return obj


def mesh_object(
    name: str, mats: Sequence, corners: Sequence, faces: Sequence, which=None, smooth: bool = False
) -> bpy.types.Object:
    """An object of faces over corners; `which` material each has (default: the first)."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], faces)
    for mat in mats:
        mesh.materials.append(mat)
    if which:
        mesh.polygons.foreach_set("material_index", which)
    mesh.polygons.foreach_set("use_smooth", [smooth] * len(mesh.polygons))
    assert not mesh.validate()
    obj = add_object(name, mesh)
    obj.cycles.shadow_terminator_geometry_offset = 0
    return obj


def closed_room(low, high, floor, ceiling, walls: Sequence, name: str = "Room") -> bpy.types.Object:
    """The six sides of a room between two corners, normals inward.

    `walls`: left, right, front (of smaller y), back; None leaves one out.
    """
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 2, 6, 4), (1, 5, 7, 3), (0, 4, 5, 1), (2, 3, 7, 6)]
    sides = [(f, m) for f, m in zip(faces, [floor, ceiling, *walls], strict=True) if m]
    mats = [mat for _, mat in sides]
    return mesh_object(name, mats, corners_of(low, high), [f for f, _ in sides], range(len(mats)))


def wall_with_doorway(name: str, mat, y: float, x: Sequence, z: Sequence) -> bpy.types.Object:
    """A wall in the plane y. x: left, doorway's left and right, right; z: 0, doorway's top, top."""
    corners = [(a, y, b) for b in z for a in x]
    return mesh_object(
        name, [mat], corners, [(0, 1, 5, 9, 8, 4), (2, 3, 7, 11, 10, 6), (5, 6, 10, 9)]
    )


def corners_of(low, high) -> list[tuple[float, float, float]]:
    """The eight corners of a box; x runs fastest, then y."""
    return [
        (x, y, z) for z in (low[2], high[2]) for y in (low[1], high[1]) for x in (low[0], high[0])
    ]


def block(name: str, mat, low, high, at=(0, 0, 0), turn: float = 0.0) -> bpy.types.Object:
    """A closed box between two corners, then turned about z [degrees] and moved."""
    corners = [
        (x, y, z) for z in (low[2], high[2]) for y in (low[1], high[1]) for x in (low[0], high[0])
    ]
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3)]
    obj = mesh_object(name, [mat], corners, faces)
    obj.location = at
    obj.rotation_euler = (0, 0, math.radians(turn))
    return obj


def lathe(name: str, mat, profile: Sequence, at=(0, 0, 0), segments: int = 40):
    """A profile of (radius, height), from its lower end up, turned about z; closed at radius 0.

    Corners of the profile sharper than CREASE stay sharp; between them it is a smooth curve, fine
    enough that shading normals differ little from the faces' own.
    """
    return lathes(name, [(mat, profile)], at, segments)


def lathes(name: str, parts: Sequence, at=(0, 0, 0), segments: int = 40):
    """Several of them, each of a material and a profile, as one object."""
    corners, faces, which = [], [], []
    for number, (_, profile) in enumerate(parts):
        for run in smooth_runs(profile):
            turned(run, segments, corners, faces)
        which += [number] * (len(faces) - len(which))
    obj = mesh_object(name, [mat for mat, _ in parts], corners, faces, which, smooth=True)
    obj.location = at
    return obj


def turned(run: Sequence, segments: int, corners: list, faces: list) -> None:
    """Add a profile without creases."""
    rings = []
    for radius, z in run:
        count = segments if radius > 0 else 1
        angles = [2 * math.pi * i / segments for i in range(count)]
        rings.append(range(len(corners), len(corners) + count))
        corners += [(radius * math.cos(a), radius * math.sin(a), z) for a in angles]
    for lower, upper in itertools.pairwise(rings):
        for i in range(segments):
            a, b = lower[i % len(lower)], lower[(i + 1) % len(lower)]
            c, d = upper[(i + 1) % len(upper)], upper[i % len(upper)]
            faces.append(tuple(dict.fromkeys((a, b, c, d))))


def smooth_runs(profile: Sequence, steps: int = 3) -> list[list[tuple[float, float]]]:
    """The profile cut at its creases; each piece a Catmull-Rom spline, or just two points."""
    points = [Vector(p) for p in profile]
    cuts = [0]
    for i in range(1, len(points) - 1):
        if (points[i] - points[i - 1]).angle(points[i + 1] - points[i]) > CREASE:
            cuts.append(i)
    runs = []
    for first, last in itertools.pairwise([*cuts, len(points) - 1]):
        run = points[first : last + 1]
        if len(run) == 2:
            runs.append([tuple(p) for p in run])
            continue
        ends = [2 * run[0] - run[1], *run, 2 * run[-1] - run[-2]]
        fine = []
        for a, b, c, d in zip(ends, ends[1:], ends[2:], ends[3:], strict=False):
            for t in (i / steps for i in range(steps)):
                fine.append(
                    (2 * b + (c - a) * t + (2 * a - 5 * b + 4 * c - d) * t**2
                     + (3 * b - a - 3 * c + d) * t**3) / 2
                )  # fmt: skip
        runs.append([tuple(p) for p in [*fine, run[-1]]])
    return runs


def sheet(
    name: str, mat, radius: float, height: Callable[[float, float], float], at, rings: int = 20
) -> bpy.types.Object:
    """A smooth-shaded round sheet of the height that is a function of local (x, y), facing up."""
    corners, before = [(0.0, 0.0, height(0.0, 0.0))], [0]
    faces = []
    segments = 4 * rings
    for ring in range(1, rings + 1):
        first = len(corners)
        for i in range(segments):
            angle, r = 2 * math.pi * i / segments, radius * ring / rings
            x, y = r * math.cos(angle), r * math.sin(angle)
            corners.append((x, y, height(x, y)))
        now = list(range(first, first + segments))
        for i in range(segments):
            after = (i + 1) % segments
            old = (before[i], before[after]) if ring > 1 else (before[0],)
            faces.append((*old[:1], now[i], now[after], *old[1:]))
        before = now
    obj = mesh_object(name, [mat], corners, faces, smooth=True)
    obj.location = at
    return obj


def tube(
    name: str, mat, path: Callable[[float], Sequence[float]], radius: Callable[[float], float],
    rings: int = 32, segments: int = 24,
) -> bpy.types.Object:  # fmt: skip
    """A smooth pipe, open at its ends, about the points (0, y, z) that a path has from 0 to 1."""
    corners, faces = [], []
    for i in range(rings + 1):
        t = i / rings
        before, here, after = (Vector(path(s)) for s in (t - 1e-3, t, t + 1e-3))
        across = Vector((1, 0, 0))
        up = (after - before).normalized().cross(across)
        for k in range(segments):
            a = 2 * math.pi * k / segments
            corners.append(here + radius(t) * (math.cos(a) * across + math.sin(a) * up))
            b, c = segments * i + k, segments * i + (k + 1) % segments
            if i < rings:
                faces.append((b, b + segments, c + segments, c))
    return mesh_object(name, [mat], corners, faces, smooth=True)


def backdrop(name: str, mat, wide: float, deep: float, high: float, bend: float):
    """A sheet that lies on the floor from -deep to deep, bends, and rises to `high` behind."""
    turn = [math.pi / 2 * i / 48 for i in range(49)]
    bent = [(deep - bend + bend * math.sin(a), bend - bend * math.cos(a)) for a in turn]
    profile = [(-deep, 0.0), *bent, (deep, high)]
    corners = [(x, y, z) for y, z in profile for x in (-wide, wide)]
    faces = [(2 * i, 2 * i + 1, 2 * i + 3, 2 * i + 2) for i in range(len(profile) - 1)]
    return mesh_object(name, [mat], corners, faces, smooth=True)


def wall_with_window(name: str, mats: Sequence, x: Sequence, y: Sequence, z: Sequence):
    """A thick wall between the planes x, with a hole and its four sides.

    x: inside, outside; y and z: the wall's end, the hole's two, the wall's other end. `mats`:
    inside, the sides of the hole, outside.
    """
    corners = [(a, b, c) for a in x for c in z for b in y]
    across = [(i, i + 1, i + 5, i + 4) for i in range(11) if i % 4 != 3 and i != 5]
    inside, outside = across, [tuple(i + 16 for i in face) for face in across]
    hole = [5, 6, 10, 9]
    sides = [(a, b, b + 16, a + 16) for a, b in zip(hole, [*hole[1:], hole[0]], strict=True)]
    which = [0] * len(inside) + [1] * len(sides) + [2] * len(outside)
    return mesh_object(name, mats, corners, [*inside, *sides, *outside], which)


def camera(location=(0, -18.6, HEIGHT / 2), target=None, lens: float = 50) -> bpy.types.Object:
    """Look at the target; by default along y through a Cornell box's open front."""
    data = bpy.data.cameras.new("Camera")
    data.lens, data.sensor_width = lens, 36
    obj = add_object("Camera", data)
    turn = Matrix.Rotation(math.pi / 2, 4, "X")
    if target is not None:
        turn = (Vector(target) - Vector(location)).to_track_quat("-Z", "Y").to_matrix().to_4x4()
    obj.matrix_world = Matrix.Translation(location) @ turn
    bpy.context.scene.camera = obj
    return obj
