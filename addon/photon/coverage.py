# SPDX-License-Identifier: GPL-3.0-or-later
from ..streams import Kernel, Table, Uniform
from . import radius_field
from .records import COVERAGE, CUTS, FACING, HIT, PLACE, SHADING


class Coverage(Kernel):
    """Estimate the share of the filter on each visible point's own surface, within its cuts."""

    stem = "coverage"
    records = (HIT,)
    inputs = {"place": PLACE, "facing": FACING, "shading": SHADING, "cuts": CUTS}
    outputs = {"coverage": COVERAGE}
    uniforms = {
        "seed": Uniform("uint"),
        "probes": Uniform("int"),
        "first_probe": Uniform("uint"),
        "depth": Uniform("int"),
        "frame_size": Uniform("ivec2"),
        "region_origin": Uniform("ivec2"),
    } | radius_field.UNIFORMS
    tables = {
        "bvh_nodes": Table(),
        "bvh_corners": Table(),
        "bvh_normals": Table(),
        "materials": Table(),
    } | radius_field.TABLES
