# SPDX-License-Identifier: GPL-3.0-or-later
from ...streams import Kernel, Table
from .records import HIT, NODE, RAY_DIRECTION, RAY_ORIGIN, TRIANGLE


class Tracer(Kernel):
    """Intersect rays with the triangles: the closest hit, or with ANY_HIT some hit."""

    stem = "tracer"
    structure = ("ANY_HIT",)
    inputs = {"origin": RAY_ORIGIN, "direction": RAY_DIRECTION}
    outputs = {"hit": HIT}
    tables = {"nodes": Table(NODE), "triangles": Table(TRIANGLE)}
