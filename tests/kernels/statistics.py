# SPDX-License-Identifier: GPL-3.0-or-later
"""Chi-square tests without scipy. Seeds are fixed, so nothing flakes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

# Of the standard normal distribution: exceeded with probability 1e-4.
Z_1E4 = 3.719


def critical(freedom: int) -> float:
    """The chi-square value exceeded with probability 1e-4 (Wilson & Hilferty 1931)."""
    a = 2.0 / (9.0 * freedom)
    return freedom * (1.0 - a + Z_1E4 * math.sqrt(a)) ** 3


def excess(observed: Any, expected: Any) -> float:
    """Chi-square of counts over its critical value: above 1 means another distribution.

    Cells that expect fewer than 10 are lumped together.
    """
    observed, expected = np.ravel(observed).astype(float), np.ravel(expected).astype(float)
    assert abs(observed.sum() / expected.sum() - 1) < 1e-3, "not the same number of samples"
    rare = expected < 10
    if rare.any():
        observed = np.append(observed[~rare], observed[rare].sum())
        expected = np.append(expected[~rare], expected[rare].sum())
        if expected[-1] < 1:
            assert observed[-1] <= 12, "samples where none can be"
            observed, expected = observed[:-1], expected[:-1]
    chi2 = ((observed - expected) ** 2 / expected).sum()
    return float(chi2 / critical(len(expected) - 1))
