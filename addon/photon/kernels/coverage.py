# SPDX-License-Identifier: GPL-3.0-or-later
from ...streams import Kernel, Table, Uniform
from ..photons import radius_field
from ..settings import FILTER_DEFINES
from .records import (
    CORNER_NORMALS,
    COVERAGE,
    CUTS,
    FACE,
    HIT,
    NODE,
    PIXEL,
    TILT,
    TRIANGLE,
)
from .shade import POINT


class Coverage(Kernel):
    """Tilt the filter within each visible point's cuts, and estimate its share on the point's own
    surface."""

    stem = "coverage"
    records = (HIT,)
    structure = FILTER_DEFINES
    inputs = {"pixel": PIXEL, **POINT, "cuts": CUTS}
    outputs = {"coverage": COVERAGE, "tilt": TILT}
    uniforms = {
        "seed": Uniform("uint"),
        "probes": Uniform("int"),
        "first_probe": Uniform("uint"),
        "expecting": Uniform("int"),
        "least_expected": Uniform("float"),
        "depth": Uniform("int"),
        "frame_size": Uniform("ivec2"),
    } | radius_field.UNIFORMS
    tables = {
        "nodes": Table(NODE),
        "triangles": Table(TRIANGLE),
        "corner_normals": Table(CORNER_NORMALS),
        "faces": Table(FACE),
    } | radius_field.TABLES
