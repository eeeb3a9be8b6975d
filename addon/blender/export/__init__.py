# SPDX-License-Identifier: GPL-3.0-or-later
"""The evaluated Blender scene as a Scene of the renderer, and a report of what got lost."""

from __future__ import annotations

import bpy
import numpy as np

from ...photon.scene import Light, Scene
from .camera import export_camera
from .geometry import Geometry, note_visibility
from .lights import export_light
from .materials import MaterialTable
from .report import Entry, Notes, Report
from .shaders import SpecularModel
from .world import export_world, note_scene

__all__ = ["Entry", "Report", "SpecularModel", "snapshot"]


def snapshot(
    depsgraph: bpy.types.Depsgraph,
    camera: bpy.types.Object | None = None,
    model: SpecularModel = SpecularModel.GGX,
) -> tuple[Scene, Report]:
    """Copy the evaluated scene out of Blender; nothing of the result refers to Blender's memory.

    `camera` replaces the scene's; `model` is what glossy shaders become. Raises SceneError if the
    scene cannot be rendered at all.
    """
    notes = Notes()
    scene = depsgraph.scene_eval
    view_layer = depsgraph.view_layer_eval
    exported_camera = export_camera(camera or scene.camera, depsgraph, notes)
    note_scene(scene, view_layer, notes)
    materials = MaterialTable(notes, model, view_layer.material_override)
    geometry = Geometry()
    lights: list[Light] = []
    # Render depsgraphs hold no hidden objects, the viewport's do.
    viewport = depsgraph.mode == "VIEWPORT"
    for instance in depsgraph.object_instances:  # its items do not outlive an iteration
        obj = instance.object
        if not instance.show_self or (viewport and obj.hide_render):
            continue
        if instance.is_instance:  # visible where it and its instancer are
            note_visibility(instance.parent, notes)
        matrix = np.array(instance.matrix_world, np.float64)
        if obj.type == "LIGHT":
            light = export_light(obj, matrix, notes)
            if light is not None:
                lights.append(light)
        else:
            geometry.add(obj, matrix, materials, notes)
    world = getattr(view_layer, "world_override", None) or scene.world
    lights += export_world(world, notes)
    exported = Scene(
        camera=exported_camera,
        lights=tuple(lights),
        materials=tuple(materials.materials),
        surfaces=tuple(geometry.surfaces),
        **geometry.arrays(),
    )
    exported.check()
    return exported, notes.finish()
