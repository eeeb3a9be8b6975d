# SPDX-License-Identifier: GPL-3.0-or-later
from ...streams import Items, Kernel, Uniform
from ..photons import radius_field
from ..settings import FILTER_DEFINES
from .records import CUTS, FACING, IRRADIANCE, PLACE


class Gather(Kernel):
    """Add the photons around each visible point from a sorted grid (Jensen 2001, sec. 7)."""

    stem = "gather"
    structure = FILTER_DEFINES
    inputs = {"place": PLACE, "facing": FACING, "cuts": CUTS, "sum": IRRADIANCE}
    outputs = {"irradiance": IRRADIANCE}
    uniforms = {
        "grid_origin": Uniform("vec3"),
        "cell_size": Uniform("float"),
        "grid_cells": Uniform("ivec3"),
        "photon_range": Uniform("ivec2"),  # the sorted photons to add: first, and one past the last
    } | radius_field.UNIFORMS
    tables = {
        "photon_place": Items(),
        "photon_deposit": Items(),
        "cell_start": Items("uint"),
        **radius_field.TABLES,
    }
