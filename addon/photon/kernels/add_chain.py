# SPDX-License-Identifier: GPL-3.0-or-later
from ...streams import Kernel, Table, When
from .records import BLUR, ELEMENT, LOST, RADIANCE


class AddChain(Kernel):
    """Add what secondary rays see to their pixels' images, wherever the rays have MOVED."""

    stem = "add_chain"
    structure = ("PHOTON_MAP", "TRANSPARENT", "FEATURES", "CAUSTICS", "MOVED")
    records = (LOST,)
    inputs = {
        "element": When("MOVED", ELEMENT),
        "sum": RADIANCE,
        "indirect_sum": RADIANCE,
        "blur_sum": When("PHOTON_MAP", BLUR),
        "background_sum": When("TRANSPARENT", RADIANCE),
        "albedo_sum": When("FEATURES", RADIANCE),
        "normal_sum": When("FEATURES", RADIANCE),
        "caustics_sum": When("CAUSTICS", RADIANCE),
    }
    outputs = {
        "total": RADIANCE,
        "indirect_total": RADIANCE,
        "blur_total": When("PHOTON_MAP", BLUR),
        "background_total": When("TRANSPARENT", RADIANCE),
        "albedo_total": When("FEATURES", RADIANCE),
        "normal_total": When("FEATURES", RADIANCE),
        "caustics_total": When("CAUSTICS", RADIANCE),
    }
    tables = {
        "seen": Table(),
        "indirect_seen": Table(),
        "blur_seen": When("PHOTON_MAP", Table()),
        "lost": When("TRANSPARENT", Table()),
        "albedo_seen": When("FEATURES", Table()),
        "normal_seen": When("FEATURES", Table()),
        "caustics_seen": When("CAUSTICS", Table()),
    }
