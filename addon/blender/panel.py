# SPDX-License-Identifier: GPL-3.0-or-later
"""What the engine's panels in the properties editor have in common."""

from __future__ import annotations

import bpy

from .engine import PhotonStreamEngine

ENGINE = PhotonStreamEngine.bl_idname


class EnginePanel:
    """A panel that is shown for this engine, where the context has what it is about."""

    layout: bpy.types.UILayout
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"
    COMPAT_ENGINES = {ENGINE}
    subject = "scene"  # a member of the context

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.engine in cls.COMPAT_ENGINES and getattr(context, cls.subject) is not None

    def split_layout(self) -> bpy.types.UILayout:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        return layout
