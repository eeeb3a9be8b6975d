# SPDX-License-Identifier: GPL-3.0-or-later
"""The evaluated Blender scene as a Scene of the renderer, and a report of what got lost."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import bpy
import numpy as np

from ...photon.scene import Camera, Image, Scene
from .camera import View, export_camera
from .caustics import caustics_of, note_casters
from .dicing import dicing_of
from .geometry import Geometry
from .graph import Context
from .lights import Lamps
from .linking import Linking
from .materials import MaterialTable
from .motion import FrameSet, Shutter, Views
from .report import Entry, Notes, Report
from .shaders import SpecularModel
from .textures import TextureTable
from .tracks import Tracks
from .unsupported import note_scene
from .visibility import (
    Rays,
    group_of,
    group_of_instance,
    note_rays,
    note_scattered_rays,
    terminator_of,
    visible_bits,
)
from .world import export_world

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
    is_blurred = scene.render.use_motion_blur and depsgraph.view_layer_eval.use_motion_blur
    if not (frame_set and is_blurred):
        return _snapshot(exported_camera, depsgraph, model, notes)
    shutter = Shutter(scene, frame_set)
    try:
        views, tracks = Views(camera or scene.camera, depsgraph, notes), Tracks(depsgraph, notes)
        tracks.follow(shutter, views)
        moving = views.moving(exported_camera, shutter.curve)
        return _snapshot(moving, depsgraph, model, notes, tracks, shutter.curve)
    finally:
        shutter.leave()


def _snapshot(
    camera: Camera,
    depsgraph: bpy.types.Depsgraph,
    model: SpecularModel,
    notes: Notes,
    tracks: Tracks | None = None,
    shutter: tuple[float, ...] = (),
) -> tuple[Scene, Report]:
    """As snapshot, at an instant; `tracks` tell what moves while the `shutter` is open."""
    scene = depsgraph.scene_eval
    view_layer, layer = depsgraph.view_layer_eval, depsgraph.view_layer
    note_scene(scene, view_layer, notes)
    textures = TextureTable.of(scene, notes)
    world = getattr(view_layer, "world_override", None) or scene.world
    world = world if view_layer.use_sky else None
    holders = tuple(holder for holder in (view_layer, scene, world) if holder)
    context = Context(camera=View(camera), holders=holders)
    materials = MaterialTable(notes, model, view_layer.material_override, context, textures)
    images: list[Image] = []
    lamps, linking = Lamps(images, notes), Linking(depsgraph, notes)
    # Render depsgraphs hold no hidden objects, the viewport's do.
    viewport = depsgraph.mode == "VIEWPORT"
    geometry = Geometry(viewport, scene.frame_current, view_layer.use_solid, view_layer.use_strand)
    for instance in depsgraph.object_instances:  # its items do not outlive an iteration
        obj = instance.object
        if (viewport and obj.hide_render) or not (instance.show_self or instance.show_particles):
            continue
        matrix = np.array(instance.matrix_world, np.float64)
        visible, group = visible_bits(instance, layer), group_of_instance(instance, layer)
        if obj.type == "LIGHT" and instance.show_self:
            lamps.add(instance, matrix, visible, group, linking.excluded_by(instance))
        elif obj.type != "LIGHT":
            follow = partial(tracks.moving, instance, matrix) if tracks else None
            dicing = dicing_of(obj, scene, matrix)
            links = linking.set_of(instance), linking.excluded_by(instance)
            rays = Rays(visible, group, terminator_of(obj), dicing, *links)
            geometry.add(instance, matrix, rays, materials, notes, follow)
    group = group_of(world.lightgroup, layer) if world else ""
    context = replace(context, attributes=[])
    is_shown = not scene.render.film_transparent
    from_world, air = export_world(world, images, notes, context, is_shown)
    lights = (*lamps.as_the_eye_sees(), *(replace(x, group=group) for x in from_world))
    arrays = geometry.arrays(materials.materials)
    exported = Scene(
        camera=camera,
        lights=lights,
        materials=tuple(materials.materials),
        surfaces=tuple(geometry.surfaces),
        images=tuple(images),
        textures=tuple(textures.textures),
        air=air,
        caustics=caustics_of(scene, materials.materials, notes),
        light_groups=tuple(group.name for group in layer.lightgroups),
        shutter=shutter if arrays["moving"] else (),
        **arrays,
    )
    exported.check()
    _note(exported, depsgraph, notes)
    return exported, notes.finish()


def _note(exported: Scene, depsgraph: bpy.types.Depsgraph, notes: Notes) -> None:
    """Write down what hangs on all of the scene together."""
    scene = depsgraph.scene_eval
    note_rays(exported, notes)
    note_scattered_rays(exported, depsgraph, notes)
    note_moving_volumes(exported, notes)
    is_blurred = getattr(getattr(scene, "cycles", None), "blur_glossy", 0.0) > 0.0
    note_casters(f"Scene '{scene.name}'", exported, is_blurred, notes)


def note_moving_volumes(exported: Scene, notes: Notes) -> None:
    """Write down which objects move whose nodes tell of their volumes from place to place, or whose
    volumes light others."""
    for told, what in (
        ("asks", "what nodes tell of it stands still"),
        ("glows", "it lights things as if it stood still"),
    ):
        some = np.array([getattr(x.medium, told) for x in exported.materials], bool)
        found = some[exported.material]
        moves = np.zeros(len(found), bool)
        for one in exported.moving if found.any() else ():
            moves |= one.owns(exported.triangles)
        for surface in np.unique(exported.surface[found & moves]):
            owner = f"Object '{exported.surfaces[surface]}'"
            notes.approximated(owner, "Volume that moves", what)
