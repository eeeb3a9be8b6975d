# SPDX-License-Identifier: GPL-3.0-or-later
from ..streams import Kernel, Table
from .records import HIT, RAY_DIRECTION, RAY_ORIGIN


class Tracer(Kernel):
    """Intersect rays with the triangles: the closest hit, or with ANY_HIT some hit."""

    stem = "tracer"
    inputs = {"origin": RAY_ORIGIN, "direction": RAY_DIRECTION}
    outputs = {"hit": HIT}
    tables = {"bvh_nodes": Table(), "bvh_corners": Table()}
