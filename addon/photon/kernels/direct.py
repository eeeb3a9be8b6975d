# SPDX-License-Identifier: GPL-3.0-or-later
"""Direct light at visible points: one kernel that traces its shadow rays itself, or, for devices
whose rays the host traces, what aims them and what sends them on."""

from ...streams import Kernel, Table, Uniform, When
from ...streams.declaration import Ports
from .lights import CHOICE, LIGHT_DEFINES, LIGHT_TABLES, LIMITS, PORTALS, WORLD_RAYS
from .media import VARYING_TABLES
from .records import (
    CHAIN,
    CORNER_NORMALS,
    HIT,
    ILLUMINANCE,
    INTERIOR,
    MATERIAL,
    MEDIUM,
    NODE,
    PIXEL,
    RADIANCE,
    RAY_DIRECTION,
    RAY_ORIGIN,
    TRIANGLE,
    VISIBILITY,
)
from .shade import GATHERED_LOBES, LOBES, POINT, PROGRAM_DEFINES, PROGRAM_TABLES, SCATTERS

_STRUCTURE = (
    "SHADOW_RAYS",
    "DRAWN",
    "SHADOW_RAYS_BY_LOBES",
    "LOBES",
    "TWO_LOBES",
    "TINTED",
    "WEIGHED",
    "ILLUMINANCE",
    "SMOOTH",
    "TWO_SIDED",
    "NORMALS",
    "TRANSPARENT",
    *GATHERED_LOBES,
    *LIGHT_DEFINES,
    *PROGRAM_DEFINES,
    "VISIBILITY",
    "LINKED",
    "PORTALS",
    "PANES",
    "MEDIA",
    "WALKS",
    *SCATTERS,
)
_INPUTS: Ports = {
    "pixel": PIXEL,
    **POINT,
    "direction": RAY_DIRECTION,
    "chain": When("TRANSPARENT", CHAIN),
    "hit": When("MEDIA", HIT),
    "medium": When("MEDIA", MEDIUM),
    **LOBES,
}
_UNIFORMS = {
    "seed": Uniform("uint"),
    "pass_index": Uniform("uint", of_parts=True),
    "depth": Uniform("int"),
    "chain_depth": When("WEIGHED", Uniform("int")),
    "asked_lights": When("DRAWN", Uniform("int")),
    "light_leaves": When("DRAWN", Uniform("int")),
    **WORLD_RAYS,
    "frame_size": Uniform("ivec2"),
}


LOOKS = ("FIRST_LOOK", "SECOND_LOOK")  # where nodes tell what shadow rays pass


class Direct(Kernel):
    """Add what lights send to each visible point and on to the viewer, by shadow rays."""

    stem = "direct"
    structure = (*_STRUCTURE, *LOOKS, "SHADED_LAMPS", "VARYING")
    records = (RAY_ORIGIN, RAY_DIRECTION, HIT, MEDIUM)
    inputs = {
        **_INPUTS,
        "looked": When("SECOND_LOOK", RADIANCE),
        "looked_lux": When("SECOND_LOOK", When("ILLUMINANCE", ILLUMINANCE)),
    }
    outputs = {"direct": RADIANCE, "illuminance": When("ILLUMINANCE", ILLUMINANCE)}
    uniforms = {
        **_UNIFORMS,
        "transparent_depth": When("TRANSPARENT", Uniform("int")),
        "air": When("MEDIA", Uniform("float")),  # the number of what is everywhere, or 0
    }
    tables = {
        "nodes": Table(NODE),
        "triangles": Table(TRIANGLE),
        **LIGHT_TABLES,
        **LIMITS,
        **CHOICE,
        **PORTALS,
        "materials": When(("TWO_SIDED", "TRANSPARENT", "PANES", "MEDIA"), Table(MATERIAL)),
        "interiors": When("MEDIA", Table(INTERIOR)),
        **VARYING_TABLES,
        "visibility": When("VISIBILITY", Table(VISIBILITY)),
        "corner_normals": When(("SMOOTH", "PROGRAMS", "PANES"), Table(CORNER_NORMALS)),
        **PROGRAM_TABLES,
    }


class ShadowRays(Kernel):
    """Aim a shadow ray of each visible point, and say what light it would find."""

    stem = "shadow_rays"
    structure = _STRUCTURE
    inputs = _INPUTS
    outputs = {
        "shadow_origin": RAY_ORIGIN,
        "shadow_direction": RAY_DIRECTION,
        "unshadowed": RADIANCE,
        "unshadowed_behind": When("PANES", RADIANCE),
        "unshadowed_lux": When("ILLUMINANCE", ILLUMINANCE),
        "shadow_medium": When("MEDIA", MEDIUM),
    }
    uniforms = {
        **_UNIFORMS,
        "number": Uniform("int"),
        "by_lobe": When("SHADOW_RAYS_BY_LOBES", Uniform("int")),
    }
    tables = {
        **LIGHT_TABLES,
        **LIMITS,
        **CHOICE,
        **PORTALS,
        "visibility": When("LINKED", Table(VISIBILITY)),
        "triangles": When(("SMOOTH", "TWO_SIDED", "MEDIA"), Table(TRIANGLE)),
        "materials": When(("TWO_SIDED", "MEDIA"), Table(MATERIAL)),
        "interiors": When("MEDIA", Table(INTERIOR)),
        "corner_normals": When("SMOOTH", Table(CORNER_NORMALS)),
    }


class ShadowThrough(Kernel):
    """Send shadow rays on that have met transparent surfaces or glass, behind these."""

    stem = "shadow_through"
    structure = ("ILLUMINANCE", "TRANSPARENT", "PANES", "MEDIA", "VARYING", *PROGRAM_DEFINES)
    uniforms = {
        "passed": Uniform("int"),
        "transparent_depth": When("TRANSPARENT", Uniform("int")),
    }
    inputs = {
        "shadow_origin": RAY_ORIGIN,
        "shadow_direction": RAY_DIRECTION,
        "shadow_hit": HIT,
        "unshadowed": RADIANCE,
        "unshadowed_behind": When("PANES", RADIANCE),
        "unshadowed_lux": When("ILLUMINANCE", ILLUMINANCE),
        "chain": When("TRANSPARENT", CHAIN),  # of the rays' points
        "shadow_medium": When("MEDIA", MEDIUM),
    }
    outputs = {
        "next_origin": RAY_ORIGIN,
        "next_direction": RAY_DIRECTION,
        "next_unshadowed": RADIANCE,
        "next_unshadowed_behind": When("PANES", RADIANCE),
        "next_unshadowed_lux": When("ILLUMINANCE", ILLUMINANCE),
        "next_medium": When("MEDIA", MEDIUM),
    }
    tables = {
        "triangles": Table(TRIANGLE),
        "materials": Table(MATERIAL),
        "interiors": When("MEDIA", Table(INTERIOR)),
        **VARYING_TABLES,
        "corner_normals": When(("PROGRAMS", "PANES"), Table(CORNER_NORMALS)),
        **PROGRAM_TABLES,
    }


class ShadowLeft(Kernel):
    """Find what media leave of the light that shadow rays bring which meet nothing."""

    stem = "shadow_left"
    structure = ("VARYING",)
    inputs = {
        "shadow_origin": RAY_ORIGIN,
        "shadow_direction": RAY_DIRECTION,
        "shadow_medium": MEDIUM,
    }
    outputs = {"left": RADIANCE}
    records = (HIT,)
    tables = {
        "triangles": Table(TRIANGLE),
        "materials": Table(MATERIAL),
        "interiors": Table(INTERIOR),
        **VARYING_TABLES,
    }
