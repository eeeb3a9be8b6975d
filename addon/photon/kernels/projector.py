# SPDX-License-Identifier: GPL-3.0-or-later
from ...streams import Kernel
from .records import DEPOSIT, DIFFUSE, FACING, FLUX, PLACE


class Projector(Kernel):
    """Deposit photons in world space on diffuse surfaces (Marino & Abbate, Projector)."""

    stem = "projector"
    inputs = {"place": PLACE, "facing": FACING, "diffuse": DIFFUSE, "flux": FLUX}
    outputs = {"landed": PLACE, "deposit": DEPOSIT}
