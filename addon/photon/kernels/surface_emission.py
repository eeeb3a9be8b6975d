# SPDX-License-Identifier: GPL-3.0-or-later
from ...streams import Kernel, Table, Uniform, When
from .records import CHAIN, CORNER_NORMALS, HIT, MATERIAL, RADIANCE, RAY_DIRECTION, TRIANGLE
from .shade import PROGRAM_DEFINES, PROGRAM_TABLES


class SurfaceEmission(Kernel):
    """Find what surfaces emit where rays of the eye end (EYE), if that differs from point to
    point; or how they light."""

    stem = "surface_emission"
    structure = ("EYE", "TRANSPARENT", *PROGRAM_DEFINES)
    inputs = {"direction": RAY_DIRECTION, "hit": HIT, "chain": When("TRANSPARENT", CHAIN)}
    outputs = {"emission": RADIANCE}
    uniforms = {"depth": When("EYE", Uniform("int"))}
    tables = {
        "triangles": Table(TRIANGLE),
        "corner_normals": Table(CORNER_NORMALS),
        "materials": Table(MATERIAL),
        **PROGRAM_TABLES,
    }
