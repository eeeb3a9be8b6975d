# SPDX-License-Identifier: GPL-3.0-or-later
from ...streams import Kernel
from .records import FACING, GATHERED, PLACE, PLAIN_LOBE, PLAIN_PEAK, RAY_DIRECTION, SHADING
from .shade import FIRST_LOBE, GATHERED_LOBES, GATHERS_BY_DEPTH


class PlainLobe(Kernel):
    """Say what the native core needs to gather photons with a visible point's Phong lobe."""

    stem = "plain_lobe"
    structure = (*GATHERED_LOBES, "LOBES")
    inputs = {
        "place": PLACE,
        "facing": FACING,
        "shading": SHADING,
        "direction": RAY_DIRECTION,
        **FIRST_LOBE,
    }
    outputs = {"gathered": GATHERED, "plain_lobe": PLAIN_LOBE, "plain_peak": PLAIN_PEAK}
    uniforms = GATHERS_BY_DEPTH
