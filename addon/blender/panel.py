# SPDX-License-Identifier: GPL-3.0-or-later
"""What the engine's panels in the properties editor have in common."""

from __future__ import annotations

import bpy

from .engine import PhotonStreamEngine

ENGINE = PhotonStreamEngine.bl_idname


class EnginePanel:
    """A panel that is shown for this engine."""

    layout: bpy.types.UILayout
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"
    COMPAT_ENGINES = {ENGINE}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.engine in cls.COMPAT_ENGINES

    def split_layout(self) -> bpy.types.UILayout:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        return layout
