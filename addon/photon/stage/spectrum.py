# SPDX-License-Identifier: GPL-3.0-or-later
"""Wavelengths for paths that meet what disperses light, and what colour each has."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...streams import Made

BANDS = 32  # as probable as each other
SHORTEST, LONGEST = 0.4, 0.7  # [um]
_STEP = 1e-4  # of integrals [um]
# A lobe's packed weight has colours up to 4 in steps of this: so none is rounded there, and the sum
# stays white to the bit (glsl/lib/lobe_weight.glsl).
WEIGHT_STEP = 4.0 / 511.0
# CIE 1931's matching functions: height, middle [um], and 1 / standard deviation below and above it
# (Wyman, Sloan & Shirley 2013, "Simple Analytic Approximations to the CIE XYZ Color Matching
# Functions", multi-lobe fit).
_X = (
    (0.362, 0.4420, 62.4, 37.4),
    (1.056, 0.5998, 26.4, 32.3),
    (-0.065, 0.5011, 49.0, 38.2),
)
_Y = ((0.821, 0.5688, 21.3, 24.7), (0.286, 0.5309, 61.3, 32.2))
_Z = ((1.217, 0.4370, 84.5, 27.8), (0.681, 0.4590, 38.5, 72.5))
_SRGB = (  # from XYZ, linear
    (3.2404542, -1.5371385, -0.4985314),
    (-0.9692660, 1.8760108, 0.0415560),
    (0.0556434, -0.2040259, 1.0572252),
)


@cache
def bands() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(BANDS + 1,) where they begin and end [um], and (BANDS, 3) the colour of each, linear RGB.

    Colours are that of the wavelength without what no screen shows, scaled so that their mean is
    white; a band is as wide as makes the mean of its channels 1.
    """
    edges = np.linspace(SHORTEST, LONGEST, round((LONGEST - SHORTEST) / _STEP) + 1)
    middle = 0.5 * (edges[1:] + edges[:-1])
    xyz = [np.sum([_bell(middle, *lobe) for lobe in lobes], axis=0) for lobes in (_X, _Y, _Z)]
    shown = np.clip(np.array(_SRGB) @ xyz, 0.0, None)
    up_to = np.zeros((3, len(edges)))
    up_to[:, 1:] = np.cumsum(shown / shown.sum(axis=1, keepdims=True), axis=1)
    shares = np.linspace(0.0, 1.0, BANDS + 1)
    ends = np.interp(shares, up_to.mean(axis=0), edges)
    colours: NDArray[np.float64] = np.diff([np.interp(ends, edges, x) for x in up_to]).T
    return ends, _in_steps(BANDS * colours)


def made_spectrum() -> Made:
    """What a program includes as made/spectrum.glsl."""
    ends, colours = bands()
    numbers = ", ".join(f"{end:.9g}" for end in ends)
    texts = ", ".join("vec3({:.9g}, {:.9g}, {:.9g})".format(*colour) for colour in colours)
    lines = [
        f"const int BANDS = {BANDS};",
        f"const float BAND_ENDS[{BANDS + 1}] = float[{BANDS + 1}]({numbers});",
        f"const vec3 BAND_COLOURS[{BANDS}] = vec3[{BANDS}]({texts});",
    ]
    return {"made/spectrum.glsl": "\n".join(lines) + "\n"}


def _bell(at: NDArray[np.float64], height: float, middle: float, below: float, above: float) -> Any:
    """A normal curve of two widths."""
    return height * np.exp(-0.5 * ((at - middle) * np.where(at < middle, below, above)) ** 2)


def _in_steps(colours: NDArray[np.float64]) -> NDArray[np.float64]:
    """Colours as multiples of WEIGHT_STEP whose mean is 1 still: those are rounded up that are the
    farthest from what they would be rounded down to."""
    steps = np.floor(colours / WEIGHT_STEP)
    missing = np.rint(len(colours) / WEIGHT_STEP - steps.sum(axis=0)).astype(int)
    for channel, count in enumerate(missing):
        left = colours[:, channel] / WEIGHT_STEP - steps[:, channel]
        steps[np.argsort(-left, kind="stable")[:count], channel] += 1.0
    exact: NDArray[np.float64] = steps * WEIGHT_STEP
    return exact
