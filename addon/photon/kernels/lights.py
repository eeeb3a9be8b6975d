# SPDX-License-Identifier: GPL-3.0-or-later
"""What kernels read that ask lights, whatever their kinds."""

from ...streams import Table, When
from .records import LIGHT, LIGHT_LIMIT, LIGHT_NODE, LIGHT_PLACE, PORTAL, PROFILE

LIGHT_DEFINES = (
    "PROFILES",
    "ENVIRONMENT",
    "GOBOS",
    "AREA_LIGHT",
    "EMISSION_SHARES",
    "TRIANGLE_LIGHT",
)
PORTALS = {"portals": When("PORTALS", Table(PORTAL))}
LIGHT_TABLES = {
    "lights": Table(LIGHT),
    "profiles": When("PROFILES", Table(PROFILE)),
    "environments": When("ENVIRONMENT", Table()),
    "emission_shares": When("EMISSION_SHARES", Table()),
}
LIMITS = {"light_limits": When("VISIBILITY", Table(LIGHT_LIMIT))}
# What those read besides that choose among them.
CHOICE = {
    "light_nodes": When("DRAWN", Table(LIGHT_NODE)),
    "light_places": When("DRAWN", Table(LIGHT_PLACE)),
}
