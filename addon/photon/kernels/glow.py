# SPDX-License-Identifier: GPL-3.0-or-later
from ...streams import Kernel, Table
from .records import CORNER_NORMALS, HIT, MATERIAL, RADIANCE, RAY_DIRECTION, TRIANGLE
from .shade import PROGRAM_DEFINES, PROGRAM_TABLES


class Glow(Kernel):
    """Find what glows where rays end, if that differs from point to point."""

    stem = "glow"
    structure = PROGRAM_DEFINES
    inputs = {"direction": RAY_DIRECTION, "hit": HIT}
    outputs = {"glow": RADIANCE}
    tables = {
        "triangles": Table(TRIANGLE),
        "corner_normals": Table(CORNER_NORMALS),
        "materials": Table(MATERIAL),
        **PROGRAM_TABLES,
    }
