# SPDX-License-Identifier: GPL-3.0-or-later
"""What one element of each stream and table holds. Lengths in scene units (see geometry.py)."""

from collections.abc import Mapping

import photon_stream_native as native

from ...streams import Record

# Streams of rays and of photons under way.
# `source`: the triangle that it leaves, or -1; of a photon from a light -1 less its number.
RAY_ORIGIN = Record("RayOrigin", {"position": "vec3", "source": "float"})
# Unit; zero: no ray. `t_max` [scene units], of photons a code: photon_ray.glsl.
RAY_DIRECTION = Record("RayDirection", {"direction": "vec3", "t_max": "float"})
HIT = Record("Hit", {"t": "float", "triangle": "float", "u": "float", "v": "float"})  # number + 1
FLUX = Record(
    "Flux", {"flux": "vec3", "photon": "float"}
)  # [W], linear RGB, >= 0; photon_number.glsl
# Which media a ray is in where it begins (lib/media.glsl), and how often media have scattered it. A
# photon straight from its light has -1: what scatters it first counts for none. `sent`:
# lib/pane.glsl; 0 but of photons.
MEDIUM = Record("Medium", {"inside": "vec2", "scattered": "float", "sent": "float"})
PIXEL = Record("Pixel", {"at": "vec2"})  # of the frame, that a path is of
# Of a chain of secondary rays; the density with which a lobe sent its last one [1/sr], 0 for a
# delta lobe, as lib/chain_density.glsl has it.
THROUGHPUT = Record("Throughput", {"throughput": "vec3", "density": "float"})

# Of a chain where there are transparent surfaces: how often lobes have scattered it, 0 of the eye's
# own rays, and how many transparent surfaces it has passed; since it was last scattered, how far
# it has come [scene units], and the triangle where that was.
CHAIN = Record(
    "Chain", {"bounces": "float", "passed": "float", "distance": "float", "source": "float"}
)

# Streams of shaded points: where rays end, and the BSDF there.
PLACE = Record("Place", {"position": "vec3", "surface": "float"})  # and its side; lib/place.glsl
# Geometric normal, unit, on the ray's side; which side that is: 1 outside, -1 inside.
FACING = Record("Facing", {"normal": "vec3", "side": "float"})
SHADING = Record("Shading", {"normal": "vec3", "triangle": "float"})  # unit, on the ray's side
DIFFUSE = Record("Diffuse", {"albedo": "vec3", "flags": "float"})  # Lambert's lobe; diffuse.glsl
# Another lobe: glsl/bsdf has a file for each kind, which says what colour and parameters are.
LOBE = Record("Lobe", {"colour": "vec3", "kind": "float"})  # kind 0: no lobe
SHAPE = Record("Shape", {"parameters": "vec3", "weight": "float"})  # weight: see lobe_weight.glsl

# What the walk of a ray depends on that goes below a surface (lib/packed_walk.glsl); goes 0: of one
# that does not.
WALK = Record("Walk", {"numbers": "vec3", "goes": "float"})

WAY = Record("Way", {"way": "vec3", "none": "float"})  # by which a surface moves [m]

# Streams of light.
RADIANCE = Record("Radiance", {"radiance": "vec3", "alpha": "float"})  # [W/(m^2 sr)]
# [W/m^2]; `inner` is the channels' mean within the inner radius (density.glsl)
IRRADIANCE = Record("Irradiance", {"irradiance": "vec3", "inner": "float"})
ILLUMINANCE = Record("Illuminance", {"lux": "float"})
# What the eye sees of illuminance: by shadow rays and by photons, uncorrected [lx]; the share of
# the picture that shows diffuse surfaces, without and with the coverage there.
ILLUMINANCE_SEEN = Record(
    "IlluminanceSeen",
    {"direct": "float", "indirect": "float", "there": "float", "covered": "float"},
)
# What lobes that gather send on to the viewer of the photons about a point [W/(m^2 sr)]; `inner` as
# of irradiance.
GLOSS = Record("Gloss", {"radiance": "vec3", "inner": "float"})
# The normal of those lobes, and their mean albedo towards the viewer; 0: none gathers.
GATHERED = Record("Gathered", {"normal": "vec3", "albedo": "float"})
# [W], with DIRECTIONS that to the light in its last bits (packing.glsl); geometric normal, packed.
# Where deposits are numbered, flux is the channels' sum [W]; the photon's number, below 2^23, plus
# a half before it has bounced; and 0.
DEPOSIT = Record("Deposit", {"flux": "vec3", "normal": "float"})
GATHER_RADIUS = Record("GatherRadius", {"radius": "float"})  # [scene units]
# Half planes that end a visible point's disc (lib/cuts.glsl) [1 / scene units]; zero: no cut
CUTS = Record("Cuts", {"first": "vec2", "second": "vec2"})
# Share of the filter, and of the inner one, on its own surface, over what is expected: about 1;
# what scales either, over the same.
COVERAGE = Record(
    "Coverage",
    {"share": "float", "inner": "float", "scale": "float", "inner_scale": "float"},
)
# How the filter, and the inner one, are tilted where they are cut (lib/cuts.glsl) [1 / scene units]
TILT = Record("Tilt", {"outer": "vec2", "inner": "vec2"})
# Indirect light within the inner radius, and what the radius adds to it: means of the channels
# [W/(m^2 sr)], uncorrected. Coverage's inner share, weighted as the light is.
BLUR = Record("Blur", {"inner": "float", "inner_share": "float", "difference": "float"})
# Of a pixel's background, by what a secondary ray met: how much less opaque it is.
LOST = Record("Lost", {"share": "float"})
SUM = Record("Sum", {"value": "vec4"})

# Tables.
# A triangle's corners, in the order of the tree's leaves; its number in the scene.
TRIANGLE = Record(
    "Triangle",
    {
        "a": "vec3",
        "material": "float",
        "b": "vec3",
        "surface": "float",
        "c": "vec3",
        "number": "float",
    },
)
# Of its shading, the longest unit; zero: the triangle's own. Scene.terminators of its surface.
# Flags of its material: lib/triangle.glsl.
CORNER_NORMALS = Record(
    "CornerNormals",
    {
        "a": "vec3",
        "terminator": "float",
        "b": "vec3",
        "c": "vec3",
        "flags": "float",
    },
)
# The fourth corner of the quad that a triangle makes with another in its plane, and 16 f +
# 32 b + 4 d + 1 + s. s: 1 where its front is outside of a solid, -1 where its back is, else 0; d: 1
# plus the number of the edge that is the quad's diagonal, 0 where there is no quad; f, b: 1 where
# something lies on the front and the back of either; native/src/faces.rs.
FACE = Record("Face", {"fourth": "vec3", "code": "float"})
# Which lobes that are no bodies of revolution turn with, of any length; zero: none.
CORNER_TANGENTS = Record("CornerTangents", {"a": "vec3", "b": "vec3", "c": "vec3"})
# Both children's boxes. A count of 0: `first` is a node, or below 0 none; else a leaf of triangles.
NODE = Record(
    "Node",
    {
        "left_low": "vec3",
        "left_first": "float",
        "left_high": "vec3",
        "left_count": "float",
        "right_low": "vec3",
        "right_first": "float",
        "right_high": "vec3",
        "right_count": "float",
    },
)
# Lambert's albedo that no lobe covers; which elements of the table of lobes are the material's;
# holdout 1: the eye sees nothing there; the radiance of both its sides [W/(m^2 sr)]; which
# instructions are its program, and codes of results that stand for a value (lib/program.glsl);
# two_sided 1: a rough lobe lets light through from behind; what shadow rays keep that pass it;
# which INTERIOR is inside it, plus one, or 0; the index of clear glass (pane_of in stage/panes.py),
# or 0, and its colour; shades_lamps 1: what is transparent of it stops light straight from lamps.
MATERIAL = Record(
    "Material",
    {
        "albedo": "vec3",
        "first_lobe": "float",
        "emission": "vec3",
        "lobes": "float",
        "holdout": "float",
        "first_instruction": "float",
        "instructions": "float",
        "first_constant": "float",
        "shape": "float",  # of its program as straight code; 0: none
        "albedo_from": "float",
        "normal_from": "float",
        "emission_from": "float",
        "two_sided": "float",
        "base_from": "float",
        "shades_lamps": "float",
        "transmittance": "vec3",
        "interior": "float",
        "transmittance_from": "float",
        "pane_colour": "vec3",
        "pane": "float",
    },
)
# A lobe as in the streams; the albedo of what it lies over; which of the material's lobes lies over
# it, its number plus one, or 0. Codes as of materials; 0: none.
MATERIAL_LOBE = Record(
    "MaterialLobe",
    {
        "colour": "vec3",
        "kind": "float",
        "covered": "vec3",
        "weight": "float",
        "parameters": "vec4",  # in the order that the kind's file says
        "more": "vec4",
        "parameters_from": "vec4",
        "more_from": "vec4",
        "colour_from": "float",
        "covered_from": "float",
        "weight_from": "float",
        "over": "float",
    },
)
# Of a material's program: a kind of node, the register that holds its result, and its operands, as
# codes: of a register, or below 0 of a constant.
INSTRUCTION = Record(
    "Instruction",
    {
        "kind": "float",
        "result": "float",
        "first": "float",
        "second": "float",
        "third": "float",
        "fourth": "float",
        "fifth": "float",
        "sixth": "float",
    },
)
# A medium: what light loses in it, and what of that it scatters on [1 / scene units]; the mean
# cosine of that to straight on; which GRID is its, plus one, or 0; unshadowing 1: shadow rays do
# not meet what it is in.
INTERIOR = Record(
    "Interior",
    {
        "extinction": "vec3",
        "anisotropy": "float",
        "scattering": "vec3",
        "grid": "float",
        "unshadowing": "float",
    },
)
# What a medium has in a box [scene units], over its mean, at places between which it goes evenly:
# how many along each axis, and how many a scene unit; which VOXEL is the first of extinction, and
# of scattering, or below 0: that goes with it; of how many channels there are such, 1 or 3, one
# after the other. goes_on 1: the next GRID has what is about that box and beyond, at places which
# are even as stage/far.py counts: its low and high are the box's, finer is of such units.
GRID = Record(
    "Grid",
    {
        "low": "vec3",
        "first": "float",
        "high": "vec3",
        "first_scattering": "float",
        "count": "vec3",
        "channels": "float",
        "finer": "vec3",
        "goes_on": "float",
    },
)
# At a place, at the next along x, and at both next along y.
VOXEL = Record("Voxel", {"values": "vec4"})
# What an INTERIOR emits in the mean [radiance a scene unit]; which VOXEL is the first of what it
# does at places of its grid over that, three channels one after the other; below 0: evenly.
GLOW = Record("Glow", {"emission": "vec3", "first": "float"})
CONSTANT = Record("Constant", {"value": "vec4"})
# What programs may ask for at a triangle's corners.
CORNER_ATTRIBUTE = Record("CornerAttribute", {"a": "vec4", "b": "vec4", "c": "vec4"})
# From scene units to a space: the first element is world space [m], the one of a surface's number
# plus one is its object's. Rows of an affine transform; the object's colour, place [m], random
# number and index.
SPACE = Record(
    "Space",
    {
        "x": "vec4",
        "y": "vec4",
        "z": "vec4",
        "colour": "vec4",
        "location": "vec3",
        "random": "float",
        "index": "float",
    },
)
# glsl/lights has a file for each kind, which says what the parameters are.
LIGHT = Record(
    "Light",
    {
        "position": "vec3",
        "kind": "float",
        "axis": "vec3",  # unit
        "chosen": "float",  # probability with which a photon starts here
        "power": "vec3",  # in its kind's unit; what is in W over the scene's scale squared
        "cdf": "float",  # sum of `chosen` up to and including this light
        "across": "vec3",  # unit, at a right angle to the axis
        "found_by": "float",  # bits, see light.glsl
        "parameters": "vec4",
        "more": "vec4",
        "falloff": "float",  # power of the distance that it does not fall off with: 0, 1 or 2
        "smoothing": "float",  # squared distance within which it is weaker
        "first": "float",  # element of its profile; rows and columns of that, or 0
        "rows": "float",
        "columns": "float",
        "gobo": "float",  # row of the table of environments where the image of its colours begins
        "gobo_width": "float",  # [px]; 0: all are 1
        "gobo_height": "float",
    },
)
# How bright a light is in a direction, over its mean; and of the cell from there to the next row
# and column the mean of its corners, and which share of photons goes to cells up to it: `along` its
# row, and, of rows, `down`.
PROFILE = Record("Profile", {"share": "float", "mean": "float", "along": "float", "down": "float"})

# Which rays meet a surface, by its number: bits, see ray_bits.glsl and visibility.glsl; and its set
# of those that lights tell apart, as lib/linked.glsl has it.
VISIBILITY = Record("Visibility", {"rays": "float"})
# Which media photons of a light start in, as MEDIUM has it.
LIGHT_START = Record("LightStart", {"inside": "vec2"})
# Where lights are about which media are bright, and the sum of the shares of those up to it; the
# cone that such a light shines in, by its axis and the cosine of its half angle, or 0.
BEAM = Record("Beam", {"position": "vec3", "up_to": "float", "axis": "vec3", "cosine": "float"})
LIGHT_LIMIT = Record("LightLimit", {"bounces": "float", "shadowed": "float"})  # or 0: never
# Where photons start that count (lib/aim.glsl): of a light afar, on a disc about this place; which
# node is its tree's root, plus one, or 0: anywhere.
LIGHT_AIM = Record("LightAim", {"middle": "vec3", "root": "float"})
# A rectangle through which light comes, of the world to what is shown (lib/portals.glsl), or of
# photons to it (lib/openings.glsl) [scene units]; both its axes are unit vectors. Of width 0: none.
PORTAL = Record(
    "Portal",
    {"middle": "vec3", "width": "float", "across": "vec3", "height": "float", "axis": "vec3"},
)
# A box in the numbers that a light's photons are drawn by: the axis that it is halved along, the
# probability of the lower half, and which node that one is, before the other; 0: it is not halved.
AIM_NODE = Record("AimNode", {"axis": "float", "share": "float", "first": "float"})
# Where a light is and where it shines (LightBounds of light.glsl), in streams.
LIGHT_LOW = Record("LightLow", {"low": "vec3", "spread": "float"})
LIGHT_HIGH = Record("LightHigh", {"high": "vec3", "reach": "float"})
LIGHT_AXIS = Record("LightAxis", {"axis": "vec3", "is_light": "float"})
# The same of all lights below a node of their tree (light_tree.glsl).
LIGHT_NODE = Record(
    "LightNode",
    {
        "low": "vec3",
        "flux": "float",  # [W / scene units^2], the channels' mean
        "high": "vec3",
        "spread": "float",
        "axis": "vec3",
        "reach": "float",
    },
)
# A light's leaf of the tree, -1: every point asks it; and which light is at this place: those that
# are asked, then the leaves'.
LIGHT_PLACE = Record("LightPlace", {"place": "float", "light": "float"})

# A side's grid in the table of radii (lib/radius.glsl), whose later texels hold the nodes' radii.
RADIUS_GRID = Record(
    "RadiusGrid",
    {
        "origin": "vec3",
        "first": "float",  # which number of the table its first node is, x fastest
        "cells": "vec3",  # one less than nodes
        "cell_size": "float",
        "low": "vec3",  # the box about its photons
        "first_corner": "float",  # of the finer cells that count them, of all sides'
        "high": "vec3",
    },
)

# What the native core reads of materials and lights that it knows (native/src/paths.rs).
PLAIN_MATERIAL = Record(
    "PlainMaterial",
    {
        "diffuse": "vec3",
        "exponent": "float",  # of Phong's lobe; below 0: a mirror
        "specular": "vec3",
        "gathers": "float",  # 1: photons land here, whether it is diffuse or not
    },
)
# Phong's lobe that gathers photons: the viewer's mirrored direction, and the BSDF there [1/sr].
PLAIN_LOBE = Record("PlainLobe", {"mirrored": "vec3", "exponent": "float"})
PLAIN_PEAK = Record("PlainPeak", {"peak": "vec3"})
# A lobe of microfacets: lib/microfacets.glsl.
SCALED = Record("Scaled", {"scale": "vec3", "alpha": "float"})
BASED = Record("Based", {"f0": "vec3", "ior": "float"})
DIPPED = Record("Dipped", {"dip": "vec3", "shape": "float"})
# The smooth surface about which nodes bend a normal; 1 if they do.
BASE = Record("Base", {"normal": "vec3", "is_bent": "float"})
PLAIN_LIGHT = Record(
    "PlainLight",
    {
        "position": "vec3",
        "radius": "float",
        "axis": "vec3",
        "outer": "float",  # 1 - cos of the cone's half angle
        "power": "vec3",
        "inner": "float",  # 1 - cos up to which the cone is at full power
        "chosen": "float",
        "cdf": "float",
    },
)

_BY_NAME = {record.name: record for record in list(vars().values()) if isinstance(record, Record)}


def check_layouts(theirs: Mapping[str, str]) -> None:
    """Raise ImportError unless the native core has the same layouts, by record: it is of another
    version, or one of the two was changed alone."""
    for name, layout in theirs.items():
        ours = _BY_NAME[name].layout if name in _BY_NAME else "nothing"
        if ours != layout:
            raise ImportError(f"{name} is {layout!r} in the native core, {ours!r} in records.py")


check_layouts(native.LAYOUTS)
