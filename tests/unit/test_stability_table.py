# SPDX-License-Identifier: GPL-3.0-or-later
"""The stability table: its rows are tested, and it says what the tests said."""

from __future__ import annotations

import json
import re
from pathlib import Path

from tests.stability.rows import ROWS
from tests.stability.table import Measured, Table

TESTS = Path(__file__).parents[1]


def test_rows_have_tests() -> None:
    marked: set[int] = set()
    for path in TESTS.rglob("test_*.py"):
        for numbers in re.findall(r"mark\.stability\(([\d, ]+)\)", path.read_text("utf-8")):
            marked |= {int(number) for number in numbers.split(",")}
    assert marked == ROWS.keys()


def test_worst_figures_and_shortfalls_are_told(tmp_path: Path) -> None:
    table = Table()
    measured = Measured({number: table.rows[number] for number in (4, 5)})
    for error in (0.012, 0.018, 0.003):
        assert measured("edge", error, "%", row=4) == error
    measured("of 2e6 rays", 0)
    measured("limit", float("nan"), row=5)
    table.rows[4].passed = table.rows[5].passed = 1
    assert table.rows[4].result == "passed"
    measured.falls_short("leaks 0.3")
    table.rows[6].failed.append("test_crease")
    table.rows[7].skipped.append("no compute")
    records = {record["row"]: record for record in table.records()}
    assert records[4]["measured"] == "edge 1.8 %, of 2e6 rays 0"
    assert records[5]["measured"] == "of 2e6 rays 0, limit nan"
    assert records[4]["result"] == "does not hold: leaks 0.3"
    assert records[6]["result"] == "FAILED: test_crease"
    assert records[7]["result"] == "skipped: no compute"
    assert records[8]["result"] == "no test"
    lines = list(table.lines())
    assert lines[0].split() == ["row", "case", "expected", "measured", "result"]
    assert max(map(len, lines)) <= 150
    table.write(tmp_path / "table.json")
    assert json.loads((tmp_path / "table.json").read_text("utf-8"))[3]["row"] == 4
    table.write(tmp_path / "table.md")
    assert (tmp_path / "table.md").read_text("utf-8").count("\n") == 2 + len(ROWS)
