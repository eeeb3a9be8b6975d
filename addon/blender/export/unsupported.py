# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of the scene, view layers, objects and materials that Cycles heeds and we do not: each
is reported."""

from __future__ import annotations

import bpy

from .dicing import adaptive
from .report import Notes

# Of Blender's, those that are rendered.
PASSES = {"use_pass_combined", "use_pass_z", "use_pass_mist", "use_pass_normal"}
PASSES |= {"use_pass_emit", "use_pass_environment"}
NO_PASSES = {"use_pass_cryptomatte_accurate"}
# Cycles' bounces that new files have, by what is called so.
BOUNCES = {
    "max_bounces": ("Max Bounces", 12),
    "diffuse_bounces": ("Diffuse Bounces", 4),
    "glossy_bounces": ("Glossy Bounces", 4),
    "transmission_bounces": ("Transmission Bounces", 12),
}


def note_scene(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer, notes: Notes) -> None:
    """Write down scene-wide features that are not simulated."""
    name, cycles = f"Scene '{scene.name}'", getattr(scene, "cycles", None)
    rolling = getattr(cycles, "rolling_shutter_type", "NONE") != "NONE"
    if scene.render.use_motion_blur and view_layer.use_motion_blur and rolling:
        notes.ignored(name, "Rolling Shutter", "all rows are exposed at once")
    if getattr(getattr(scene, "eevee", None), "use_overscan", False):
        notes.ignored(name, "Overscan", "it is EEVEE's")
    if scene.render.use_freestyle and view_layer.use_freestyle:
        notes.ignored(name, "Freestyle", "no lines are drawn")
    for setting, (label, usual) in BOUNCES.items():
        most = getattr(cycles, setting, usual)
        if most < usual:
            what = f"photons bounce on after {most}, as often as Photon Bounces says"
            notes.ignored(name, label, what)
    if getattr(cycles, "use_fast_gi", False):
        notes.ignored(name, "Fast GI Approximation", "light bounces as it does")
    if scene.render.film_transparent and getattr(cycles, "film_transparent_glass", False):
        notes.ignored(name, "Transparent Glass", "the world behind glass is opaque")
    if scene.render.use_simplify:
        for setting, label in (
            ("use_camera_cull", "Camera Cull"),
            ("use_distance_cull", "Distance Cull"),
        ):
            if getattr(cycles, setting, False):
                notes.ignored(name, label, "objects that it would leave out are rendered")
    _note_passes(scene, view_layer, notes)


def _note_passes(scene: bpy.types.Scene, layer: bpy.types.ViewLayer, notes: Notes) -> None:
    """Of passes that a layer's files or compositor would have."""
    asked = [
        entry.name
        for owner in (layer, getattr(layer, "cycles", None))
        for entry in (owner.bl_rna.properties if owner else ())
        if entry.identifier.startswith("use_pass_")
        and entry.identifier not in PASSES | NO_PASSES
        and getattr(owner, entry.identifier)
    ]
    if asked:
        what = f"{', '.join(asked)}: not rendered, so what composites them has none"
        notes.ignored(f"View Layer '{layer.name}'", "Passes", what)
    for flag, label in (("use_pass_emit", "Emission"), ("use_pass_environment", "Environment")):
        if getattr(layer, flag):
            what = "what transparent surfaces show is in Mirror"
            notes.approximated(f"View Layer '{layer.name}'", f"Pass {label}", what)
    if layer.use_pass_environment and scene.render.film_transparent:
        what = "empty, for the film is transparent"
        notes.ignored(f"View Layer '{layer.name}'", "Pass Environment", what)
    if stores_denoising_data(layer) and scene.photon_stream.denoise:
        what = "denoised already, as Combined is"
        notes.approximated(f"View Layer '{layer.name}'", "Pass Noisy Image", what)
    if layer.samples > 0:
        what = "as many passes are rendered as of other view layers"
        notes.ignored(f"View Layer '{layer.name}'", "Samples", what)
    if layer.aovs:
        names = ", ".join(entry.name for entry in layer.aovs)
        notes.ignored(f"View Layer '{layer.name}'", "Shader AOVs", f"{names}: not rendered")


def stores_denoising_data(layer: bpy.types.ViewLayer) -> bool:
    """Whether Cycles' Denoising Data are asked for."""
    return bool(getattr(getattr(layer, "cycles", None), "denoising_store_passes", False))


def note_object(obj: bpy.types.Object, name: str, notes: Notes) -> None:
    """Write down what an object's settings ask for in vain."""
    for owner in (obj, getattr(obj, "cycles", None)):  # Cycles' before Blender 4
        if getattr(owner, "shadow_terminator_shading_offset", 0.0) > 0.0:
            what = "light falls on smooth normals as they are"
            notes.ignored(name, "Shadow Terminator Shading Offset", what)
    modifier = adaptive(obj)
    if modifier:
        what = f"subdivided {modifier.render_levels} times; what nodes displace as small as asked"
        notes.approximated(name, "Adaptive Subdivision", f"{what}, everywhere alike")


def note_material(material: bpy.types.Material, owner: str, notes: Notes) -> None:
    """Write down what a material's settings ask for in vain."""
    if not getattr(getattr(material, "cycles", None), "use_bump_map_correction", True):
        notes.ignored(owner, "Bump Map Correction", "bumps hide what is behind the surface")
