# SPDX-License-Identifier: GPL-3.0-or-later
from ..streams import Kernel, Table
from .radius_field import TABLES, UNIFORMS
from .records import CUTS, FACING, PLACE


class Cuts(Kernel):
    """Cut each visible point's disc off where something stands on its surface."""

    stem = "cuts"
    inputs = {"place": PLACE, "facing": FACING}
    outputs = {"cuts": CUTS}
    uniforms = UNIFORMS
    tables = {"bvh_nodes": Table(), "bvh_corners": Table(), "materials": Table()} | TABLES
