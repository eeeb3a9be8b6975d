# SPDX-License-Identifier: GPL-3.0-or-later
from ...streams import Kernel, Table, Uniform, When
from .lights import CHOICE, LIGHT_DEFINES, LIGHT_TABLES, PORTALS, WORLD_RAYS
from .media import VARYING_TABLES
from .records import (
    CHAIN,
    GLOW,
    HIT,
    INTERIOR,
    MATERIAL,
    MEDIUM,
    RADIANCE,
    RAY_DIRECTION,
    RAY_ORIGIN,
    THROUGHPUT,
    TRIANGLE,
    VISIBILITY,
)


class Emitted(Kernel):
    """Find the lights that rays meet, what surfaces emit where rays end, and the world behind."""

    stem = "emitted"
    structure = (
        "BY_KIND",
        "WEIGHED",
        "SHADOW_RAYS",
        "DRAWN",
        "EMISSIVE",
        "EMISSION_BY_PROGRAMS",
        "SURFACES",
        "SMOOTH",
        "TWO_SIDED",
        "TRANSPARENT",
        "MEDIA",
        "SCATTERING",
        "VARYING",
        "GLOWING",
        "DISPERSION",
        "PORTALS",
        "RAYS_APART",
        "LINKED",
        "WALKS",
        *LIGHT_DEFINES,
    )
    inputs = {
        "origin": RAY_ORIGIN,
        "direction": RAY_DIRECTION,
        "hit": HIT,
        "throughput": When("WEIGHED", THROUGHPUT),
        "emission": When("EMISSION_BY_PROGRAMS", RADIANCE),
        "chain": When("TRANSPARENT", CHAIN),
        "medium": When("MEDIA", MEDIUM),
    }
    outputs = {"emitted": RADIANCE, "environment": RADIANCE}
    uniforms = {
        "depth": Uniform("int"),
        "seen_lights": Uniform("int"),
        "light_count": Uniform("int"),
        "asked_lights": When("DRAWN", Uniform("int")),
        "light_leaves": When("DRAWN", Uniform("int")),
        **WORLD_RAYS,
        "lamps": When("EMISSIVE", Uniform("int")),
    }
    tables = {
        **LIGHT_TABLES,
        **CHOICE,
        **PORTALS,
        "triangles": When(("SURFACES", "MEDIA", "LINKED"), Table(TRIANGLE)),
        "visibility": When("LINKED", Table(VISIBILITY)),
        "materials": When(("EMISSIVE", "TWO_SIDED", "MEDIA"), Table(MATERIAL)),
        "interiors": When("MEDIA", Table(INTERIOR)),
        **VARYING_TABLES,
        "glows": When("GLOWING", Table(GLOW)),
    }
