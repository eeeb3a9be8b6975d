# SPDX-License-Identifier: GPL-3.0-or-later
"""Smooth meshes of few faces that are stretched, against Cycles: it interpolates normals in an
object's space where it keeps the mesh there, else in the world's."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

from addon.photon.stage.movement import Movement

from .build import add_light, add_node, finish, new_material
from .test_normals import DIFFUSE, NEAR, PRINCIPLED, difference, pictures

pytestmark = pytest.mark.blender


def ball(shader: str) -> bpy.types.Object:
    """Seen from above, under a sun."""
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2, radius=1.0)
    bpy.ops.object.shade_smooth()
    obj = bpy.context.object
    material, tree = new_material()
    finish(tree, add_node(tree, shader))
    obj.data.materials.append(material)
    obj.scale, obj.rotation_euler = (1.0, 0.4, 0.7), (0.5, 0.3, 0.9)
    sun = add_light("Sun", "SUN", energy=3.0, angle=0.0)
    sun.rotation_euler = 0.7, 0.4, 0.0
    scene = bpy.context.scene
    scene.camera.data.type, scene.camera.data.ortho_scale = "ORTHO", 4.0
    scene.camera.location = 0.0, 0.0, 10.0
    scene.render.resolution_x = scene.render.resolution_y = 96
    return obj


def alone(obj: bpy.types.Object) -> None:
    pass


def shared(obj: bpy.types.Object) -> None:
    """By another object, mirrored."""
    other = bpy.data.objects.new("Other", obj.data)
    bpy.context.scene.collection.objects.link(other)
    other.scale, other.location.x = (0.3, -0.8, 1.0), 1.7


def of_own_material(obj: bpy.types.Object) -> None:
    """The same, of which each object has its own."""
    material = obj.data.materials[0]
    shared(obj)
    for one in (obj, bpy.data.objects["Other"]):
        one.material_slots[0].link = "OBJECT"
        one.material_slots[0].material = material


@pytest.mark.parametrize("made", [alone, shared, of_own_material])
@pytest.mark.parametrize("shader", [DIFFUSE, PRINCIPLED])
def test_stretched(export, cycles_mean, device, shader, made) -> None:
    made(ball(shader))
    ours, cycles = pictures(export, cycles_mean, device)
    found = difference(ours, cycles)
    assert len(found) > 400
    assert (found < NEAR).mean() > 0.98


@pytest.mark.parametrize("is_local", [False, True])
def test_what_bends(export, is_local: bool) -> None:
    """In the middle of the exposure its normals are those that it has without motion blur; Cycles
    keeps in its own space what scatters below its surface."""
    obj = ball(PRINCIPLED)
    node = next(x for x in obj.active_material.node_tree.nodes if x.type == "BSDF_PRINCIPLED")
    node.inputs["Subsurface Weight"].default_value = float(is_local)
    obj.shape_key_add(name="Basis")
    key = obj.shape_key_add(name="Key")
    for point in key.data:
        point.co.x *= 1.5
    scene = bpy.context.scene
    for frame, value in ((0, 0.0), (2, 1.0)):
        key.value = value
        key.keyframe_insert("value", frame=frame)
    scene.frame_set(1)
    still = export()[0]
    scene.render.use_motion_blur, scene.render.motion_blur_shutter = True, 1.0
    exported = export()[0]
    assert exported.moving
    there = Movement(exported).at(0.5).corner_normals
    lengths = np.linalg.norm(still.corner_normals, axis=2)
    assert (lengths.min() < 0.9) == is_local and lengths.max() < 1.001
    np.testing.assert_allclose(there, still.corner_normals, atol=0.02)
