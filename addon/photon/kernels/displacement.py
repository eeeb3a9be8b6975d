# SPDX-License-Identifier: GPL-3.0-or-later
from ...streams import Kernel, Table
from .records import CORNER_NORMALS, HIT, MATERIAL, RAY_DIRECTION, TRIANGLE, WAY
from .shade import PROGRAM_DEFINES, PROGRAM_TABLES


class Displace(Kernel):
    """Find how far programs move their surfaces [m] where rays end, or what else they tell."""

    stem = "displacement"
    structure = tuple(name for name in PROGRAM_DEFINES if name != "BUMPS")
    inputs = {"direction": RAY_DIRECTION, "hit": HIT}
    outputs = {"way": WAY}
    tables = {
        "triangles": Table(TRIANGLE),
        "corner_normals": Table(CORNER_NORMALS),
        "materials": Table(MATERIAL),
        **PROGRAM_TABLES,
    }
