# SPDX-License-Identifier: GPL-3.0-or-later
from ..streams import Kernel
from .records import HIT, RADIANCE


class Lit(Kernel):
    """Add a light's radiance to the visible points that its shadow rays reached."""

    stem = "lit"
    inputs = {"sum": RADIANCE, "unshadowed": RADIANCE, "hit": HIT}
    outputs = {"total": RADIANCE}
