# SPDX-License-Identifier: GPL-3.0-or-later
from ...streams import Kernel, Table, Uniform, When
from .records import (
    DEPOSIT,
    DIFFUSE,
    FACING,
    FLUX,
    HIT,
    INTERIOR,
    LIGHT,
    MATERIAL,
    MEDIUM,
    PLACE,
    RAY_DIRECTION,
    RAY_ORIGIN,
    TRIANGLE,
    VISIBILITY,
)


class Projector(Kernel):
    """Deposit photons in world space on surfaces that gather (Marino & Abbate, Projector)."""

    stem = "projector"
    structure = (
        "INCOMING",
        "DIRECTIONS",
        "DISPERSION",
        "CAUSTICS",
        "MEDIA",
        "SCATTERING",
        "PANES",
        "ARRIVALS",
        "LINKED",
        "ENVIRONMENT",
        "VISIBILITY",
        "FIRST_HITS",
    )
    inputs = {
        "place": PLACE,
        "facing": FACING,
        "diffuse": DIFFUSE,
        "flux": FLUX,
        "hit": When("MEDIA", HIT),
        "medium": When("MEDIA", MEDIUM),
        "direction": When(("INCOMING", "CAUSTICS"), RAY_DIRECTION),
        "origin": When("ARRIVALS", RAY_ORIGIN),
    }
    outputs = {
        "landed": PLACE,
        "deposit": DEPOSIT,
        "caustic": When("CAUSTICS", PLACE),  # as landed, of those by way of lobes not diffuse
    }
    uniforms = {
        "numbered": Uniform("bool"),  # deposits tell their photons' numbers
        "bounce": Uniform("int"),
    }
    tables = {
        "triangles": When("MEDIA", Table(TRIANGLE)),
        "materials": When("MEDIA", Table(MATERIAL)),
        "interiors": When("MEDIA", Table(INTERIOR)),
        "lights": When("ARRIVALS", Table(LIGHT)),
        "environments": When("ENVIRONMENT", Table()),
        "visibility": When("LINKED", Table(VISIBILITY)),
    }
