# SPDX-License-Identifier: GPL-3.0-or-later
from ...streams import Kernel, Uniform
from .records import BLUR, COVERAGE, DIFFUSE, HIT, IRRADIANCE, PLACE, RADIANCE, SHADING, THROUGHPUT


class CombinePrimary(Kernel):
    """Split what the eye sees into the images direct, indirect, background and normal."""

    stem = "combine_primary"
    inputs = {
        "hit": HIT,
        "place": PLACE,
        "diffuse": DIFFUSE,
        "shading": SHADING,
        "direct": RADIANCE,
        "irradiance": IRRADIANCE,
        "coverage": COVERAGE,
    }
    outputs = {
        "direct_seen": RADIANCE,
        "indirect_seen": RADIANCE,
        "background_seen": RADIANCE,
        "normal_seen": RADIANCE,
    }
    uniforms = {
        "ambient": Uniform("vec3"),
        "background": Uniform("vec3"),
        "background_alpha": Uniform("float"),
        "eye": Uniform("vec3"),
        "view_axis": Uniform("vec3"),
    }


class CombineMirror(Kernel):
    """Add what a secondary ray sees to the mirror image."""

    stem = "combine_mirror"
    inputs = {
        "sum": RADIANCE,
        "indirect_sum": RADIANCE,
        "hit": HIT,
        "diffuse": DIFFUSE,
        "direct": RADIANCE,
        "irradiance": IRRADIANCE,
        "coverage": COVERAGE,
        "throughput": THROUGHPUT,
    }
    outputs = {"total": RADIANCE, "indirect_total": RADIANCE}
    uniforms = {"ambient": Uniform("vec3"), "background": Uniform("vec3")}


class CombineAll(Kernel):
    """Add the images up: combined = direct + indirect + mirror + background."""

    stem = "combine_all"
    inputs = {
        "direct_seen": RADIANCE,
        "indirect_seen": RADIANCE,
        "mirror_seen": RADIANCE,
        "mirror_indirect_seen": RADIANCE,
        "background_seen": RADIANCE,
        "blur_seen": BLUR,
    }
    outputs = {"combined": RADIANCE}
