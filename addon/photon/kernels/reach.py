# SPDX-License-Identifier: GPL-3.0-or-later
from ...streams import Kernel
from ..photons.radius_field import TABLES, UNIFORMS
from .records import FACING, PLACE, REACH


class Reach(Kernel):
    """How far each visible point looks for photons."""

    stem = "reach"
    inputs = {"place": PLACE, "facing": FACING}
    outputs = {"reach": REACH}
    uniforms = UNIFORMS
    tables = TABLES
