# SPDX-License-Identifier: GPL-3.0-or-later
from ...streams import Kernel, Table
from ..photons.radius_field import TABLES, UNIFORMS
from .records import CUTS, DIFFUSE, FACING, NODE, PLACE, TRIANGLE


class Cuts(Kernel):
    """Cut each visible point's disc off where something stands on its surface."""

    stem = "cuts"
    inputs = {"place": PLACE, "facing": FACING, "diffuse": DIFFUSE}
    outputs = {"cuts": CUTS}
    uniforms = UNIFORMS
    tables = {"nodes": Table(NODE), "triangles": Table(TRIANGLE)} | TABLES
