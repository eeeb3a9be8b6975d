# SPDX-License-Identifier: GPL-3.0-or-later
"""Make the three Cornell boxes beside this script, or in the folder given as the argument.

Run it with bpy 4.2, the oldest Blender that Photon Stream supports: what Blender 5 saves,
Blender 4.2 to 4.4 cannot open.

    python3.11 -m venv build/bpy42 && build/bpy42/bin/pip install bpy==4.2.23 "numpy<2"
    build/bpy42/bin/python blend_scenes/make_scenes.py

All three are rooms of 10 x 10 x 10 units: x from -5 (left) to 5, y from -5 (open front) to 5,
z from 0 (floor) to 10. Objects stand SUNK deep in the floor, so that no two faces are coplanar.
"""

from __future__ import annotations

import atexit
import math
import sys
from pathlib import Path

import bpy

# isort: split
import bmesh  # these two can be imported only after bpy
from mathutils import Matrix, Vector

HALF = 5.0
HEIGHT = 10.0
SUNK = 0.01


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


def spotlight(power: float, location, target, cone: float, blend: float) -> bpy.types.Object:
    """A delta spotlight of `power` [W], aimed at `target`, `cone` [degrees] from edge to edge."""
    light = bpy.data.lights.new("Spotlight", "SPOT")
    light.energy = power
    light.spot_size = math.radians(cone)
    light.spot_blend = blend
    light.shadow_soft_size = 0
    obj = add_object("Spotlight", light)
    obj.location = location
    obj.rotation_euler = (Vector(target) - Vector(location)).to_track_quat("-Z", "Y").to_euler()
    return obj


def camera() -> bpy.types.Object:
    """Look along y through the open front, whose rim lies just outside of the picture."""
    data = bpy.data.cameras.new("Camera")
    data.lens, data.sensor_width = 50, 36
    obj = add_object("Camera", data)
    obj.matrix_world = Matrix.Translation((0, -18.6, HEIGHT / 2)) @ Matrix.Rotation(
        math.pi / 2, 4, "X"
    )
    bpy.context.scene.camera = obj
    return obj


def cornell_box() -> None:
    """The test scene of Marino & Abbate: k_d 0.2, k_s 0.1 as a broad lobe, spot in the ceiling."""
    exponent = 10.0  # of the Phong lobe: n = 2 / a^2 - 2 with a = roughness^2
    roughness = (2 / (exponent + 2)) ** 0.25
    grey = material("Grey", (0.2,) * 3, (0.1,) * 3, roughness)
    room(grey, grey, grey)
    box("Box", grey, (2.8, 2.8, 5.0), (-1.9, 1.7), 18)
    sphere("Sphere", grey, 1.6, (2.1, -0.6, 1.6 - SUNK), 4)
    spotlight(4500, (0, -1.5, 9.9), (0, -1.5, 0), cone=150, blend=0.5)


def cornell_classic() -> None:
    """Coloured walls, two boxes, diffuse only."""
    white, red, green = wall_paints()
    room(white, red, green)
    box("Tall box", white, (3.0, 3.0, 6.0), (-1.8, 1.6), 18)
    box("Short box", white, (3.0, 3.0, 3.0), (1.9, -1.5), -17)
    spotlight(1800, (0, -1.5, 9.9), (0, -1.5, 0), cone=140, blend=0.5)


def cornell_mirror() -> None:
    """A mirror sphere that hangs in the room, above the spot's cone.

    No light falls on the mirror directly: such a caustic of a point-like light is what Cycles
    cannot find, and the two renderers' pictures would not be comparable.
    """
    white, red, green = wall_paints()
    mirror = material("Mirror", glossy=(0.9, 0.9, 0.9))
    room(white, red, green)
    box("Box", white, (3.0, 3.0, 4.0), (1.5, 1.0), -17)
    ball = sphere("Mirror sphere", mirror, 1.7, (-2.6, 2.0, 7.1), 5)
    lamp = spotlight(2400, (1.8, -1.5, 9.9), (1.8, -1.5, 0), cone=92, blend=0.5)
    bpy.context.view_layer.update()
    to_ball = ball.location - lamp.location
    axis = lamp.matrix_world.to_quaternion() @ Vector((0, 0, -1))
    nearest = axis.angle(to_ball) - math.asin(1.7 / to_ball.length)
    assert nearest > lamp.data.spot_size / 2 + math.radians(1), "the spot lights the mirror"


def wall_paints() -> tuple[bpy.types.Material, bpy.types.Material, bpy.types.Material]:
    return (
        material("White", (0.7, 0.7, 0.7)),
        material("Red", (0.63, 0.065, 0.05)),
        material("Green", (0.14, 0.45, 0.09)),
    )


def main() -> None:
    here = Path(__file__).resolve().parent
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else here
    if bpy.app.version >= (4, 3) and folder.resolve() == here:
        sys.exit(f"This is bpy {bpy.app.version_string}; save with 4.2 (see the top of this file).")
    folder.mkdir(parents=True, exist_ok=True)
    bpy.utils.register_class(PhotonStreamStub)
    atexit.register(bpy.utils.unregister_class, PhotonStreamStub)  # else bpy crashes at exit
    for make in (cornell_box, cornell_classic, cornell_mirror):
        empty_scene()
        camera()
        make()
        path = folder / f"{make.__name__}.blend"
        bpy.ops.wm.save_as_mainfile(filepath=str(path.resolve()), compress=True)


if __name__ == "__main__":
    main()
