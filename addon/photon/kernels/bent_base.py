# SPDX-License-Identifier: GPL-3.0-or-later
from ...streams import Kernel
from .records import BASE, DIFFUSE, FACING, PLACE, SHADING


class BentBase(Kernel):
    """The smooth surface about which each point's normal is bent."""

    stem = "bent_base"
    inputs = {"place": PLACE, "facing": FACING, "shading": SHADING, "diffuse": DIFFUSE}
    outputs = {"base": BASE}
