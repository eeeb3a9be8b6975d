# SPDX-License-Identifier: GPL-3.0-or-later
"""GGX against Cycles: the room of glossy_room.py, by block means, with no factor between the two.

The references come from make_glossy_references.py, which renders for half an hour.
"""

from __future__ import annotations

from collections.abc import Callable

import bpy
import numpy as np
import pytest

from addon.streams import Device
from tests.stability.table import Measured

from .cycles import render_loaded
from .glossy_room import CASES, SIZE, Case, open_room
from .make_glossy_references import load
from .rooms import assert_alike, assert_quiet, compare_room

pytestmark = pytest.mark.blender

PASSES, FEW_PASSES = 128, 40
ALWAYS = ("metal 0.05 sphere",)

Record = Callable[[str, object], None]


@pytest.mark.stability(64)
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_glossy_room_is_that_of_cycles(
    device: Device, case: Case, thorough: bool, measured: Measured, record_property: Record
) -> None:
    if not thorough and case.name not in ALWAYS:
        pytest.skip("runs with --stability")
    reference = load()[case.name].mean(axis=0, dtype=float)
    passes = PASSES if thorough else FEW_PASSES
    found = compare_room(device, open_room(case), reference, SIZE, passes)
    for what, value in (("median", found.median), ("95th", found.high), ("mean", found.bias)):
        record_property(what, value)
    assert_alike(case.name, found, measured)


def test_references_are_quiet() -> None:
    assert_quiet(load(), [case.name for case in CASES])


@pytest.mark.parametrize("case", [CASES[3], CASES[6]], ids=lambda case: case.name)
def test_references_are_what_cycles_renders(case: Case) -> None:
    """The picture's mean lies within the noise of a quick render."""
    stored = load()[case.name].mean(axis=(1, 2), dtype=float)  # (runs, 3)
    open_room(case)
    render_settings = bpy.context.scene.render
    render_settings.resolution_percentage = 50  # a box filter's mean is that of any resolution
    quick = np.array([render_loaded(64, 100 + seed).mean(axis=(0, 1)) for seed in range(4)], float)
    error = quick.std(axis=0, ddof=1) / 2
    mean = stored.mean(axis=0)
    print(f"\n{case.name}: {quick.mean(axis=0) / mean - 1}, standard error {error / mean}")
    assert (error < 0.01 * mean).all()
    # Student's t of 3 degrees of freedom: 99 % within 5.84 standard errors.
    assert (np.abs(quick.mean(axis=0) - mean) < 5.84 * error + 0.002 * mean).all()
