# SPDX-License-Identifier: GPL-3.0-or-later
from ..streams import Kernel, Table
from .records import DEPOSIT, FLUX, HIT, PLACE, RAY_DIRECTION


class Projector(Kernel):
    """Deposit photons in world space on diffuse surfaces (Marino & Abbate, Projector)."""

    stem = "projector"
    inputs = {"direction": RAY_DIRECTION, "hit": HIT, "flux": FLUX}
    outputs = {"place": PLACE, "deposit": DEPOSIT}
    tables = {"bvh_corners": Table(), "bvh_normals": Table(), "materials": Table()}
