# SPDX-License-Identifier: GPL-3.0-or-later
"""What kernels read that ask lights, whatever their kinds."""

from ...streams import Table, Uniform, When
from ..scene import FOUND_BY, LIT
from .records import LIGHT, LIGHT_LIMIT, LIGHT_NODE, LIGHT_PLACE, PORTAL, PROFILE

# Bits of a light's found_by in GLSL (lib/light.glsl).
FOUND_BITS = {name: 1 << bit for bit, name in enumerate(FOUND_BY)}
IS_ASKED = sum(FOUND_BITS[name] for name in LIT)  # one of them: shadow rays ask it
IS_SOFT, IS_GLOW, EXCLUDES = (1 << (len(FOUND_BY) + bit) for bit in range(3))
LIGHT_DEFINES = (
    "PROFILES",
    "ENVIRONMENT",
    "GOBOS",
    "AREA_LIGHT",
    "EMISSION_SHARES",
    "TRIANGLE_LIGHT",
)
PORTALS = {"portals": When("PORTALS", Table(PORTAL))}
WORLD_RAYS = {name: When("PORTALS", Uniform("int")) for name in ("world_light", "world_rays")}
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
