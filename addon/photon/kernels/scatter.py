# SPDX-License-Identifier: GPL-3.0-or-later
from ...streams import Kernel, Table, Uniform, When
from .records import (
    CHAIN,
    CORNER_NORMALS,
    DIFFUSE,
    FACING,
    HIT,
    INTERIOR,
    MATERIAL,
    MEDIUM,
    PIXEL,
    PLACE,
    RAY_DIRECTION,
    RAY_ORIGIN,
    SHADING,
    THROUGHPUT,
    TRIANGLE,
    WALK,
)
from .shade import GATHERED_LOBES, LOBES, SCATTERS


class Scatter(Kernel):
    """Send the secondary rays of lobes (Marino & Abbate, mirror pass)."""

    stem = "scatter"
    structure = (
        "LOBES",
        "TWO_LOBES",
        "TINTED",
        "WEIGHED",
        "TRANSPARENT",
        "MEDIA",
        *SCATTERS,
        "DISPERSION",
        "VISIBILITY",
        "NO_CAUSTICS",
        "NORMALS",
        "SUBSURFACE",
        "WALKS",
        *GATHERED_LOBES,
    )
    inputs = {
        "pixel": PIXEL,
        "place": PLACE,
        "facing": FACING,
        "diffuse": DIFFUSE,
        "shading": SHADING,
        "direction": RAY_DIRECTION,
        "throughput": THROUGHPUT,
        "hit": When(("TRANSPARENT", "MEDIA"), HIT),
        "medium": When("MEDIA", MEDIUM),
        "chain": When("TRANSPARENT", CHAIN),
        **LOBES,
    }
    outputs = {
        "next_origin": RAY_ORIGIN,
        "next_direction": RAY_DIRECTION,
        "next_throughput": THROUGHPUT,
        "next_chain": When("TRANSPARENT", CHAIN),
        "next_medium": When("MEDIA", MEDIUM),
        "walk": When("WALKS", WALK),
    }
    uniforms = {
        "seed": Uniform("uint"),
        "pass_index": Uniform("uint", of_parts=True),
        "depth": Uniform("int"),
        "volume_bounces": When("SCATTERING", Uniform("int")),
        "chain_depth": When("TRANSPARENT", Uniform("int")),
        "transparent_depth": When("TRANSPARENT", Uniform("int")),
        "frame_size": Uniform("ivec2"),
    }
    tables = {
        "triangles": When(("MEDIA", "NORMALS"), Table(TRIANGLE)),
        "corner_normals": When("NORMALS", Table(CORNER_NORMALS)),
        "materials": When("MEDIA", Table(MATERIAL)),
        "interiors": When("MEDIA", Table(INTERIOR)),
    }
