# SPDX-License-Identifier: GPL-3.0-or-later
from ...streams import Kernel, Table
from .records import FACING, HIT, MATERIAL, MEDIUM, THROUGHPUT, TRIANGLE


class Absorb(Kernel):
    """Take from secondary rays what was absorbed on their way inside meshes."""

    stem = "absorb"
    inputs = {"throughput": THROUGHPUT, "medium": MEDIUM, "hit": HIT, "facing": FACING}
    outputs = {"left": THROUGHPUT}
    tables = {"triangles": Table(TRIANGLE), "materials": Table(MATERIAL)}
