# SPDX-License-Identifier: GPL-3.0-or-later
"""The settings of scenes, view layers and materials as Blender properties."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.app.handlers import persistent
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from ..photon.settings import FEWEST_PASSES, Settings

DEFAULTS = Settings()

# The numbers are what .blend files store: never renumber, only add.
ESTIMATORS = (
    ("AUTO", "Automatic", "Gather, which was the faster one wherever it was measured", 0),
    ("SPLAT", "Splat", "Draw each photon as a small disc over the visible points", 1),
    ("GATHER", "Gather", "Let each visible point look for the photons around it", 2),
)
BACKENDS = (
    (
        "AUTO",
        "Automatic",
        "Compute on GPUs, fragment on old ones, native where there is none",
        0,
    ),
    ("FRAGMENT", "Fragment", "Kernels run as fragment programs; works with any OpenGL 3.3", 1),
    ("COMPUTE", "Compute", "Kernels run as compute programs; needs OpenGL 4.3", 2),
    ("NATIVE", "Native", "The processor traces and gathers; the rest is fragment programs", 3),
)
FILTERS = (
    ("CONSTANT", "Constant", "All photons within the radius count the same", 0),
    ("CONE", "Cone", "Photons count less in proportion to their distance", 1),
    ("GAUSSIAN", "Gaussian", "Photons count less along a bell curve", 2),
    ("EPANECHNIKOV", "Epanechnikov", "Photons count less with the square of their distance", 3),
)
SPECULAR_MODELS = (
    ("GGX", "GGX", "Microfacets as Cycles has them", 0),
    ("PHONG", "Phong", "The lobes of the paper that Photon Stream implements", 1),
)
SPLAT_SHAPES = (
    ("TRIANGLE", "Triangle", "One triangle around the disc", 0),
    ("QUAD", "Quad", "Two triangles around the disc", 1),
    ("POINT", "Point", "A point sprite around the disc", 2),
)


class PhotonStreamSettings(bpy.types.PropertyGroup):
    """Settings of a scene, at `scene.photon_stream`."""

    passes: IntProperty(
        name="Max Passes",
        description="Most passes; each adds one eye ray a pixel and new photons",
        min=1,
        soft_max=4096,
        max=1 << 24,
        default=DEFAULTS.passes,
    )
    use_noise_threshold: BoolProperty(
        name="Noise Threshold",
        description="Finish when the picture's estimated error is small enough",
        default=False,
    )
    noise_threshold: FloatProperty(
        name="Noise Threshold",
        description=(
            "Estimated error, of noise and of the radius together, at which to finish: root mean "
            "square over the pixels, relative to their brightness"
        ),
        min=0.0,
        soft_min=0.001,
        soft_max=0.2,
        max=1.0,
        default=0.01,
        precision=4,
        step=0.1,
    )
    min_passes: IntProperty(
        name="Min Passes",
        description="Passes before the Noise Threshold may finish the render",
        min=FEWEST_PASSES,
        soft_max=4096,
        max=1 << 24,
        default=DEFAULTS.min_passes,
    )
    time_limit: FloatProperty(
        name="Time Limit",
        description="Finish after this time, even with passes left; 0 renders all passes",
        min=0.0,
        default=DEFAULTS.time_limit,
        step=100.0,
        unit="TIME_ABSOLUTE",
    )
    seed: IntProperty(
        name="Seed",
        description="Another seed gives another noise pattern; the same one the same picture",
        min=0,
        default=DEFAULTS.seed,
    )
    use_animated_seed: BoolProperty(
        name="Use Animated Seed",
        description="Use another seed on every frame, so that the noise of an animation moves",
        default=False,
    )
    denoise: BoolProperty(
        name="Denoise",
        description="Take noise out of Combined when the render is done, by OpenImageDenoise: in "
        "each part of the picture as much as its passes tell that it gains. Broad glossy surfaces "
        "that are seen send rays then, which leaves noise instead of blotches; other passes are "
        "not denoised",
        default=DEFAULTS.denoise,
    )
    use_photons: BoolProperty(
        name="Custom Photons",
        description="Set the photons of a pass by hand; otherwise there are three for each pixel",
        default=False,
    )
    photons: IntProperty(
        name="Photons",
        description="Photons that all lights together emit in a pass",
        min=0,
        soft_min=1024,
        soft_max=1 << 22,
        max=1 << 24,
        default=1 << 18,
    )
    use_radius: BoolProperty(
        name="Custom Radius",
        description="Set the radius by hand; otherwise it follows from the photons' density",
        default=False,
    )
    radius: FloatProperty(
        name="Radius",
        description=(
            "Distance up to which photons of the first pass count for a point: smaller is sharper "
            "and noisier"
        ),
        subtype="DISTANCE",
        min=0.0,
        soft_min=0.001,
        soft_max=10.0,
        precision=4,
        default=0.1,
    )
    radius_decay: FloatProperty(
        name="Radius Decay",
        description=(
            "How slowly the radius shrinks from pass to pass: 1 keeps it, less removes the blur "
            "sooner and leaves more noise"
        ),
        subtype="FACTOR",
        min=0.01,
        max=1.0,
        default=DEFAULTS.radius_decay,
    )
    specular_model: EnumProperty(
        name="Specular Model",
        description="What glossy, metallic and Principled shaders reflect with",
        items=SPECULAR_MODELS,
        default="GGX",
    )
    filter: EnumProperty(
        name="Filter",
        description="How a photon's weight falls off with its distance",
        items=FILTERS,
        default=DEFAULTS.filter.upper(),
    )
    photon_bounces: IntProperty(
        name="Photon Bounces",
        description="Most times that a photon is scattered; few paths get this far",
        min=1,
        soft_max=128,
        max=1024,
        default=DEFAULTS.photon_bounces,
    )
    use_mirror_depth: BoolProperty(
        name="Custom Mirror Depth",
        description="Set the mirror depth by hand; otherwise it is Cycles' Max Bounces",
        default=False,
    )
    mirror_depth: IntProperty(
        name="Mirror Depth",
        description="Most reflections that are followed from the camera; 0 turns mirrors off",
        min=0,
        soft_max=64,
        max=1024,
        default=DEFAULTS.mirror_depth,
    )
    boundary_correction: BoolProperty(
        name="Boundary Correction",
        description="Correct the dark seams that density estimation leaves at edges and corners, "
        "and the light that leaks below what stands on a surface",
        default=DEFAULTS.boundary_correction,
    )
    direct_by_photons: BoolProperty(
        name="Direct Light by Photons",
        description="Estimate direct light from photons too, instead of shadow rays: much noisier",
        default=DEFAULTS.direct_by_photons,
    )
    estimator: EnumProperty(
        name="Estimator",
        description="How photons are summed up; the picture is the same, the time is not",
        items=ESTIMATORS,
        default=DEFAULTS.estimator.upper(),
    )
    splat_shape: EnumProperty(
        name="Splat Shape",
        description="What is drawn for a photon by the Splat estimator",
        items=SPLAT_SHAPES,
        default=DEFAULTS.splat_shape.upper(),
    )
    backend: EnumProperty(
        name="Backend",
        description="Who runs the kernels; the picture is the same, the time is not",
        items=BACKENDS,
        default=DEFAULTS.backend.upper(),
    )
    device_index: IntProperty(
        name="Device",
        description="Number of the OpenGL device, for machines with several",
        min=0,
        soft_max=7,
        max=255,
        default=DEFAULTS.device_index,
    )
    report_path: StringProperty(
        name="Report File",
        description="Where the scene report is written as JSON after a render; empty for nowhere",
        subtype="FILE_PATH",
    )


class PhotonStreamViewLayer(bpy.types.PropertyGroup):
    """Passes of a view layer besides Blender's own, at `view_layer.photon_stream`."""

    use_pass_direct: BoolProperty(
        name="Direct", description="Light that comes straight from the lights", default=True
    )
    use_pass_indirect: BoolProperty(
        name="Indirect", description="Light that was scattered before, from photons", default=True
    )
    use_pass_mirror: BoolProperty(
        name="Mirror",
        description="What mirrors and glossy surfaces reflect, and what comes from below surfaces",
        default=True,
    )
    use_pass_emission: BoolProperty(
        name="Emission", description="Lights that are seen themselves", default=True
    )
    use_pass_background: BoolProperty(
        name="Background", description="The world where no surface is in front", default=True
    )
    use_pass_caustics: BoolProperty(
        name="Caustics",
        description="The part of Indirect and Mirror that has come by way of glass, metal or gloss",
        default=False,
    )
    use_pass_illuminance: BoolProperty(
        name="Illuminance",
        description="Light that falls on diffuse surfaces [lx], whatever they reflect",
        default=False,
    )
    use_pass_illuminance_view: BoolProperty(
        name="Illuminance View",
        description="Illuminance in false colours, with iso-lines and a legend in lux; "
        "for the view transform Standard",
        default=False,
    )
    denoising_store_passes: BoolProperty(
        name="Denoising Data",
        description="Albedo and normal of what is seen, in mirrors and clear glass too: for "
        "Blender's Denoise node",
        default=False,
    )
    use_pass_error: BoolProperty(
        name="Error",
        description="Estimated error of each pixel, of noise and of the radius together",
        default=True,
    )


class PhotonStreamMaterial(bpy.types.PropertyGroup):
    """What Blender's shaders don't have, at `material.photon_stream`."""

    dispersion: FloatProperty(
        name="Dispersion",
        description=(
            "How differently glass bends the colours: 20 over the Abbe number, as in glTF. Crown "
            "glass 0.31, flint 0.55, diamond 0.36; 0 is none. The IOR is that of yellow light"
        ),
        min=0.0,
        soft_max=1.0,
        max=5.0,
        default=0.0,
        precision=3,
        step=1.0,
    )


CLASSES = (PhotonStreamSettings, PhotonStreamViewLayer, PhotonStreamMaterial)
RENAMED = {"radius_shrink": "radius_decay", "layer": "backend"}  # properties of older files


@persistent
def rename_old(_file: str = "") -> None:
    """Keep what older files say under another name."""
    for scene in bpy.data.scenes:
        settings = scene.photon_stream
        stored = settings  # before Blender 5
        if hasattr(settings, "bl_system_properties_get"):
            stored = settings.bl_system_properties_get() or {}
        for old, new in RENAMED.items():
            if old in stored and not settings.is_property_set(new):
                setattr(settings, new, _named(settings, new, stored[old]))
                del stored[old]
        if "mirror_depth" in stored and not settings.is_property_set("use_mirror_depth"):
            settings.use_mirror_depth = True  # files before there was the switch


def _named(settings: PhotonStreamSettings, name: str, value: Any) -> Any:
    """What a property is set to: of an enumeration the item of a number."""
    items = getattr(settings.bl_rna.properties[name], "enum_items", ())
    return next((item.identifier for item in items if item.value == value), value)


def register() -> None:
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Scene.photon_stream = bpy.props.PointerProperty(type=PhotonStreamSettings)
    bpy.types.ViewLayer.photon_stream = bpy.props.PointerProperty(type=PhotonStreamViewLayer)
    bpy.types.Material.photon_stream = bpy.props.PointerProperty(type=PhotonStreamMaterial)
    bpy.app.handlers.load_post.append(rename_old)


def unregister() -> None:
    bpy.app.handlers.load_post.remove(rename_old)
    del bpy.types.Material.photon_stream
    del bpy.types.ViewLayer.photon_stream
    del bpy.types.Scene.photon_stream
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
