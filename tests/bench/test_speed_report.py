# SPDX-License-Identifier: GPL-3.0-or-later
"""The benchmark's numbers in words, its tables, and its files."""

from __future__ import annotations

import json
import math
from pathlib import Path
from xml.etree import ElementTree

import pytest

from .speed.passes import Way
from .speed.report import Report, Table, amount, bar_chart, digits, duration, without_nan


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (3.362e9, "3.36 Grays/s"),
        (141e6, "141 Mrays/s"),
        (999.9e3, "1.00 Mrays/s"),
        (9.996, "10.0 rays/s"),
        (0.0, "0 rays/s"),
        (math.nan, "-"),
    ],
)
def test_amounts(value: float, text: str) -> None:
    assert amount(value, "rays/s") == text


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (16.92, "16.9 s"),
        (151.2, "151 s"),
        (0.0134, "13.4 ms"),
        (0.99999, "1.00 s"),
        (2.34e-6, "2.34 µs"),
        (0.0, "0 µs"),
        (math.inf, "-"),
    ],
)
def test_durations(seconds: float, text: str) -> None:
    assert duration(seconds) == text


def test_digits_never_use_powers_of_ten() -> None:
    assert [digits(x) for x in (12345.0, 123.4, 12.34, 1.234, 0.01234)] == [
        "12345", "123", "12.3", "1.23", "0.0123",
    ]  # fmt: skip


def test_tables_in_text_and_markdown() -> None:
    table = Table("Title", ("what", "long head"))
    table.add("a", 1)
    table.add("longer", "22|2")
    table.note("a note")
    assert table.text() == (
        "Title\n  what    long head\n  a               1\n  longer       22|2\n  (a note)"
    )
    assert table.markdown() == (
        "**Title**\n\n| what | long head |\n| --- | ---: |\n"
        "| a | 1 |\n| longer | 22\\|2 |\n\n- a note"
    )
    with pytest.raises(AssertionError):
        table.add("too few")


def test_report_writes_three_files(tmp_path: Path) -> None:
    report = Report(tmp_path / "bench")
    report.say("here & now")
    report.table("Empty", "a").add("b")
    report.data["x"] = {"nan": math.nan, "list": [math.inf, 1.5, (2, 3)]}
    report.bars_title, report.bars = "a < b", [("native gather", 0.5), ("compute splat", 12.0)]
    report.write()
    data = json.loads((tmp_path / "bench" / "bench.json").read_text())
    assert data == {"run": ["here & now"], "x": {"nan": None, "list": [None, 1.5, [2, 3]]}}
    assert "**Empty**" in (tmp_path / "bench" / "bench.md").read_text()
    ElementTree.parse(tmp_path / "bench" / "bench.svg")


def test_bars_are_logarithmic_and_in_order() -> None:
    svg = ElementTree.fromstring(bar_chart("t", [("b", 1.0), ("a", 0.01), ("c", 0.1)]))
    bars = [e for e in svg.iter() if e.tag.endswith("rect")][1:]
    widths = [float(bar.attrib["width"]) for bar in bars]
    assert widths == sorted(widths)
    assert widths[1] - widths[0] == pytest.approx(widths[2] - widths[1], abs=0.2)
    names = [e.text for e in svg.iter() if e.tag.endswith("text") and e.text in ("a", "b", "c")]
    assert names == ["a", "c", "b"]


def test_json_keys_are_words() -> None:
    assert without_nan({Way("a", "b"): 1}) == {"a b": 1}
