# SPDX-License-Identifier: GPL-3.0-or-later
"""What moves while the shutter is open covers the same pixels by the same shares as Cycles'."""

from __future__ import annotations

import bmesh
import bpy
import numpy as np
import pytest

from addon.photon.stage.movement import Movement
from addon.photon.stage.normals import unit
from tests.measure import render

from .build import CUBE, add_light, add_mesh, add_node, add_object, finish, new_material
from .test_lenses import SAMPLES, compare

pytestmark = pytest.mark.blender

EDGES = (0, 2)  # frames between which things move; the exposure is about frame 1


def go(obj, **ends) -> None:
    """Let properties of an object be so at frames 0 and 2."""
    for name, (first, last) in ends.items():
        for frame, value in zip(EDGES, (first, last), strict=True):
            setattr(obj, name, value)
            obj.keyframe_insert(name, frame=frame)


def bend(obj, offsets=(1.5, 0.8, 0.0)) -> None:
    """Let a corner of a mesh go by a shape key between frames 0 and 2."""
    obj.shape_key_add(name="Basis")
    key = obj.shape_key_add(name="Key")
    key.data[0].co = np.add(obj.data.vertices[0].co, offsets)
    for frame, value in zip(EDGES, (0.0, 1.0), strict=True):
        key.value = value
        key.keyframe_insert("value", frame=frame)


@pytest.fixture
def blurred(scene):
    scene.render.use_motion_blur, scene.render.motion_blur_shutter = True, 1.0
    scene.cycles.pixel_filter_type = "BOX"
    return scene


def test_nothing_moves(blurred, export) -> None:
    add_mesh("Still"), add_light("Lamp", "POINT")
    exported, report = export()
    assert exported.moving == () == exported.shutter
    assert not [e for e in report.entries if e.feature == "Motion Blur"]


def test_a_view_layer_without_motion_blur(blurred, export) -> None:
    go(add_mesh("Moved"), location=((0, 0, 0), (2, 0, 0)))
    assert export()[0].moving
    bpy.context.view_layer.use_motion_blur = False
    assert export()[0].moving == () == export()[0].shutter


def test_what_moves(blurred, export) -> None:
    """By its place or its shape; not what Cycles holds still, too: lamps, and what is told to."""
    moved, held, stiff, bent = (add_mesh(name) for name in ("Moved", "Held", "Stiff", "Bent"))
    held.cycles.use_motion_blur = stiff.cycles.use_deform_motion = False
    for obj in (moved, held, add_light("Lamp", "POINT")):
        go(obj, location=((0, 0, 0), (2, 0, 0)))
    for obj in (stiff, bent):
        bend(obj)
    blurred.frame_set(1)
    exported, report = export()
    named = {e.object for e in report.of("exact") if e.feature == "Motion Blur"}
    assert named == {"Object 'Moved'", "Object 'Bent'"}
    first, last = (exported.surfaces.index(name) for name in ("Moved", "Bent"))
    by_first = sorted(exported.moving, key=lambda one: one.vertices)
    runs = [exported.triangles[exported.surface == number] for number in (first, last)]
    assert {one.vertices for one in by_first} == {(r.min(), r.max() + 1) for r in runs}
    assert len(exported.shutter) > 2 and exported.lights[0].position[0] == pytest.approx(1.0)
    # Half of the way of two frames is exposed.
    (rigid,) = (one for one in exported.moving if not one.bends)
    np.testing.assert_allclose(rigid.matrices[:, 0, 3], (0.5, 1.0, 1.5), atol=0.2)
    (soft,) = (one for one in exported.moving if one.bends)
    assert not len(soft.matrices) and soft.offsets.shape == (3, 4, 3)
    assert blurred.frame_current == 1 and blurred.frame_subframe == 0.0


def test_the_camera_moves_too(blurred, export) -> None:
    """One shutter is the scene's and the camera's."""
    for obj in (blurred.camera, add_mesh("Moved")):
        go(obj, location=((0, 0, 0), (2, 0, 0)))
    blurred.frame_set(1)
    exported, _ = export()
    assert exported.moving and exported.camera.motion
    assert exported.shutter == exported.camera.motion.shutter != ()


def test_other_vertices(blurred, export) -> None:
    """A mesh with other vertices at another instant keeps its shape, and is named."""
    obj = add_mesh("Plane")
    array = obj.modifiers.new("Array", "ARRAY")
    array.count = 1
    array.keyframe_insert("count", frame=0)
    array.count = 3
    array.keyframe_insert("count", frame=2)
    blurred.frame_set(1)
    exported, report = export()
    assert exported.moving == ()
    assert any(e.feature == "Motion Blur" for e in report.of("approximated"))


def test_at_the_steps_it_is_what_blender_shows(blurred, export) -> None:
    """Vertices and normals, of what is mirrored and instanced, too."""
    moved = add_mesh("Cube", CUBE, scale=(1, -0.5, 0.7))
    go(moved, location=((0, 0, 0), (2, 1, 0)), rotation_euler=((0, 0, 0), (0.5, 0.2, 1)))
    moved.cycles.motion_steps = 2
    bend(moved)
    for face in moved.data.polygons:
        face.use_smooth = True
    parent = bpy.data.collections.new("Parts")
    parent.objects.link(moved)
    go(
        add_object("Instance", None, instance_type="COLLECTION", instance_collection=parent),
        location=((3, 0, 0), (3, 1, 0)),
    )
    blurred.frame_set(1)
    moving = Movement(export()[0])
    blurred.render.use_motion_blur = False
    for time in (0.0, 0.25, 0.5, 0.75, 1.0):
        blurred.frame_set(0 if time < 0.5 else 1, subframe=(0.5 + time) % 1.0)
        there, at = export()[0], moving.at(time)
        np.testing.assert_allclose(at.vertices, there.vertices, atol=2e-6)
        # Blender and we both make normals smooth where corners are; ours lie between steps.
        cosine = (unit(at.corner_normals) * unit(there.corner_normals)).sum(axis=2)
        assert cosine.min() > 0.9999


CURVE = (0.0, 0.3, 1.0)


@pytest.mark.stability(74)
@pytest.mark.thorough("stretched", "instanced")
@pytest.mark.parametrize("kind", ["moved", "turned", "stretched", "bent", "both", "instanced"])
def test_moving_objects(blurred, cycles_mean, export, device, kind) -> None:
    """By the shares of pixels that they cover, of exposures of several kinds."""
    scene, camera = blurred, blurred.camera
    camera.location = (0, 0, 8)
    obj = add_mesh("Cube", CUBE, scale=(1, 0.4, 0.7))
    if kind in ("moved", "both"):
        go(obj, location=((-2, -0.5, 0), (2, 0.5, 0)))
    if kind == "turned":
        go(obj, rotation_euler=((0, 0, 0), (0.4, 0.2, 4.0)))
        scene.render.motion_blur_shutter = 0.6
        scene.render.motion_blur_position = "START"
    if kind == "stretched":
        go(obj, scale=((1, -0.4, 1), (2, -1.8, 1)))
        obj.cycles.motion_steps = 2
    if kind in ("bent", "both"):
        bend(obj, (-1.5, 1.0, 0.0))
        curve = scene.render.motion_blur_shutter_curve
        for point, height in zip(curve.curves[0].points, CURVE, strict=True):
            point.location[1] = height
        curve.update()
    if kind == "instanced":
        parts = bpy.data.collections.new("Parts")
        parts.objects.link(obj)
        scene.collection.objects.unlink(obj)
        for side in (-1, 1):
            empty = add_object("I", None, instance_type="COLLECTION", instance_collection=parts)
            go(empty, location=((side, -2, 0), (side, 1, 0)))
    scene.frame_set(1)
    compare(cycles_mean, export, device)


@pytest.mark.stability(74)
@pytest.mark.thorough("0.0")
@pytest.mark.parametrize("shutter", [0.0, 1.0])
def test_a_camera_inside_what_is_blurred(blurred, cycles_mean, export, device, shutter) -> None:
    """A shell with a hole goes past the camera in it."""
    scene, camera = blurred, blurred.camera
    scene.render.motion_blur_shutter = shutter
    bpy.ops.mesh.primitive_uv_sphere_add(segments=16, ring_count=8, radius=2.0)
    shell = bpy.context.object
    mesh = bmesh.new()
    mesh.from_mesh(shell.data)
    bmesh.ops.delete(mesh, geom=[f for f in mesh.faces if f.index % 3 == 0], context="FACES")
    mesh.to_mesh(shell.data)
    mesh.free()
    go(shell, location=((-1, 0, 0.5), (1, 0, -0.5)), rotation_euler=((0, 0, 0), (0.3, 0, 0.8)))
    camera.location, camera.data.lens = (0, 0, 0), 15
    scene.frame_set(1)
    compare(cycles_mean, export, device)


def test_what_is_painted_on_it_goes_with_it(blurred, cycles_mean, export, device) -> None:
    """By the coordinates of the object, which turns and goes."""
    material, tree = new_material("Painted")
    place = tree.nodes.new("ShaderNodeTexCoord").outputs["Object"]
    finish(tree, add_node(tree, "ShaderNodeBsdfDiffuse", Color=place))
    obj = add_mesh("Plane", scale=(1.5, 0.8, 1.0))
    obj.data.materials.append(material)
    go(obj, location=((-1, 0, 0), (1.5, 0.5, 0)), rotation_euler=((0, 0, 0), (0, 0, 1.5)))
    add_light("Sun", "SUN", energy=2.0)
    blurred.frame_set(1)
    ours = render(device, export()[0], width=64, height=32, passes=SAMPLES, photons=0)
    blurred.cycles.max_bounces = 0
    theirs = cycles_mean(SAMPLES, 1)
    blocks = [
        image[..., :2].reshape(4, 8, 8, 8, 2).mean(axis=(1, 3))
        for image in (ours["Combined"], theirs)
    ]
    assert blocks[1].max() > 0.05
    np.testing.assert_allclose(blocks[0], blocks[1], atol=0.01 * blocks[1].max())
