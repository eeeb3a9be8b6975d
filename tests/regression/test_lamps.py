# SPDX-License-Identifier: GPL-3.0-or-later
"""A lamp of each kind against Cycles: lamp_room.py by block means, with no factor between the two.

The references come from make_lamp_references.py.
"""

from __future__ import annotations

import numpy as np
import pytest

from addon.streams import Device
from tests.measure import render
from tests.stability.table import Measured

from .blocks import block_means, compare_means
from .lamp_room import CASES, DEFAULT, SIZE, open_case
from .make_glossy_references import load, noise
from .make_lamp_references import FILE

pytestmark = pytest.mark.blender

MEDIAN, HIGH = 0.01, 0.03  # relative, of blocks; HIGH at their 95th percentile
PASSES, FEW_PASSES, PHOTONS = 256, 48, 65536
ALWAYS = ("softbox", "soft point", DEFAULT)


@pytest.mark.stability(66)
@pytest.mark.parametrize("case", CASES)
def test_lamps_are_those_of_cycles(
    device: Device, case: str, thorough: bool, measured: Measured
) -> None:
    if not thorough and case not in ALWAYS:
        pytest.skip("runs with --stability")
    exported = open_case(case)
    images = render(
        device,
        exported,
        width=SIZE,
        height=SIZE,
        passes=PASSES if thorough else FEW_PASSES,
        photons=PHOTONS,
        radius_shrink=2 / 3,
        mirror_depth=32,
    )
    reference = load(FILE)[case].mean(axis=0, dtype=float)
    keep = np.ones(reference.shape[:2], bool)
    if case == DEFAULT:  # most of which is the world
        keep = np.abs(reference / reference[0, 0] - 1).max(axis=-1) > MEDIAN
    found = compare_means(block_means(images["Combined"][..., :3]), reference, keep)
    print(f"\n{case}: median {found.median:.2%}, 95th {found.high:.2%}, mean {found.bias:.2%}")
    assert measured("blocks against Cycles' in the median", found.median, "%") <= MEDIAN
    assert measured("at the 95th percentile", found.high, "%") <= HIGH
    assert abs(found.bias) <= MEDIAN / 2


def test_references_are_quiet() -> None:
    """Runs of Cycles tell the noise of their mean: a third of what is asked of us at most."""
    runs = load(FILE)
    assert set(runs) == set(CASES)
    for name, values in runs.items():
        found = noise(values)
        print(f"\n{name}: {np.median(found):.2%}, {np.percentile(found, 95):.2%}")
        assert len(values) >= 4 and np.isfinite(found).all()
        assert np.median(found) <= MEDIAN / 3
        assert np.percentile(found, 95) <= HIGH / 3
