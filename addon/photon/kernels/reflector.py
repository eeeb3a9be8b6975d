# SPDX-License-Identifier: GPL-3.0-or-later
from ...streams import Kernel, Table, Uniform, When
from .records import (
    FLUX,
    HIT,
    INTERIOR,
    LIGHT,
    MATERIAL,
    MEDIUM,
    PORTAL,
    RAY_DIRECTION,
    RAY_ORIGIN,
    TRIANGLE,
    VISIBILITY,
)
from .shade import FIRST_LOBE, POINT, SCATTERS


class Reflector(Kernel):
    """Scatter or absorb each photon by Russian roulette (Marino & Abbate, Reflector)."""

    stem = "reflector"
    structure = (
        "LOBES",
        "TINTED",
        "TRANSMITS",
        "TRANSPARENT",
        "DISPERSION",
        "CAUSTICS",
        "MEDIA",
        *SCATTERS,
        "PANES",
        "ARRIVALS",
        "LINKED",
        "ENVIRONMENT",
        "VISIBILITY",
        "SHADED_LAMPS",
        "NO_CAUSTICS",
        "NORMALS",
        "PORTALS",
        "ONE_WAY",
        "PORTALS_FOR_ABSORBED",
        "PORTALS_BY_SHARE",
        "MOST_BY_PORTAL",
        "WIDE_PORTAL",
    )
    inputs = {
        "origin": When("ARRIVALS", RAY_ORIGIN),
        "direction": RAY_DIRECTION,
        "flux": FLUX,
        "hit": When("MEDIA", HIT),
        "medium": When("MEDIA", MEDIUM),
        **POINT,
        **FIRST_LOBE,
    }
    outputs = {
        "next_origin": RAY_ORIGIN,
        "next_direction": RAY_DIRECTION,
        "next_flux": FLUX,
        "next_medium": When("MEDIA", MEDIUM),
    }
    uniforms = {"seed": Uniform("uint"), "pass_index": Uniform("uint"), "bounce": Uniform("int")}
    tables = {
        "triangles": When(("MEDIA", "SHADED_LAMPS"), Table(TRIANGLE)),
        "materials": When(("MEDIA", "SHADED_LAMPS"), Table(MATERIAL)),
        "interiors": When("MEDIA", Table(INTERIOR)),
        "lights": When("ARRIVALS", Table(LIGHT)),
        "environments": When("ENVIRONMENT", Table()),
        "visibility": When("VISIBILITY", Table(VISIBILITY)),
        "photon_portals": When("PORTALS", Table(PORTAL)),
    }
