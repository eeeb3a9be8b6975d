# SPDX-License-Identifier: GPL-3.0-or-later
from ...streams import Items, Kernel, Uniform, When
from ..photons import radius_field
from ..settings import FILTER_DEFINES
from .records import (
    COVERAGE,
    CUTS,
    DIFFUSE,
    FACING,
    GLOSS,
    IRRADIANCE,
    PLACE,
    RAY_DIRECTION,
    SHADING,
    TILT,
)
from .shade import GATHERED_LOBES, GATHERS_BY_DEPTH, GLOSSY, LOBES

_GATHERER = {
    "direction": RAY_DIRECTION,
    "gloss_sum": GLOSS,
}


class Gather(Kernel):
    """Add the photons around each visible point from a sorted grid (Jensen 2001, sec. 7), and what
    its lobes send on of each."""

    stem = "gather"
    structure = (
        *FILTER_DEFINES,
        *GATHERED_LOBES,
        "LOBES",
        "TWO_LOBES",
        "TINTED",
        "NORMALS",
        "OTHER_LOBES",
    )
    inputs = {
        "place": PLACE,
        "facing": FACING,
        "cuts": CUTS,
        "coverage": COVERAGE,
        "tilt": TILT,
        "sum": IRRADIANCE,
        **LOBES,
        "shading": When(("GATHERED_LOBES", "NORMALS"), SHADING),
        "diffuse": When("NORMALS", DIFFUSE),
        **{name: When("GATHERED_LOBES", port) for name, port in _GATHERER.items()},
    }
    outputs = {"irradiance": IRRADIANCE, **GLOSSY}
    uniforms = {
        "grid_origin": Uniform("vec3"),
        "cell_size": Uniform("float", of_parts=True),
        "grid_cells": Uniform("ivec3", of_parts=True),
        "first_cell": Uniform("int", of_parts=True),
        # The sorted photons to add: first, and one past the last.
        "photon_range": Uniform("ivec2", of_parts=True),
        **GATHERS_BY_DEPTH,
    } | radius_field.UNIFORMS
    tables = {
        "photon_place": Items(),
        "photon_deposit": Items(),
        "cell_start": Items("uint"),
        **radius_field.TABLES,
    }
