# SPDX-License-Identifier: GPL-3.0-or-later
from ...streams import Kernel, When
from .records import DEPOSIT, DIFFUSE, FACING, FLUX, PLACE, RAY_DIRECTION


class Projector(Kernel):
    """Deposit photons in world space on surfaces that gather (Marino & Abbate, Projector)."""

    stem = "projector"
    structure = ("INCOMING", "DIRECTIONS", "VISIBILITY", "FIRST_HITS")
    inputs = {
        "place": PLACE,
        "facing": FACING,
        "diffuse": DIFFUSE,
        "flux": FLUX,
        "direction": When("INCOMING", RAY_DIRECTION),
    }
    outputs = {"landed": PLACE, "deposit": DEPOSIT}
