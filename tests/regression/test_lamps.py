# SPDX-License-Identifier: GPL-3.0-or-later
"""A lamp of each kind against Cycles: lamp_room.py by block means, with no factor between the two.

The references come from make_lamp_references.py.
"""

from __future__ import annotations

import numpy as np
import pytest

from addon.streams import Device
from tests.stability.table import Measured

from .lamp_room import CASES, DEFAULT, SIZE, open_case
from .make_glossy_references import load
from .make_lamp_references import FILE
from .rooms import MEDIAN, assert_alike, assert_quiet, compare_room

pytestmark = pytest.mark.blender

PASSES, FEW_PASSES = 256, 48
ALWAYS = (DEFAULT,)


@pytest.mark.stability(76)
@pytest.mark.parametrize("case", CASES)
def test_lamps_are_those_of_cycles(
    device: Device, case: str, thorough: bool, measured: Measured
) -> None:
    if not thorough and case not in ALWAYS:
        pytest.skip("runs with --stability")
    reference = load(FILE)[case].mean(axis=0, dtype=float)
    keep = None
    if case == DEFAULT:  # most of which is the world
        keep = np.abs(reference / reference[0, 0] - 1).max(axis=-1) > MEDIAN
    passes = PASSES if thorough else FEW_PASSES
    found = compare_room(device, open_case(case), reference, SIZE, passes, keep)
    assert_alike(case, found, measured)


def test_references_are_quiet() -> None:
    assert_quiet(load(FILE), CASES)
