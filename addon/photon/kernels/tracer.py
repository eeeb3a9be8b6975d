# SPDX-License-Identifier: GPL-3.0-or-later
from ...streams import Kernel, Table, When
from .records import HIT, NODE, RAY_DIRECTION, RAY_ORIGIN, TRIANGLE, VISIBILITY


class Tracer(Kernel):
    """Intersect rays with the triangles: the closest hit, or with ANY_HIT some hit; with VISIBILITY
    of triangles that are visible to one of the rays whose bits it has, or with BY_REACH to what
    each ray is by how far it may go."""

    stem = "tracer"
    structure = ("ANY_HIT", "VISIBILITY", "BY_REACH")
    inputs = {"origin": RAY_ORIGIN, "direction": RAY_DIRECTION}
    outputs = {"hit": HIT}
    tables = {
        "nodes": Table(NODE),
        "triangles": Table(TRIANGLE),
        "visibility": When("VISIBILITY", Table(VISIBILITY)),
    }
