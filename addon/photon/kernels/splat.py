# SPDX-License-Identifier: GPL-3.0-or-later
from ...streams import DrawKernel, Items, Uniform
from ..photons import radius_field
from ..settings import FILTER_DEFINES
from .records import COVERAGE, CUTS, FACING, GATHER_RADIUS, IRRADIANCE, PLACE, TILT


class Splat(DrawKernel):
    """Add each photon to the visible points around it by a splat (Marino & Abbate, Splatting)."""

    stem = "splat"
    structure = FILTER_DEFINES
    inputs = {
        "place": PLACE,
        "facing": FACING,
        "gather_radius": GATHER_RADIUS,
        "cuts": CUTS,
        "coverage": COVERAGE,
        "tilt": TILT,
    }
    outputs = {"irradiance": IRRADIANCE}
    passed = {"photon": "vec4", "flux": "vec4"}
    uniforms = {
        "world_to_camera": Uniform("mat4"),
        "window": Uniform("vec4"),
        "spread": Uniform("vec2"),
        "field_is_even": Uniform("bool"),
        "orthographic": Uniform("bool"),
    } | radius_field.UNIFORMS
    tables = {"photon_place": Items(), "photon_deposit": Items(), **radius_field.TABLES}
