# SPDX-License-Identifier: GPL-3.0-or-later
from typing import Any

from ...streams import Kernel, Ports, Uniform, When
from .records import (
    BLUR,
    CHAIN,
    COVERAGE,
    DIFFUSE,
    GLOSS,
    HIT,
    ILLUMINANCE,
    ILLUMINANCE_SEEN,
    IRRADIANCE,
    LOST,
    PLACE,
    RADIANCE,
    RAY_DIRECTION,
    RAY_ORIGIN,
    SHADING,
    THROUGHPUT,
)
from .shade import GLOSSY

# What rays meet of lights and the world, in scenes where there is any to see.
_EMITTERS: Ports = {
    "emitted": When("EMITTERS", RADIANCE),
    "environment": When("EMITTERS", RADIANCE),
}
# The most of one sample, of direct light and of other, in the mean of the channels [W/(m^2 sr)].
_CLAMPS = {"clamps": When("CLAMPED", Uniform("vec2"))}


def _misty(what: Any) -> When:
    """What secondary rays ask for that may show mist behind transparent surfaces."""
    return When("MIST", When("TRANSPARENT", what))


class CombinePrimary(Kernel):
    """Split what the eye sees into the images direct, indirect, emission, background and normal; a
    PANORAMIC one may have no ray in a pixel."""

    stem = "combine_primary"
    structure = (
        "EMITTERS",
        "ILLUMINANCE",
        "PANORAMIC",
        "GATHERED_LOBES",
        "VISIBILITY",
        "PHOTON_MAP",
        "CLAMPED",
        "MEDIA",
        "MIST",
        "SCATTERING",
    )
    inputs = {
        "origin": When("SCATTERING", RAY_ORIGIN),
        "direction": When(("PANORAMIC", "SCATTERING"), RAY_DIRECTION),
        "hit": HIT,
        "end": When("SCATTERING", HIT),  # of the way, whether a medium scatters the ray or not
        "place": PLACE,
        "throughput": When("MEDIA", THROUGHPUT),
        "diffuse": DIFFUSE,
        "shading": SHADING,
        "direct": RADIANCE,
        "illuminance": When("ILLUMINANCE", ILLUMINANCE),
        "irradiance": IRRADIANCE,
        "coverage": COVERAGE,
        **_EMITTERS,
        **GLOSSY,
    }
    outputs = {
        "illuminance_seen": When("ILLUMINANCE", ILLUMINANCE_SEEN),
        "direct_seen": RADIANCE,
        "indirect_seen": RADIANCE,
        "emission_seen": When("EMITTERS", RADIANCE),
        "background_seen": RADIANCE,
        "normal_seen": RADIANCE,
        "mist_seen": When("MIST", RADIANCE),
        "blur_seen": When("PHOTON_MAP", BLUR),
    }
    uniforms = {
        "background_alpha": Uniform("float"),
        "eye": Uniform("vec3"),
        "view_axis": Uniform("vec3"),
        "mist": When("MIST", Uniform("vec4")),
        **_CLAMPS,
    }


class CombineMirror(Kernel):
    """What a secondary ray sees."""

    stem = "combine_mirror"
    structure = (
        "EMITTERS",
        "GATHERED_LOBES",
        "TRANSPARENT",
        "PHOTON_MAP",
        "CLAMPED",
        "MEDIA",
        "MIST",
        "WALKS",
    )
    inputs = {
        "hit": HIT,
        "diffuse": DIFFUSE,
        "direct": RADIANCE,
        "direction": When("CLAMPED", When("WALKS", RAY_DIRECTION)),
        "irradiance": IRRADIANCE,
        "coverage": COVERAGE,
        "throughput": THROUGHPUT,
        "arriving": When("MEDIA", THROUGHPUT),
        "chain": When("TRANSPARENT", CHAIN),
        "origin": _misty(RAY_ORIGIN),
        "place": _misty(PLACE),
        **_EMITTERS,
        **GLOSSY,
    }
    outputs = {
        "seen": RADIANCE,
        "indirect_seen": RADIANCE,
        "lost": When("TRANSPARENT", LOST),
        "mist_seen": _misty(RADIANCE),
        "blur_seen": When("PHOTON_MAP", BLUR),
    }
    uniforms = {
        "background_alpha": When("TRANSPARENT", Uniform("float")),
        "eye": _misty(Uniform("vec3")),
        "view_axis": _misty(Uniform("vec3")),
        "mist": _misty(Uniform("vec4")),
        "depth": When("CLAMPED", Uniform("int")),
        **_CLAMPS,
    }


class CombineCaustics(Kernel):
    """What a ray sees of light that photons brought by way of lobes that are not diffuse."""

    stem = "combine_caustics"
    structure = ("GATHERED_LOBES",)
    inputs = {
        "hit": HIT,
        "diffuse": DIFFUSE,
        "throughput": THROUGHPUT,
        "caustic_irradiance": IRRADIANCE,
        "caustic_gloss": When("GATHERED_LOBES", GLOSS),
    }
    outputs = {"caustics_seen": RADIANCE}


class CombineAll(Kernel):
    """Add the images up: combined = direct + indirect + mirror + emission + background."""

    stem = "combine_all"
    structure = ("EMITTERS",)
    inputs = {
        "direct_seen": RADIANCE,
        "indirect_seen": RADIANCE,
        "mirror_seen": RADIANCE,
        "mirror_indirect_seen": RADIANCE,
        "background_seen": RADIANCE,
        "emission_seen": When("EMITTERS", RADIANCE),
        "blur_seen": BLUR,
    }
    outputs = {"combined": RADIANCE}
