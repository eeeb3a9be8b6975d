# SPDX-License-Identifier: GPL-3.0-or-later
"""The mixture of a picture and of what a denoiser makes of its halves: native/src/mixture.rs on the
device."""

from ...streams import Kernel, Table, Uniform, When
from .records import SUM


class SplitHalves(Kernel):
    """What a denoiser is given: both halves of a picture, of its passes that share which are the
    first half, and the features' means of sums of all passes."""

    stem = "split_halves"
    inputs = {"picture": SUM, "half": SUM, "albedo_sum": SUM, "normal_sum": SUM}
    outputs = {"first": SUM, "other": SUM, "albedo": SUM, "normal": SUM}
    uniforms = {
        "share": Uniform("float"),
        "unit": Uniform("float"),  # the light that is 1 to the denoiser
        "passes": Uniform("float"),
    }


class FiltersCompared(Kernel):
    """The means of what two filters make of both halves, and how much farther from the truth they
    are than what the first one does."""

    stem = "filters_compared"
    inputs = {
        "first": SUM,
        "other": SUM,
        "clean": SUM,
        "other_clean": SUM,
        "second_clean": SUM,
        "second_other_clean": SUM,
    }
    outputs = {"mean": SUM, "other_mean": SUM, "worse": SUM}
    uniforms = {"floor_light": Uniform("float")}  # what is darker is dark [the denoiser's unit]


class MixtureTold(Kernel):
    """What the halves tell of each pixel: noise, gained, apart, and the square of what speaks for
    the plain picture."""

    stem = "mixture_told"
    inputs = {"picture": SUM, "half": SUM, "clean": SUM, "other_clean": SUM}
    outputs = {"told": SUM}
    uniforms = {
        "share": Uniform("float"),
        "unit": Uniform("float"),
        "floor_light": Uniform("float"),  # of the denoised picture, what is darker is dark
    }


class BoxMean(Kernel):
    """The mean over a line of `reach` pixels to each side of each, as far as there are: along x,
    and along y of that."""

    stem = "box_mean"
    outputs = {"mean": SUM}
    uniforms = {"reach": Uniform("int"), "along": Uniform("ivec2")}
    tables = {"image": Table()}


class MixtureKept(Kernel):
    """How much of the plain picture is kept, by the means of what was told."""

    stem = "mixture_kept"
    inputs = {"told": SUM}
    outputs = {"kept": SUM}
    uniforms = {"reach": Uniform("int")}


class Mixture(Kernel):
    """The mixture, by the mean of what is kept, and what is not denoised; and how much of the noise
    is left, beside how much there was."""

    stem = "mixture"
    structure = ("EMISSION_APART",)
    inputs = {
        "picture": SUM,
        "clean": SUM,
        "other_clean": SUM,
        "kept": SUM,
        "told": SUM,
        "emission": When("EMISSION_APART", SUM),
    }
    outputs = {"mixed": SUM, "left": SUM}
    uniforms = {
        "share": Uniform("float"),
        "unit": Uniform("float"),
        "passes": When("EMISSION_APART", Uniform("float")),
    }
