# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes that give numbers, colours and vectors: a reader a kind, found by Blender's node type."""

from __future__ import annotations

import bpy

from ....photon.scene import RGB
from ..graph import Context, Graph, Reader, resolved
from ..report import Notes
from . import (
    attributes,
    brick,
    checker,
    colours,
    constants,
    curves,
    gabor,
    geometry,
    gradient,
    image_texture,
    magic,
    mapping,
    maths,
    mixes,
    noise,
    normals,
    objects,
    ranges,
    spectra,
    unknown,
    vectors,
    views,
    voronoi,
    wave,
    white_noise,
)

READERS: dict[str, Reader] = {
    "AMBIENT_OCCLUSION": unknown.read_occlusion,
    "ATTRIBUTE": attributes.read_attribute,
    "BEVEL": unknown.read_bevel,
    "BLACKBODY": spectra.read_blackbody,
    "BRIGHTCONTRAST": colours.read_contrast,
    "BUMP": normals.read_bump,
    "CAMERA": views.read_camera,
    "CLAMP": ranges.read_clamp,
    "COMBINE_COLOR": colours.read_combine,
    "COMBXYZ": vectors.read_combine,
    "CURVE_FLOAT": curves.read_float_curve,
    "CURVE_RGB": curves.read_curves,
    "CURVE_VEC": curves.read_curves,
    "DISPLACEMENT": normals.read_displacement,
    "FRESNEL": views.read_fresnel,
    "GAMMA": colours.read_gamma,
    "HAIR_INFO": objects.read_strand,
    "HUE_SAT": colours.read_hue_saturation,
    "INPUT_BOOL": constants.read_typed,
    "INPUT_INT": constants.read_typed,
    "INPUT_VECTOR": constants.read_typed,
    "INVERT": colours.read_invert,
    "LAYER_WEIGHT": views.read_layer_weight,
    "LIGHT_FALLOFF": views.read_light_falloff,
    "LIGHT_PATH": views.read_light_path,
    "MAPPING": mapping.read_mapping,
    "MAP_RANGE": ranges.read_map_range,
    "MATH": maths.read,
    "MIX": mixes.read,
    "MIX_RGB": mixes.read_old,
    "NEW_GEOMETRY": attributes.read_geometry,
    "NORMAL": mapping.read_normal,
    "NodeImplicitConversion": constants.read_conversion,
    "NORMAL_MAP": normals.read_normal_map,
    "OBJECT_INFO": objects.read_info,
    "PARTICLE_INFO": objects.read_particle,
    "POINT_INFO": objects.read_strand,
    "RGB": constants.read,
    "RGBTOBW": colours.read_grey,
    "SCRIPT": unknown.read_script,
    "SEPARATE_COLOR": colours.read_separate,
    "SEPXYZ": vectors.read_separate,
    "TANGENT": attributes.read_tangent,
    "TEX_BRICK": brick.read,
    "TEX_CHECKER": checker.read,
    "TEX_COORD": attributes.read_coordinate,
    "TEX_ENVIRONMENT": image_texture.read_environment,
    "TEX_GABOR": gabor.read,
    "TEX_GRADIENT": gradient.read,
    "TEX_IMAGE": image_texture.read,
    "TEX_MAGIC": magic.read,
    "TEX_NOISE": noise.read,
    "TEX_VORONOI": voronoi.read,
    "TEX_WAVE": wave.read,
    "TEX_WHITE_NOISE": white_noise.read,
    "UVMAP": attributes.read_uv_map,
    "VALTORGB": curves.read_ramp,
    "VALUE": constants.read,
    "VECTOR_DISPLACEMENT": normals.read_vector_displacement,
    "VECTOR_ROTATE": mapping.read_rotate,
    "VECT_MATH": vectors.read_math,
    "VECT_TRANSFORM": mapping.read_transform,
    "VERTEX_COLOR": attributes.read_colour,
    "VOLUME_INFO": objects.read_nothing,
    "WAVELENGTH": spectra.read_wavelength,
    "WIREFRAME": geometry.read_wireframe,
}


def graph_of(
    whose: bpy.types.Material | bpy.types.World | bpy.types.Light,
    owner: str,
    notes: Notes,
    averages: dict[str, RGB | None] | None = None,
    context: Context | None = None,
) -> Graph:
    """The nodes of a material, a world or a light with all readers."""
    tree, holder = resolved(whose)
    averages = {} if averages is None else averages
    return Graph(tree, owner, notes, READERS, averages, context or Context(), holder=holder)
