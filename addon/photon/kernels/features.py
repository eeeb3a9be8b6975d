# SPDX-License-Identifier: GPL-3.0-or-later
from ...streams import Kernel, When
from .records import DIFFUSE, HIT, RADIANCE, RAY_DIRECTION, SHADING, THROUGHPUT
from .shade import GATHERED_LOBES, LOBES, SCATTERS


class Features(Kernel):
    """What denoisers go by: albedo and normal of what rays show, in mirrors and clear glass too."""

    stem = "features"
    structure = ("EMITTERS", "LOBES", "TWO_LOBES", "TINTED", "MEDIA", *SCATTERS, *GATHERED_LOBES)
    inputs = {
        "direction": When("LOBES", RAY_DIRECTION),
        "hit": HIT,
        "diffuse": DIFFUSE,
        "shading": SHADING,
        "throughput": THROUGHPUT,
        "arriving": When("MEDIA", When("EMITTERS", THROUGHPUT)),
        "emitted": When("EMITTERS", RADIANCE),
        "environment": When("EMITTERS", RADIANCE),
        **LOBES,
    }
    outputs = {"albedo_seen": RADIANCE, "normal_seen": RADIANCE}
