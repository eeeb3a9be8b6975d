# SPDX-License-Identifier: GPL-3.0-or-later
"""The engine's panels in the properties editor, and Blender's own that serve it too."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import bpy

from ..denoiser import ABSENT
from ..photon.stage.kinds import camera_kinds
from .engine import CAUSTICS, COMPONENTS, LIGHTING, OWN
from .export.camera import panorama_of
from .export.materials import DISPERSION_OF_ABBE
from .panel import ENGINE, EnginePanel
from .session import SESSION

MOST_ENTRIES = 50  # a longer report is for the JSON file
ICONS = {"exact": "CHECKMARK", "approximated": "INFO", "ignored": "CANCEL"}

# Panels of every engine that show what this one does not do.
EXCLUDED = {
    "DATA_PT_camera_stereoscopy",
    "DATA_PT_light",
    "DATA_PT_preview",
    "DATA_PT_spot",
    "MATERIAL_PT_freestyle_line",
    "NODE_DATA_PT_light",
    "RENDER_PT_freestyle",
    "RENDER_PT_gpencil",
    "RENDER_PT_grease_pencil_render",
    # Blender would put this above the engine's own; there is one below them instead.
    "RENDER_PT_simplify",
    "RENDER_PT_simplify_render",
    "RENDER_PT_simplify_viewport",
    "VIEWLAYER_PT_layer_passes",
}
# Panels of other engines that serve this one as they are.
INCLUDED = {
    "DATA_PT_camera_dof",
    "DATA_PT_camera_dof_aperture",
    "EEVEE_MATERIAL_PT_context_material",
    "EEVEE_MATERIAL_PT_displacement",
    "EEVEE_MATERIAL_PT_surface",
    "EEVEE_MATERIAL_PT_volume",
    "EEVEE_WORLD_PT_mist",
    "EEVEE_WORLD_PT_surface",
    "EEVEE_WORLD_PT_volume",
    "OBJECT_PT_shadow_terminator",
    "RENDER_PT_stereoscopy",  # to switch it off
    "VIEWLAYER_PT_filter",
}
LABELS = {"shadow_soft_size": {"text": "Radius"}}  # where Blender's own is another engine's
# What lights of each type have besides their power.
SIZES = {
    "POINT": ("shadow_soft_size",),
    "SPOT": ("shadow_soft_size",),
    "AREA": ("shape", "size", "spread"),
    "SUN": ("angle",),
}


class RENDER_PT_photon_stream_sampling(EnginePanel, bpy.types.Panel):
    bl_label = "Sampling"

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.split_layout()
        settings = context.scene.photon_stream
        switched(layout, settings, "noise_threshold", "Noise Threshold")
        col = layout.column(align=True)
        col.prop(settings, "passes")
        sub = col.column(align=True)
        sub.active = settings.use_noise_threshold
        sub.prop(settings, "min_passes")
        col.prop(settings, "time_limit")
        row = layout.row(align=True)
        row.prop(settings, "seed")
        row.prop(settings, "use_animated_seed", text="", icon="TIME")


class RENDER_PT_photon_stream_denoise(EnginePanel, bpy.types.Panel):
    bl_label = "Denoise"
    bl_parent_id = "RENDER_PT_photon_stream_sampling"
    bl_options = {"DEFAULT_CLOSED"}

    def draw_header(self, context: bpy.types.Context) -> None:
        self.layout.prop(context.scene.photon_stream, "denoise", text="")

    def draw(self, context: bpy.types.Context) -> None:
        col = self.layout.column(align=True)
        col.active = context.scene.photon_stream.denoise
        found = SESSION.has_denoiser
        col.label(text="OpenImageDenoise" if found else ABSENT, icon="NONE" if found else "ERROR")
        col.label(text="When the render is done, Combined alone")


class RENDER_PT_photon_stream_photons(EnginePanel, bpy.types.Panel):
    bl_label = "Photons"

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.split_layout()
        settings = context.scene.photon_stream
        switched(layout, settings, "photons", "Custom Photons")
        switched(layout, settings, "radius", "Custom Radius")
        layout.prop(settings, "radius_decay")
        layout.prop(settings, "filter")
        layout.prop(settings, "boundary_correction")


class RENDER_PT_photon_stream_light_paths(EnginePanel, bpy.types.Panel):
    bl_label = "Light Paths"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.split_layout()
        settings = context.scene.photon_stream
        layout.prop(settings, "photon_bounces")
        switched(layout, settings, "mirror_depth", "Custom Mirror Depth")
        layout.prop(settings, "specular_model")
        layout.column().prop(settings, "direct_by_photons")


class RENDER_PT_photon_stream_film(EnginePanel, bpy.types.Panel):
    bl_label = "Film"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.split_layout()
        cycles = getattr(context.scene, "cycles", None)  # whose settings it shares
        if cycles:
            layout.prop(cycles, "film_exposure")
        layout.prop(context.scene.render, "film_transparent", text="Transparent")
        if cycles:
            col = layout.column()
            col.prop(cycles, "pixel_filter_type")
            if cycles.pixel_filter_type != "BOX":
                col.prop(cycles, "filter_width", text="Width")


class RENDER_PT_photon_stream_motion_blur(EnginePanel, bpy.types.Panel):
    bl_label = "Motion Blur"
    bl_options = {"DEFAULT_CLOSED"}

    def draw_header(self, context: bpy.types.Context) -> None:
        self.layout.prop(context.scene.render, "use_motion_blur", text="")

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.split_layout()
        render, camera = context.scene.render, context.scene.camera
        layout.active = render.use_motion_blur
        col = layout.column()
        col.prop(render, "motion_blur_position", text="Position")
        col.prop(render, "motion_blur_shutter")
        steps = getattr(camera, "cycles", None)  # whose settings of the camera it shares
        if steps:
            row = layout.column(align=True, heading="Camera Steps").row(align=True)
            row.prop(steps, "use_motion_blur", text="")
            sub = row.row()
            sub.active = steps.use_motion_blur
            sub.prop(steps, "motion_steps", text="")
        layout.template_curve_mapping(render, "motion_blur_shutter_curve")


class RENDER_PT_photon_stream_performance(EnginePanel, bpy.types.Panel):
    bl_label = "Performance"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.split_layout()
        settings = context.scene.photon_stream
        col = layout.column()
        col.prop(settings, "backend")
        col.prop(settings, "device_index")
        col = layout.column()
        col.prop(settings, "estimator")
        sub = col.column()
        sub.active = settings.estimator != "GATHER"
        sub.prop(settings, "splat_shape")
        device = SESSION.info.get("device")  # of the last render
        if device:
            layout.label(text=str(device), icon="INFO")


class RENDER_PT_photon_stream_simplify(EnginePanel, bpy.types.Panel):
    bl_label = "Simplify"
    bl_options = {"DEFAULT_CLOSED"}

    def draw_header(self, context: bpy.types.Context) -> None:
        self.layout.prop(context.scene.render, "use_simplify", text="")

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.split_layout()
        render = context.scene.render
        layout.active = render.use_simplify
        col = layout.column(align=True)
        col.prop(render, "simplify_subdivision_render", text="Max Subdivision")
        col.prop(render, "simplify_child_particles_render", text="Max Child Particles")
        cycles = getattr(context.scene, "cycles", None)  # whose settings it shares
        if cycles:
            col.prop(cycles, "texture_limit_render", text="Texture Limit")


class RENDER_PT_photon_stream_report(EnginePanel, bpy.types.Panel):
    bl_label = "Scene Report"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.split_layout()
        report = SESSION.reports.get(context.scene.name)
        layout.prop(context.scene.photon_stream, "report_path")
        if report is None:
            layout.label(text="Render once to see what the scene uses", icon="INFO")
            return
        layout.label(text=report.summary)
        col = layout.column(align=True)
        for warning in report.warnings:
            col.label(text=warning, icon="ERROR")
        shown = [*report.of("ignored"), *report.of("approximated")]
        for entry in shown[:MOST_ENTRIES]:
            col.label(text=f"{entry.object}: {entry.feature}", icon=ICONS[entry.status])
            if entry.detail:
                col.label(text=entry.detail, icon="BLANK1")
        if len(shown) > MOST_ENTRIES:
            col.label(text=f"and {len(shown) - MOST_ENTRIES} more")


class VIEWLAYER_PT_photon_stream_passes(EnginePanel, bpy.types.Panel):
    bl_label = "Passes"
    bl_context = "view_layer"

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.split_layout()
        view_layer = context.view_layer
        col = layout.column(heading="Data", align=True)
        col.prop(view_layer, "use_pass_z", text="Depth")
        col.prop(view_layer, "use_pass_mist")
        col.prop(view_layer, "use_pass_normal")
        col.prop(view_layer.photon_stream, "use_pass_error")
        col.prop(view_layer.photon_stream, "denoising_store_passes")
        col = layout.column(heading="Light", align=True)
        for flag in COMPONENTS | CAUSTICS:
            col.prop(view_layer.photon_stream, flag)
        for flag, entry in OWN.items():  # parts of Combined by two names
            if entry.shows not in ("", entry.name):
                col.prop(view_layer, flag, text=f"{entry.image} as {entry.name}")
        col = layout.column(heading="Lighting", align=True)
        for flag in LIGHTING:
            col.prop(view_layer.photon_stream, flag)


class MATERIAL_PT_photon_stream_dispersion(EnginePanel, bpy.types.Panel):
    bl_label = "Dispersion"
    bl_context = "material"
    subject = "material"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.split_layout()
        settings = context.material.photon_stream
        layout.prop(settings, "dispersion")
        if settings.dispersion > 0.0:
            abbe = DISPERSION_OF_ABBE / settings.dispersion
            layout.label(text=f"Abbe number {abbe:.4g}", icon="INFO")


class MATERIAL_PT_photon_stream_settings(EnginePanel, bpy.types.Panel):
    bl_label = "Settings"
    bl_context = "material"
    subject = "material"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.split_layout()
        layout.prop(context.material, "displacement_method", text="Displacement")
        layout.prop(context.material, "use_transparent_shadow")


class DATA_PT_photon_stream_panorama(EnginePanel, bpy.types.Panel):
    bl_label = "Panorama"
    bl_context = "data"
    subject = "camera"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return super().poll(context) and context.camera.type == "PANO"

    def draw(self, context: bpy.types.Context) -> None:
        col = self.split_layout().column()
        properties = panorama_of(context.camera)
        col.prop(properties, "panorama_type")
        kind = camera_kinds().get(properties.panorama_type.lower())
        if kind is None:
            col.label(text="Photon Stream does not render this kind", icon="ERROR")
        for name in kind.parameters if kind else ():
            if not name.startswith("sensor_"):  # the sensor's, as the camera's panel has it
                col.prop(properties, name)


class DATA_PT_photon_stream_light(EnginePanel, bpy.types.Panel):
    bl_label = "Light"
    bl_context = "data"
    subject = "light"

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        light = context.light
        layout.row().prop(light, "type", expand=True)
        layout.use_property_split = True
        col = layout.column()
        if hasattr(light, "use_temperature"):  # Blender 4.5 on
            row = col.column(align=True, heading="Temperature").row(align=True)
            row.prop(light, "use_temperature", text="")
            sub = row.row()
            sub.active = light.use_temperature
            sub.prop(light, "temperature", text="")
        col.prop(light, "color")
        col = layout.column()
        col.prop(light, "energy")
        for name in ("exposure", "normalize"):
            if hasattr(light, name):
                col.prop(light, name)
        for name in SIZES[light.type]:
            layout.prop(light, name, **LABELS.get(name, {}))
        if light.type == "AREA" and light.shape in {"RECTANGLE", "ELLIPSE"}:
            layout.prop(light, "size_y")


class DATA_PT_photon_stream_spot(EnginePanel, bpy.types.Panel):
    bl_label = "Beam Shape"
    bl_context = "data"
    subject = "light"
    bl_parent_id = "DATA_PT_photon_stream_light"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return super().poll(context) and context.light.type == "SPOT"

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.split_layout()
        light = context.light
        layout.prop(light, "spot_size", text="Angle")
        layout.prop(light, "spot_blend", text="Blend", slider=True)
        layout.prop(light, "show_cone")


CLASSES = (
    RENDER_PT_photon_stream_sampling,
    RENDER_PT_photon_stream_denoise,
    RENDER_PT_photon_stream_photons,
    RENDER_PT_photon_stream_light_paths,
    RENDER_PT_photon_stream_film,
    RENDER_PT_photon_stream_motion_blur,
    RENDER_PT_photon_stream_performance,
    RENDER_PT_photon_stream_simplify,
    RENDER_PT_photon_stream_report,
    VIEWLAYER_PT_photon_stream_passes,
    MATERIAL_PT_photon_stream_dispersion,
    MATERIAL_PT_photon_stream_settings,
    DATA_PT_photon_stream_panorama,
    DATA_PT_photon_stream_light,
    DATA_PT_photon_stream_spot,
)


def switched(layout: bpy.types.UILayout, settings: Any, name: str, title: str) -> None:
    """Draw the property `name` behind the checkbox `use_<name>`, as Blender's panels do."""
    row = layout.column(align=True, heading=title).row(align=True)
    row.prop(settings, f"use_{name}", text="")
    sub = row.row()
    sub.active = getattr(settings, f"use_{name}")
    sub.prop(settings, name, text="")


def shared_panels() -> Iterator[Any]:
    """Yield Blender's panels that are of use to this engine."""
    waiting = list(bpy.types.Panel.__subclasses__())
    while waiting:
        panel = waiting.pop()
        waiting += panel.__subclasses__()
        name, engines = panel.__name__, getattr(panel, "COMPAT_ENGINES", ())
        freestyle = name.startswith("VIEWLAYER_PT_freestyle")
        general = "BLENDER_RENDER" in engines and name not in EXCLUDED and not freestyle
        if general or (name in INCLUDED and engines):
            yield panel


def register() -> None:
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    for panel in shared_panels():
        panel.COMPAT_ENGINES.add(ENGINE)


def unregister() -> None:
    for panel in shared_panels():
        panel.COMPAT_ENGINES.discard(ENGINE)
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
