# SPDX-License-Identifier: GPL-3.0-or-later
from ...streams import Kernel, Ports, When
from .records import BASED, DIPPED, FACING, GATHERED, PLACE, RAY_DIRECTION, SCALED, SHADING
from .shade import GATHERED_LOBES, GATHERS_BY_DEPTH, LOBES

# Of a point's first lobe, and its second.
MICROFACETS: Ports = {
    "scaled0": SCALED,
    "based0": BASED,
    "dipped0": DIPPED,
    "scaled1": When("TWO_LOBES", SCALED),
    "based1": When("TWO_LOBES", BASED),
    "dipped1": When("TWO_LOBES", DIPPED),
}


class PlainMicrofacets(Kernel):
    """Say what the native core needs to gather photons with lobes of microfacets."""

    stem = "plain_microfacets"
    structure = (*GATHERED_LOBES, "LOBES", "TWO_LOBES", "TINTED")
    inputs = {
        "place": PLACE,
        "facing": FACING,
        "shading": SHADING,
        "direction": RAY_DIRECTION,
        **LOBES,
    }
    outputs = {"gathered": GATHERED, **MICROFACETS}
    uniforms = GATHERS_BY_DEPTH
