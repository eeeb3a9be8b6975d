# SPDX-License-Identifier: GPL-3.0-or-later
"""The evaluated Blender scene as a Scene of the renderer, and a report of what got lost."""

from __future__ import annotations

import bpy
import numpy as np

from ...photon.scene import Camera, Image, Light, Scene
from .camera import export_camera
from .geometry import Geometry
from .lights import export_light
from .materials import MaterialTable
from .motion import FrameSet, Shutter, with_motion
from .report import Entry, Notes, Report
from .shaders import SpecularModel
from .visibility import note_light_groups, visible_bits
from .world import export_world, note_scene

__all__ = ["Entry", "Report", "SpecularModel", "snapshot"]


def snapshot(
    depsgraph: bpy.types.Depsgraph,
    camera: bpy.types.Object | None = None,
    model: SpecularModel = SpecularModel.GGX,
    frame_set: FrameSet | None = None,
) -> tuple[Scene, Report]:
    """Copy the evaluated scene out of Blender; nothing of the result refers to Blender's memory.

    `camera` replaces the scene's; `model` is what glossy shaders become; `frame_set` evaluates the
    scene at another time: without it nothing moves. Raises SceneError if the scene cannot be
    rendered at all.
    """
    notes = Notes()
    scene = depsgraph.scene_eval
    exported_camera = export_camera(camera or scene.camera, depsgraph, notes)
    if not (frame_set and scene.render.use_motion_blur):
        return _snapshot(exported_camera, depsgraph, model, notes)
    shutter = Shutter(scene, frame_set)
    try:
        seen = camera or scene.camera
        exported_camera = with_motion(exported_camera, seen, depsgraph, shutter, notes)
        return _snapshot(exported_camera, depsgraph, model, notes)
    finally:
        shutter.leave()


def _snapshot(
    camera: Camera, depsgraph: bpy.types.Depsgraph, model: SpecularModel, notes: Notes
) -> tuple[Scene, Report]:
    """As snapshot, of what stands still."""
    scene = depsgraph.scene_eval
    view_layer, layer = depsgraph.view_layer_eval, depsgraph.view_layer
    note_scene(scene, view_layer, notes)
    note_light_groups(view_layer, notes)
    materials = MaterialTable(notes, model, view_layer.material_override)
    geometry = Geometry()
    lights: list[Light] = []
    # Render depsgraphs hold no hidden objects, the viewport's do.
    viewport = depsgraph.mode == "VIEWPORT"
    for instance in depsgraph.object_instances:  # its items do not outlive an iteration
        obj = instance.object
        if not instance.show_self or (viewport and obj.hide_render):
            continue
        matrix = np.array(instance.matrix_world, np.float64)
        if obj.type == "LIGHT":
            light = export_light(obj, matrix, notes)
            if light is not None:
                lights.append(light)
        else:
            geometry.add(obj, matrix, visible_bits(instance, layer), materials, notes)
    world = getattr(view_layer, "world_override", None) or scene.world
    images: list[Image] = []
    lights += export_world(world, images, notes)
    exported = Scene(
        camera=camera,
        lights=tuple(lights),
        materials=tuple(materials.materials),
        surfaces=tuple(geometry.surfaces),
        images=tuple(images),
        **geometry.arrays(
            materials.asked, any(material.program for material in materials.materials)
        ),
    )
    exported.check()
    return exported, notes.finish()
