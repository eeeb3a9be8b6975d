# SPDX-License-Identifier: GPL-3.0-or-later
from ...streams import Kernel, Table, Uniform, When
from .lights import LIGHT_DEFINES, LIGHT_TABLES
from .records import HIT, RADIANCE, RAY_DIRECTION, RAY_ORIGIN, THROUGHPUT, TRIANGLE


class Emitted(Kernel):
    """Find the lights that rays meet, and the world that they end in."""

    stem = "emitted"
    structure = ("WEIGHED", "SHADOW_RAYS", "DRAWN", *LIGHT_DEFINES)
    inputs = {
        "origin": RAY_ORIGIN,
        "direction": RAY_DIRECTION,
        "hit": HIT,
        "throughput": When("WEIGHED", THROUGHPUT),
    }
    outputs = {"emitted": RADIANCE, "environment": RADIANCE}
    uniforms = {
        "depth": Uniform("int"),
        "light_count": Uniform("int"),
        "seen_lights": Uniform("int"),
    }
    tables = {
        **LIGHT_TABLES,
        "triangles": When("WEIGHED", Table(TRIANGLE)),
    }
