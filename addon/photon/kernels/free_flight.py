# SPDX-License-Identifier: GPL-3.0-or-later
from ...streams import Kernel, Table, Uniform, When
from ..settings import Settings
from ..stage.tables import Tables
from .media import VARYING_TABLES
from .records import (
    BEAM,
    FLUX,
    HIT,
    INTERIOR,
    MATERIAL,
    MEDIUM,
    PIXEL,
    RAY_DIRECTION,
    RAY_ORIGIN,
    THROUGHPUT,
    TRIANGLE,
)


def media_values(settings: Settings, tables: Tables) -> dict[str, float]:
    """What kernels are told of media."""
    return {
        "volume_bounces": settings.volume_bounces,
        "air": tables.media.air,
        "beam_count": tables.beam_count,
    }


class FreeFlight(Kernel):
    """What media leave of rays of the eye (EYE) and photons (PHOTONS), and where they scatter
    them."""

    stem = "free_flight"
    structure = ("EYE", "PHOTONS", "SCATTERING", "VARYING", "DISPERSION", "WALKS")
    inputs = {
        "pixel": When("EYE", When("SCATTERING", PIXEL)),
        "origin": RAY_ORIGIN,
        "direction": RAY_DIRECTION,
        "hit": HIT,
        "medium": MEDIUM,
        "throughput": When("EYE", THROUGHPUT),
        "flux": When("PHOTONS", FLUX),
    }
    outputs = {
        "left": When("EYE", THROUGHPUT),
        "carried": When("PHOTONS", FLUX),
        "along": MEDIUM,  # its way
        "met": When("SCATTERING", HIT),
    }
    uniforms = {
        "air": Uniform("float"),  # the number of what is everywhere, or 0
        "seed": When("SCATTERING", Uniform("uint")),
        "pass_index": When("SCATTERING", Uniform("uint", of_parts=True)),
        "depth": When("EYE", When("SCATTERING", Uniform("int"))),
        "frame_size": When("EYE", When("SCATTERING", Uniform("ivec2"))),
        "beam_count": When("EYE", When("SCATTERING", Uniform("int"))),
        "bounce": When("PHOTONS", Uniform("int")),
        "volume_bounces": When("PHOTONS", Uniform("int")),
    }
    tables = {
        "triangles": Table(TRIANGLE),
        "materials": Table(MATERIAL),
        "interiors": Table(INTERIOR),
        **VARYING_TABLES,
        "beams": When("EYE", When("SCATTERING", Table(BEAM))),
    }
