# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials' programs as tables, and in snapshots."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from addon.photon.errors import SceneError
from addon.photon.scene import Instruction, Material, Result, Scene
from addon.photon.scene.programs import Constant, Rows
from addon.photon.stage import straight
from addon.photon.stage.programs import program_tables
from tests.scenes import cornell

HALF: Constant = (0.5, 0.5, 0.5, 1.0)
ROWS = Rows(((1.0, 2.0, 3.0, 4.0), HALF, (5.0, 6.0, 7.0, 8.0)))
HOW: Constant = (1.0, 0.0, 0.0, 0.0)


def looking_up(rows: Rows) -> Material:
    """Two looks at a table."""
    first = Instruction("ramp", (HALF, rows, HOW))
    second = Instruction("ramp", (Result(0, "x"), rows, HOW))
    return Material("Ramp", program=(first, second), varying={"diffuse": Result(1)})


def test_rows_stand_together_and_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        straight, "MOST_INSTRUCTIONS", 0
    )  # the interpreter's instructions say where
    tables = program_tables([looking_up(ROWS), looking_up(ROWS)])
    constants = tables.constants["value"]
    for code in tables.instructions["second"]:
        first, count, *_ = constants[int(-1 - code)]
        found = constants[int(first) : int(first + count)]
        assert [tuple(row) for row in found] == [*ROWS.rows]
    given = 2 * (3 + 2)  # constants of two materials, among them those that stand for rows
    assert len(constants) == given + len(ROWS.rows)


def test_snapshots_keep_programs(tmp_path: Path) -> None:
    scene = replace(cornell(), materials=(looking_up(ROWS),) * len(cornell().materials))
    scene.save(tmp_path / "scene.npz")
    assert Scene.load(tmp_path / "scene.npz").materials == scene.materials


def test_rows_are_finite() -> None:
    with pytest.raises(SceneError, match="instruction 0, ramp"):
        looking_up(Rows((HALF, (0.0, float("nan"), 0.0, 0.0)))).check()
