# SPDX-License-Identifier: GPL-3.0-or-later
from ...streams import Kernel, Table, Uniform, When
from .records import DEPOSIT, DIFFUSE, FACING, FLUX, LIGHT, PLACE, RAY_DIRECTION, RAY_ORIGIN


class Projector(Kernel):
    """Deposit photons in world space on surfaces that gather (Marino & Abbate, Projector)."""

    stem = "projector"
    structure = ("INCOMING", "DIRECTIONS", "ARRIVALS", "ENVIRONMENT", "VISIBILITY", "FIRST_HITS")
    inputs = {
        "place": PLACE,
        "facing": FACING,
        "diffuse": DIFFUSE,
        "flux": FLUX,
        "direction": When("INCOMING", RAY_DIRECTION),
        "origin": When("ARRIVALS", RAY_ORIGIN),
    }
    outputs = {"landed": PLACE, "deposit": DEPOSIT}
    uniforms = {"numbered": Uniform("bool")}  # the photon takes the normal's place
    tables = {
        "lights": When("ARRIVALS", Table(LIGHT)),
        "environments": When("ENVIRONMENT", Table()),
    }
