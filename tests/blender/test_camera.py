# SPDX-License-Identifier: GPL-3.0-or-later
"""The exported camera sees what Blender's camera sees."""

from __future__ import annotations

import itertools

import bpy
import numpy as np
import pytest
from bpy_extras.object_utils import world_to_camera_view
from mathutils import Euler, Matrix, Vector

from addon.blender.export import snapshot
from addon.photon.errors import SceneError
from addon.photon.scene import Camera

from .build import add_object, unknown_lens

pytestmark = pytest.mark.blender

POINTS = [Vector(p) for p in ((0.3, -0.2, 0.1), (-1.0, 0.5, 0.0), (2.0, 1.0, -3.0), (0, 0, 1))]


def project(camera: Camera, point: Vector) -> tuple[float, float]:
    """Return a world point in the frame, (0, 0) bottom left to (1, 1) top right."""
    x, y, z, _ = np.linalg.inv(camera.matrix) @ [*point, 1.0]
    if camera.kind == "PERSP":
        x, y = x / -z, y / -z
    left, right, bottom, top = camera.window
    return (x - left) / (right - left), (y - bottom) / (top - bottom)


@pytest.mark.parametrize(
    ("kind", "fit", "shift", "aspect", "size"),
    list(
        itertools.product(
            ("PERSP", "ORTHO"),
            ("AUTO", "HORIZONTAL", "VERTICAL"),
            ((0.0, 0.0), (0.3, -0.2)),
            ((1.0, 1.0), (2.0, 1.0), (1.0, 1.5)),
            ((64, 32), (30, 50)),
        )
    ),
)
def test_window_projects_as_blender_does(scene, kind, fit, shift, aspect, size) -> None:
    obj = scene.camera
    obj.location, obj.rotation_euler = (2.0, -3.0, 6.0), Euler((0.4, 0.1, 0.6))
    obj.data.type, obj.data.sensor_fit = kind, fit
    obj.data.shift_x, obj.data.shift_y = shift
    obj.data.lens, obj.data.ortho_scale = 35.0, 7.0
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.render.pixel_aspect_x, scene.render.pixel_aspect_y = aspect
    camera = snapshot(bpy.context.evaluated_depsgraph_get())[0].camera
    assert camera.kind == kind
    for point in POINTS:
        expected = world_to_camera_view(scene, obj, point)[:2]
        assert project(camera, point) == pytest.approx(expected, abs=2e-5)


def test_percentage_keeps_the_window(scene, export) -> None:
    whole = export()[0].camera.window
    scene.render.resolution_percentage = 50
    assert export()[0].camera.window == pytest.approx(whole)


def test_scale_is_removed_and_the_matrix_is_rigid(scene, export) -> None:
    scene.camera.scale = (2.0, 3.0, 0.5)
    scene.camera.rotation_euler = (0.3, 0.2, 0.1)
    camera, report = export()[0].camera, export()[1]
    rotation = camera.matrix[:3, :3]
    np.testing.assert_allclose(rotation.T @ rotation, np.eye(3), atol=1e-12)
    assert not [entry for entry in report.entries if "Skew" in entry.feature]


def test_skew_keeps_the_view_direction(scene, export) -> None:
    skew = Matrix(((1, 0.5, 0, 0), (0, 1, 0, 0), (0, 0, 1, 4), (0, 0, 0, 1)))
    parent = bpy.data.objects.new("Parent", None)
    scene.collection.objects.link(parent)
    scene.camera.parent, scene.camera.matrix_parent_inverse = parent, skew
    exported, report = export()
    rotation = exported.camera.matrix[:3, :3]
    np.testing.assert_allclose(rotation.T @ rotation, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(rotation[:, 2], (0, 0, 1), atol=1e-7)
    assert any(entry.feature == "Skewed transform" for entry in report.of("approximated"))


def test_clipping(scene, export) -> None:
    scene.camera.data.clip_start, scene.camera.data.clip_end = 0.25, 40.0
    camera = export()[0].camera
    assert (camera.clip_start, camera.clip_end) == (0.25, 40.0)


def test_depth_of_field(scene, export) -> None:
    """Cycles' aperture, and where it is focused: at a distance, or along the axis to an object."""
    assert export()[0].camera.lens is None
    data = scene.camera.data
    dof = data.dof
    data.lens, dof.use_dof, dof.focus_distance, dof.aperture_fstop = 80.0, True, 3.0, 2.0
    dof.aperture_blades, dof.aperture_rotation, dof.aperture_ratio = 5, 0.25, 2.0
    lens = export()[0].camera.lens
    assert (lens.radius, lens.focus) == pytest.approx((0.02, 3.0))
    assert (lens.blades, lens.rotation, lens.ratio) == (5, 0.25, 2.0)
    dof.focus_object = add_object("Focus", None, location=(3.0, 1.0, 4.0))
    assert export()[0].camera.lens.focus == pytest.approx(6.0)
    dof.focus_object.location = (0.0, 0.0, 12.0)  # behind
    assert export()[0].camera.lens.focus == pytest.approx(2.0)
    data.type, dof.aperture_fstop = "ORTHO", 0.0
    assert export()[0].camera.lens.radius == pytest.approx(0.5e5)


def test_focus_on_a_bone(scene, export) -> None:
    armature = add_object("Rig", bpy.data.armatures.new("Rig"), location=(0.0, 0.0, 1.0))
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    bone = armature.data.edit_bones.new("Bone")
    bone.head, bone.tail = (0.0, 0.0, 2.0), (1.0, 0.0, 2.0)
    bpy.ops.object.mode_set(mode="OBJECT")
    dof = scene.camera.data.dof
    dof.use_dof, dof.focus_object, dof.focus_subtarget = True, armature, "Bone"
    assert export()[0].camera.lens.focus == pytest.approx(7.0)


@pytest.mark.stability(38)
def test_no_camera(scene) -> None:
    scene.camera = None
    with pytest.raises(SceneError, match="Scene 'Scene' has no camera"):
        snapshot(bpy.context.evaluated_depsgraph_get())


def test_panoramas_that_are_refused(scene, export) -> None:
    unknown_lens(scene.camera.data)
    with pytest.raises(SceneError, match="Camera 'Camera' is of type FISHEYE_LENS_POLYNOMIAL: Ph"):
        export()


def test_zero_scale_is_refused(scene, export) -> None:
    scene.camera.scale = (0.0, 1.0, 1.0)
    with pytest.raises(SceneError, match="zero scale"):
        export()
