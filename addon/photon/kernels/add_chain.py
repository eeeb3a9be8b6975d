# SPDX-License-Identifier: GPL-3.0-or-later
from ...streams import Kernel, When
from .records import BLUR, LOST, RADIANCE


class AddChain(Kernel):
    """Add what secondary rays see to their pixels' images."""

    stem = "add_chain"
    structure = ("PHOTON_MAP", "TRANSPARENT", "FEATURES", "CAUSTICS", "MIST")
    inputs = {
        "sum": RADIANCE,
        "indirect_sum": RADIANCE,
        "blur_sum": When("PHOTON_MAP", BLUR),
        "background_sum": When("TRANSPARENT", RADIANCE),
        "mist_sum": When("MIST", When("TRANSPARENT", RADIANCE)),
        "albedo_sum": When("FEATURES", RADIANCE),
        "normal_sum": When("FEATURES", RADIANCE),
        "caustics_sum": When("CAUSTICS", RADIANCE),
        "seen": RADIANCE,
        "indirect_seen": RADIANCE,
        "blur_seen": When("PHOTON_MAP", BLUR),
        "lost": When("TRANSPARENT", LOST),
        "mist_seen": When("MIST", When("TRANSPARENT", RADIANCE)),
        "albedo_seen": When("FEATURES", RADIANCE),
        "normal_seen": When("FEATURES", RADIANCE),
        "caustics_seen": When("CAUSTICS", RADIANCE),
    }
    outputs = {
        "total": RADIANCE,
        "indirect_total": RADIANCE,
        "blur_total": When("PHOTON_MAP", BLUR),
        "background_total": When("TRANSPARENT", RADIANCE),
        "mist_total": When("MIST", When("TRANSPARENT", RADIANCE)),
        "albedo_total": When("FEATURES", RADIANCE),
        "normal_total": When("FEATURES", RADIANCE),
        "caustics_total": When("CAUSTICS", RADIANCE),
    }
