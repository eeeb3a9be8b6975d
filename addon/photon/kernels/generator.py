# SPDX-License-Identifier: GPL-3.0-or-later
from ...streams import Kernel, Table, Uniform, When
from .lights import LIGHT_DEFINES, LIGHT_TABLES, LIMITS
from .records import (
    AIM_NODE,
    FLUX,
    LIGHT_AIM,
    LIGHT_START,
    MEDIUM,
    PORTAL,
    RAY_DIRECTION,
    RAY_ORIGIN,
)

BY_SHARE = ("PORTALS", "ONE_WAY", "PORTALS_BY_SHARE")


class Generator(Kernel):
    """Emit photons of equal flux from the lights (Marino & Abbate, Generator)."""

    stem = "generator"
    structure = (
        *LIGHT_DEFINES,
        "VISIBILITY",
        "AIMED",
        "MEDIA",
        "LIGHT_STARTS",
        "PANES",
        "SHADED_LAMPS",
        *BY_SHARE,
    )
    outputs = {
        "origin": RAY_ORIGIN,
        "direction": RAY_DIRECTION,
        "flux": FLUX,
        "medium": When("MEDIA", MEDIUM),
    }
    uniforms = {
        "seed": Uniform("uint"),
        "pass_index": Uniform("uint"),
        "photons": Uniform("int"),  # of a pass
        "passes": Uniform("int"),  # whose photons start together
        "light_count": Uniform("int"),
        "distant_lights": When(("AIMED", "PANES"), Uniform("int")),
    }
    tables = {
        **LIGHT_TABLES,
        **LIMITS,
        "light_starts": When("LIGHT_STARTS", Table(LIGHT_START)),
        "light_aims": When("AIMED", Table(LIGHT_AIM)),
        "aim_nodes": When("AIMED", Table(AIM_NODE)),
        "photon_portals": When("PORTALS_BY_SHARE", Table(PORTAL)),
    }
