# SPDX-License-Identifier: GPL-3.0-or-later
"""Panels of those of Cycles' settings that this engine heeds, too, where its own are not shown."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import bpy

from .panel import EnginePanel

BOUNCES = ("max_bounces", "transparent_max_bounces", "volume_bounces")
CLAMPS = ("sample_clamp_direct", "sample_clamp_indirect")
CAUSTICS = ("caustics_reflective", "caustics_refractive")
WORLD_RAYS = ("camera", "diffuse", "glossy", "transmission", "scatter")


class RENDER_PT_photon_stream_bounces(EnginePanel, bpy.types.Panel):
    bl_label = "Limits and Caustics"
    bl_parent_id = "RENDER_PT_photon_stream_light_paths"

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.split_layout()
        cycles = getattr(context.scene, "cycles", None)
        draw_all(layout.column(align=True), cycles, BOUNCES)
        draw_all(layout.column(align=True), cycles, CLAMPS)
        draw_all(layout.column(align=True, heading="Caustics"), cycles, CAUSTICS)


class DATA_PT_photon_stream_light_settings(EnginePanel, bpy.types.Panel):
    bl_label = "Settings"
    bl_context = "data"
    subject = "light"
    bl_parent_id = "DATA_PT_photon_stream_light"

    def draw(self, context: bpy.types.Context) -> None:
        layout, light = self.split_layout(), context.light
        col = layout.column(align=True)
        col.prop(light, "use_shadow", text="Cast Shadow")
        names = ["cast_shadow", "max_bounces", "use_multiple_importance_sampling"]
        names += ["is_portal"] if light.type == "AREA" else []
        draw_all(col, getattr(light, "cycles", None), names)


class WORLD_PT_photon_stream_settings(EnginePanel, bpy.types.Panel):
    bl_label = "Ray Visibility"
    bl_context = "world"
    subject = "world"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        layout, world = self.split_layout(), context.world
        col = layout.column(align=True, heading="Visible to")
        draw_all(col, getattr(world, "cycles_visibility", None), WORLD_RAYS)
        draw_all(layout.column(), getattr(world, "cycles", None), ("max_bounces",))


class OBJECT_PT_photon_stream_motion(EnginePanel, bpy.types.Panel):
    bl_label = "Motion Blur"
    bl_context = "object"
    subject = "object"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        names = ("use_motion_blur", "use_deform_motion", "motion_steps")
        draw_all(self.split_layout().column(), getattr(context.object, "cycles", None), names)


class VIEWLAYER_PT_photon_stream_override(EnginePanel, bpy.types.Panel):
    bl_label = "Override"
    bl_context = "view_layer"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        names = ("material_override", "world_override")
        draw_all(self.split_layout().column(), context.view_layer, names)


CLASSES = (
    RENDER_PT_photon_stream_bounces,
    DATA_PT_photon_stream_light_settings,
    WORLD_PT_photon_stream_settings,
    OBJECT_PT_photon_stream_motion,
    VIEWLAYER_PT_photon_stream_override,
)


def draw_all(layout: bpy.types.UILayout, owner: Any, names: Iterable[str]) -> None:
    """Draw those of an owner's properties that it has: Cycles may be switched off, or another."""
    for name in names:
        if hasattr(owner, name):
            layout.prop(owner, name)


register, unregister = bpy.utils.register_classes_factory(CLASSES)
