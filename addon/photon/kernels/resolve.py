# SPDX-License-Identifier: GPL-3.0-or-later
from ...streams import Kernel, Ports, Uniform, When
from .records import SUM

_SUMS: Ports = {
    "direct": SUM,
    "indirect": SUM,
    "mirror": When("MIRRORED", SUM),
    "mirror_indirect": When("MIRRORED", SUM),
}


class Resolve(Kernel):
    """Make the picture, with emission or without, and of its parts those that are not mere means,
    of the sums of passes."""

    stem = "resolve"
    structure = ("MIRRORED", "EMITTERS", "LEAST_COVERAGE")
    inputs = {**_SUMS, "background": SUM, "emission": When("EMITTERS", SUM)}
    outputs = {"picture": SUM, "indirect_part": SUM, "mirror_part": SUM}
    uniforms = {"passes": Uniform("float"), "of_emission": When("EMITTERS", Uniform("float"))}


class FirstHalf(Kernel):
    """Make the picture of half of the passes, of their sums and those of all."""

    stem = "first_half"
    structure = ("MIRRORED", "EMISSION_APART", "LEAST_COVERAGE")
    inputs = {
        **_SUMS,
        "half_combined": SUM,
        "half_emission": When("EMISSION_APART", SUM),
        "half_indirect": SUM,
        "half_mirror_indirect": When("MIRRORED", SUM),
    }
    outputs = {"first_half": SUM}
    uniforms = {"half_passes": Uniform("float")}


class ErrorParts(Kernel):
    """Of each pixel of the picture, relative squared errors: by noise, by blur (the change from the
    inner radius to the radius), the latter again where the disc is even and 0 elsewhere, and in the
    last channel whether light falls there and whether the disc is even."""

    stem = "error_parts"
    structure = (
        "MIRRORED",
        "BLURRED",
        "LEAST_COVERAGE",
        "LEAST_SQUARE",
        "INNER_AREA",
        "EVEN",
        "EVEN_COUNTS",
    )
    inputs = {
        "picture": SUM,
        "combined": SUM,
        "squares": SUM,
        "direct": When("BLURRED", SUM),
        "indirect": When("BLURRED", SUM),
        "blur": When("BLURRED", SUM),
        "mirror": When("MIRRORED", SUM),
        "mirror_indirect": When("MIRRORED", SUM),
    }
    outputs = {"parts": SUM}
    uniforms = {
        "passes": Uniform("float"),
        "of_squares": Uniform("float"),  # the variance of the mean over them
        "unit": Uniform("float"),
    }
