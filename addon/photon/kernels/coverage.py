# SPDX-License-Identifier: GPL-3.0-or-later
import math
from typing import Any

from ...streams import Kernel, Table, Uniform, of_parts
from ..photons import radius_field
from ..settings import FILTER_DEFINES
from .records import (
    CORNER_NORMALS,
    COVERAGE,
    CUTS,
    FACE,
    HIT,
    NODE,
    PIXEL,
    TILT,
    TRIANGLE,
)
from .shade import POINT

EXPECTS_FROM = 8  # passes from this one on ask what to expect of the coverage
LEAST_EXPECTED = 0.25  # in the first ones; later less, so that what it leaves of a bias goes, too


class Coverage(Kernel):
    """Tilt the filter within each visible point's cuts, and estimate its share on the point's own
    surface."""

    stem = "coverage"
    records = (HIT,)
    structure = FILTER_DEFINES
    inputs = {"pixel": PIXEL, **POINT, "cuts": CUTS}
    outputs = {"coverage": COVERAGE, "tilt": TILT}
    uniforms = {
        "seed": Uniform("uint"),
        "probes": Uniform("int", of_parts=True),
        "first_probe": Uniform("uint", of_parts=True),
        "expecting": Uniform("int", of_parts=True),
        "least_expected": Uniform("float", of_parts=True),
        "rounds": Uniform("int"),  # lanes wait for each other in each: it is all elements'
        "depth": Uniform("int"),
        "frame_size": Uniform("ivec2"),
    } | radius_field.UNIFORMS
    tables = {
        "nodes": Table(NODE),
        "triangles": Table(TRIANGLE),
        "corner_normals": Table(CORNER_NORMALS),
        "faces": Table(FACE),
    } | radius_field.TABLES


def probes_of(passes: range) -> dict[str, Any]:
    """Coverage probes from each point, of each of some passes."""
    each = [_probes_of(index) for index in passes]
    probes = {name: of_parts([one[name] for one in each]) for name in each[0]}
    return probes | {"rounds": 2 if any(one["expecting"] for one in each) else 1}


def _probes_of(index: int) -> dict[str, Any]:
    """Coverage probes of pass `index`.

    How many, how many were sent before, how many more tell what to expect of the coverage, and how
    much is expected at least. More at first: the quotient of few probes is off at edges. What to
    expect is asked later: divided by it few passes have specks.
    """
    first = 8 * min(index, 3)
    return {
        "probes": 8 if index < 3 else 4,
        "first_probe": first + 4 * max(index - 3, 0),
        "expecting": 0 if index < EXPECTS_FROM else 4,
        "least_expected": LEAST_EXPECTED * min(1.0, math.sqrt(16.0 / (index + 1))),
    }
