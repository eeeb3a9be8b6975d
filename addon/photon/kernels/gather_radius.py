# SPDX-License-Identifier: GPL-3.0-or-later
from ...streams import Kernel
from ..photons.radius_field import TABLES, UNIFORMS
from .records import CUTS, FACING, GATHER_RADIUS, PLACE


class GatherRadius(Kernel):
    """The gather radius of each visible point."""

    stem = "gather_radius"
    inputs = {"place": PLACE, "facing": FACING, "cuts": CUTS}
    outputs = {"gather_radius": GATHER_RADIUS}
    uniforms = UNIFORMS
    tables = TABLES
