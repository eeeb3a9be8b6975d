# SPDX-License-Identifier: GPL-3.0-or-later
from collections.abc import Mapping
from typing import Any

from ...streams import Kernel, Ports, Table, Uniform, When
from .media import VARYING_TABLES
from .records import (
    CHAIN,
    CONSTANT,
    CORNER_ATTRIBUTE,
    CORNER_NORMALS,
    CORNER_TANGENTS,
    DIFFUSE,
    FACING,
    FLUX,
    GATHERED,
    GLOSS,
    HIT,
    INSTRUCTION,
    INTERIOR,
    LOBE,
    MATERIAL,
    MATERIAL_LOBE,
    MEDIUM,
    PIXEL,
    PLACE,
    PORTAL,
    RAY_DIRECTION,
    RAY_ORIGIN,
    SHADING,
    SHAPE,
    SPACE,
    THROUGHPUT,
    TRIANGLE,
    VISIBILITY,
)

# What a point is, as Shade writes it.
POINT: Ports = {"place": PLACE, "facing": FACING, "shading": SHADING, "diffuse": DIFFUSE}
FIRST_LOBE: Ports = {"lobe0": When("LOBES", LOBE), "shape0": When("LOBES", SHAPE)}
LOBES: Ports = {
    **FIRST_LOBE,
    "lobe1": When("TWO_LOBES", LOBE),
    "shape1": When("TWO_LOBES", SHAPE),
}

# What gathering brings through lobes.
GLOSSY: Ports = {
    "gloss": When("GATHERED_LOBES", GLOSS),
    "gathered": When("GATHERED_LOBES", GATHERED),
}
_SEEN = ("SEEN_GATHERED_FROM", "SEEN_GATHERED_WHOLLY")
GATHERED_LOBES = ("GATHERED_LOBES", "GATHERED_FROM", "GATHERED_WHOLLY", *_SEEN)
# What kernels of photon maps ask where lobes that the eye sees gather otherwise: 0 of eye rays, 1
# of chains.
GATHERS_BY_DEPTH = {"depth": When(_SEEN, Uniform("int"))}


def depth_for(kernel: Kernel, in_chain: bool) -> dict[str, int]:
    """What GATHERS_BY_DEPTH is for points of secondary rays, or of eye rays, if it is asked."""
    return {"depth": int(in_chain)} if "depth" in kernel.uniforms else {}


# What programs of materials read. BUMPS: some bend normals by heights.
PROGRAM_DEFINES: tuple[str, ...] = ("PROGRAMS", "ATTRIBUTES", "TEXTURES", "NORMALS", "BUMPS")
PROGRAM_TABLES: Mapping[str, Any] = {
    "instructions": When("PROGRAMS", Table(INSTRUCTION)),
    "constants": When("PROGRAMS", Table(CONSTANT)),
    "spaces": When("PROGRAMS", Table(SPACE)),
    "corner_attributes": When("ATTRIBUTES", Table(CORNER_ATTRIBUTE)),
    "texels": When("TEXTURES", Table(kind="usampler2DArray")),
}


# PHASE: the number of the kind of lobe that media have where they scatter.
SCATTERS = ("SCATTERING", "PHASE")


class Shade(Kernel):
    """Evaluate the material where rays end, for the eye's (EYE) and photons (PHOTONS) alike."""

    stem = "shade"
    structure = (
        "EYE",
        "PHOTONS",
        "CONSERVING",
        "LOBES",
        "TWO_LOBES",
        "LAYERS",
        "TINTED",
        "TANGENTS",
        "TRANSMITS",
        "TRANSPARENT",
        *SCATTERS,
        "VARYING",
        "CHAINS",
        "DISPERSION",
        "DISPERSED_CHAINS",
        "DIRECTIONS",
        "VISIBILITY",
        "NO_CAUSTICS",
        "SUBSURFACE",
        "WALKS",
        *GATHERED_LOBES,
        *PROGRAM_DEFINES,
        "FOOTPRINT",  # bumps are as fine as the eye sees
        "PORTALS",  # of photons
        "ONE_WAY",
        "PORTALS_BY_SHARE",
        "MOST_BY_PORTAL",
        "WIDE_PORTAL",
    )
    inputs = {
        "pixel": When("EYE", PIXEL),
        "origin": When("SCATTERING", RAY_ORIGIN),
        "direction": RAY_DIRECTION,
        "hit": HIT,
        "medium": When("SCATTERING", MEDIUM),
        "flux": When("PHOTONS", FLUX),
        "chain": When("CHAINS", CHAIN),
        "throughput": When("DISPERSED_CHAINS", THROUGHPUT),
    }
    outputs = {**POINT, **LOBES}
    uniforms = {
        "seed": When("LOBES", Uniform("uint")),
        "pass_index": When("LOBES", Uniform("uint", of_parts=True)),
        "bounce": When("PHOTONS", Uniform("int")),
        "depth": When("EYE", Uniform("int")),
        "chain_depth": When("EYE", When("WALKS", Uniform("int"))),
        "frame_size": When("EYE", Uniform("ivec2")),
        "eye": When("FOOTPRINT", Uniform("vec3")),
        "view_axis": When("FOOTPRINT", Uniform("vec3")),
        # At the eye, by how much wider it is a unit farther, and whether the film is flat.
        "pixel_width": When("FOOTPRINT", Uniform("vec3")),
    }
    tables = {
        "triangles": Table(TRIANGLE),
        "corner_normals": Table(CORNER_NORMALS),
        "corner_tangents": When("TANGENTS", Table(CORNER_TANGENTS)),
        "materials": Table(MATERIAL),
        "material_lobes": When("LOBES", Table(MATERIAL_LOBE)),
        "interiors": When("SCATTERING", Table(INTERIOR)),
        **VARYING_TABLES,
        "visibility": When("VISIBILITY", Table(VISIBILITY)),
        "photon_portals": When("PORTALS_BY_SHARE", Table(PORTAL)),
        **PROGRAM_TABLES,
    }
