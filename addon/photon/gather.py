# SPDX-License-Identifier: GPL-3.0-or-later
from ..streams import Kernel, Table, Uniform
from .records import FACING, IRRADIANCE, PLACE


class Gather(Kernel):
    """Add the photons around each visible point from a sorted grid (Jensen 2001, sec. 7)."""

    stem = "gather"
    inputs = {"place": PLACE, "facing": FACING, "sum": IRRADIANCE}
    outputs = {"irradiance": IRRADIANCE}
    uniforms = {
        "radius": Uniform("float"),
        "grid_origin": Uniform("vec3"),
        "cell_size": Uniform("float"),
        "grid_cells": Uniform("ivec3"),
        "photon_range": Uniform("ivec2"),  # the sorted photons to add: first, and one past the last
    }
    tables = {
        "photon_place": Table(),
        "photon_deposit": Table(),
        "cell_start": Table("usampler2D"),
    }
