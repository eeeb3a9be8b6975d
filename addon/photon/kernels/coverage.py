# SPDX-License-Identifier: GPL-3.0-or-later
from ...streams import Kernel, Table, Uniform
from ..photons import radius_field
from ..settings import FILTER_DEFINES
from .records import (
    CORNER_NORMALS,
    COVERAGE,
    CUTS,
    HIT,
    NODE,
    TRIANGLE,
)
from .shade import POINT


class Coverage(Kernel):
    """Estimate the share of the filter on each visible point's own surface, within its cuts."""

    stem = "coverage"
    records = (HIT,)
    structure = FILTER_DEFINES
    inputs = {**POINT, "cuts": CUTS}
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
        "nodes": Table(NODE),
        "triangles": Table(TRIANGLE),
        "corner_normals": Table(CORNER_NORMALS),
    } | radius_field.TABLES
