# SPDX-License-Identifier: GPL-3.0-or-later
"""GGX against Cycles: the room of glossy_room.py, by block means, with no factor between the two.

The references come from make_glossy_references.py, which renders for half an hour. A lamp of some
size is drawn by its own directions alone, so its image in the sharp metal stays noisy: of that
room the surfaces that send no mirror rays are compared, where its caustic falls.
"""

from __future__ import annotations

from collections.abc import Callable

import bpy
import numpy as np
import pytest

from addon.streams import Device
from tests.measure import render
from tests.stability.table import Measured

from .blocks import BLOCK, block_means, compare_means
from .cycles import render_loaded
from .glossy_room import CASES, SIZE, Case, open_room
from .make_glossy_references import load, noise

pytestmark = pytest.mark.blender

MEDIAN, HIGH = 0.01, 0.03  # relative, of blocks; HIGH at their 95th percentile
PASSES, FEW_PASSES, PHOTONS = 128, 40, 65536
ALWAYS = ("dielectric 0.2 point", "metal 0.5 point", "metal 0.05 sphere")

Record = Callable[[str, object], None]


@pytest.mark.stability(64)
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_glossy_room_is_that_of_cycles(
    device: Device, case: Case, thorough: bool, measured: Measured, record_property: Record
) -> None:
    if not thorough and case.name not in ALWAYS:
        pytest.skip("runs with --stability")
    exported = open_room(case)
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
    reference = load()[case.name].mean(axis=0, dtype=float)
    keep = np.ones(reference.shape[:2], bool)
    if case.light == "sphere":
        sends = images["Mirror"].max(axis=-1) > 0
        side = SIZE // BLOCK
        keep = ~sends.reshape(side, BLOCK, side, BLOCK).any(axis=(1, 3))
        assert 0.3 < keep.mean() < 0.9
    found = compare_means(block_means(images["Combined"][..., :3]), reference, keep)
    for what, value in (("median", found.median), ("95th", found.high), ("mean", found.bias)):
        record_property(what, value)
    print(f"\n{case.name}: median {found.median:.2%}, 95th {found.high:.2%}, mean {found.bias:.2%}")
    assert measured("blocks against Cycles' in the median", found.median, "%") <= MEDIAN
    assert measured("at the 95th percentile", found.high, "%") <= HIGH
    assert abs(found.bias) <= MEDIAN / 2


def test_references_are_quiet() -> None:
    """Runs of Cycles tell the noise of their mean: a third of what is asked of us at most."""
    runs = load()
    assert set(runs) == {case.name for case in CASES}
    for name, values in runs.items():
        found = noise(values)
        print(
            f"\n{name}: {len(values)} runs, {np.median(found):.2%}, {np.percentile(found, 95):.2%}"
        )
        assert len(values) >= 4 and np.isfinite(found).all()
        assert np.median(found) <= MEDIAN / 3
        assert np.percentile(found, 95) <= HIGH / 3


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
