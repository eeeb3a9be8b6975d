# SPDX-License-Identifier: GPL-3.0-or-later
"""What kernels read that ask lights, whatever their kinds."""

from ...streams import Table, When
from .records import LIGHT, LIGHT_LIMIT, PROFILE

LIGHT_DEFINES = ("PROFILES", "ENVIRONMENT")
LIGHT_TABLES = {
    "lights": Table(LIGHT),
    "profiles": When("PROFILES", Table(PROFILE)),
    "environments": When("ENVIRONMENT", Table()),
}
LIMITS = {"light_limits": When("VISIBILITY", Table(LIGHT_LIMIT))}
