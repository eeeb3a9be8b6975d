# SPDX-License-Identifier: GPL-3.0-or-later
"""The tests' own test: the chi-square test accepts what is right and rejects what is not."""

from __future__ import annotations

import numpy as np
import pytest

from tests.kernels.statistics import critical, excess


# From tables of the chi-square distribution.
@pytest.mark.parametrize(("freedom", "value"), [(10, 35.56), (30, 67.63), (100, 161.32)])
def test_critical_values(freedom: int, value: float) -> None:
    assert critical(freedom) == pytest.approx(value, rel=0.02)


def test_accepts_and_rejects() -> None:
    rng = np.random.default_rng(0)
    u = rng.random(1_000_000)
    uniform = np.full(100, 10_000.0)
    assert excess(np.histogram(u, 100, (0, 1))[0], uniform) < 1
    assert excess(np.histogram(u**1.01, 100, (0, 1))[0], uniform) > 1
