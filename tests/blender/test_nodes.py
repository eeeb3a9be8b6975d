# SPDX-License-Identifier: GPL-3.0-or-later
"""Every node alone, over its options, against Cycles: 99 % of pixels within 1 %."""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import pytest

from .node_cases import Case, first_of_each, lay_out, render_sheet, wrong_pixels
from .node_sheets import LONG, SHEETS

pytestmark = pytest.mark.blender

MOST_WRONG = 0.01  # of a case's pixels


def compare(export, cycles_mean, device, layer: str, cases: Sequence[Case]) -> None:
    """Each case's square, rendered in a way."""
    columns, rows = lay_out(cases)
    scene, report = export()
    bpy.context.scene.cycles.max_bounces = 0
    assert not [str(e) for e in report.entries if e.status != "exact"]
    ours = render_sheet(device, scene, columns, rows, layer)
    cycles = cycles_mean(1, 0)[..., :3]
    wrong = wrong_pixels(cases, columns, ours, cycles)
    bad = {name: f"{share:.1%}" for name, share in wrong.items() if share > MOST_WRONG}
    assert not bad, "\n".join(f"{name}: {share}" for name, share in bad.items())


@pytest.mark.parametrize("sheet", SHEETS)
def test_every_option(export, cycles_mean, device, sheet) -> None:
    compare(export, cycles_mean, device, "fragment", SHEETS[sheet])


@pytest.mark.thorough
@pytest.mark.parametrize("sheet", LONG)
def test_every_combination(export, cycles_mean, device, sheet) -> None:
    compare(export, cycles_mean, device, "fragment", LONG[sheet])


@pytest.mark.parametrize("layer", ["compute", "native"])
def test_other_ways(export, cycles_mean, device, layer) -> None:
    """One case of each node."""
    compare(export, cycles_mean, device, layer, first_of_each(SHEETS))
