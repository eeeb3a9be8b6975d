# SPDX-License-Identifier: GPL-3.0-or-later
"""Motion blur of objects against Cycles: moving_room.py by block means, with no factor between.

The references come from make_moving_references.py.
"""

from __future__ import annotations

import pytest

from addon.streams import Device
from tests.stability.table import Measured

from .make_glossy_references import load
from .make_moving_references import FILE
from .moving_room import CASES, SIZE, open_case
from .rooms import assert_alike, assert_quiet, compare_room

pytestmark = pytest.mark.blender

PASSES = 256


@pytest.mark.stability(74)
@pytest.mark.parametrize("case", CASES)
def test_what_moves_is_that_of_cycles(
    device: Device, case: str, thorough: bool, measured: Measured
) -> None:
    if not thorough:
        pytest.skip("runs with --stability")
    reference = load(FILE)[case].mean(axis=0, dtype=float)
    found = compare_room(device, open_case(case), reference, SIZE, PASSES)
    assert_alike(case, found, measured)


def test_references_are_quiet() -> None:
    assert_quiet(load(FILE), CASES)
