# SPDX-License-Identifier: GPL-3.0-or-later
"""Panels of which rays meet objects, of shadow catchers, and of light groups."""

from __future__ import annotations

import bl_ui.properties_view_layer as view_layer_panels
import bpy

from ..photon.scene import RAYS
from .panel import EnginePanel

# What may find lamps.
LIGHT_RAYS = ("camera", "diffuse", "glossy", "transmission", "volume_scatter")
# Blender's own list of light groups, by either of its names.
_NAMES = ("ViewLayerLightgroupsPanelHelper", "ViewLayerLightgroupsPanel")
_Groups = next(x for x in (getattr(view_layer_panels, y, None) for y in _NAMES) if x)


class OBJECT_PT_photon_stream_rays(EnginePanel, bpy.types.Panel):
    bl_label = "Rays and Light Group"
    bl_context = "object"
    subject = "object"

    def draw(self, context: bpy.types.Context) -> None:
        obj = context.object
        layout = self.split_layout()
        column = layout.column(heading="Visible to", align=True)
        for ray in LIGHT_RAYS if obj.type == "LIGHT" else RAYS:
            column.prop(obj, f"visible_{ray}", text=ray.capitalize().replace("_", " "))
        if obj.type != "LIGHT":
            layout.prop(obj, "is_shadow_catcher")
        _draw_group(layout, obj, context.view_layer)


class WORLD_PT_photon_stream_group(EnginePanel, bpy.types.Panel):
    bl_label = "Light Group"
    bl_context = "world"
    subject = "world"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        _draw_group(self.split_layout(), context.world, context.view_layer)


class VIEWLAYER_PT_photon_stream_groups(EnginePanel, _Groups, bpy.types.Panel):
    bl_label = "Light Groups"
    bl_context = "view_layer"
    bl_parent_id = "VIEWLAYER_PT_photon_stream_passes"


CLASSES = (
    OBJECT_PT_photon_stream_rays,
    WORLD_PT_photon_stream_group,
    VIEWLAYER_PT_photon_stream_groups,
)


def _draw_group(
    layout: bpy.types.UILayout,
    owner: bpy.types.Object | bpy.types.World,
    view_layer: bpy.types.ViewLayer,
) -> None:
    layout.prop_search(
        owner,
        "lightgroup",
        view_layer,
        "lightgroups",
        text="Light Group",
        results_are_suggestions=True,
    )


register, unregister = bpy.utils.register_classes_factory(CLASSES)
