# SPDX-License-Identifier: GPL-3.0-or-later
"""`pytest --stability`: run the tests marked `stability(row)`, and print what they measured."""

from __future__ import annotations

import json
import math
import textwrap
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import zip_longest
from pathlib import Path
from typing import Any

import pytest

from tests.stability.rows import ROWS

IN_TURN = {"physics", "unit"}  # folders
BACKENDS = {"native", "fragment", "compute"}
COLUMNS = (3, 34, 24, 40, 32)  # characters: row, case, expected, measured, result


@dataclass
class Row:
    """What the tests of a row stated, and how they went."""

    figures: dict[str, tuple[float, str]] = field(default_factory=dict)
    shortfalls: list[str] = field(default_factory=list)
    passed: int = 0
    failed: list[str] = field(default_factory=list)
    skipped: list[str] = field(default_factory=list)

    def state(self, what: str, value: float, unit: str) -> None:
        """Of a figure stated more than once, keep the worst: the largest, or NaN."""
        before, _ = self.figures.get(what, (-math.inf, ""))
        worse = math.isnan(value) or value > before
        self.figures[what] = (value if worse else before, unit)

    @property
    def measured(self) -> str:
        return ", ".join(f"{what} {_text(*figure)}" for what, figure in self.figures.items())

    @property
    def result(self) -> str:
        if self.failed:
            return "FAILED: " + ", ".join(self.failed)
        if self.shortfalls:
            return "does not hold: " + "; ".join(dict.fromkeys(self.shortfalls))
        if self.skipped:
            return "skipped: " + "; ".join(dict.fromkeys(self.skipped))
        return "passed" if self.passed else "no test"


def _text(value: float, unit: str) -> str:
    if unit == "%":
        return f"{100 * value:.2g} %" if abs(value) < 0.995 else f"{100 * value:.0f} %"
    return f"{value:.0f}" if value.is_integer() and abs(value) < 1e6 else f"{value:.2g}{unit}"


class Table:
    """Every row, in order."""

    def __init__(self) -> None:
        self.rows = {number: Row() for number in ROWS}

    def records(self) -> list[dict[str, Any]]:
        """The table as plain data."""
        return [
            {"row": number, "case": ROWS[number][0], "expected": ROWS[number][1]}
            | {"measured": row.measured, "result": row.result, "tests": row.passed}
            for number, row in self.rows.items()
        ]

    def lines(self) -> Iterator[str]:
        """The table as text."""
        names = ("row", "case", "expected", "measured", "result")
        for record in [dict(zip(names, names, strict=True)), *self.records()]:
            cells = [
                textwrap.wrap(str(record[name]), width) or [""]
                for name, width in zip(names, COLUMNS, strict=True)
            ]
            for parts in zip_longest(*cells, fillvalue=""):
                padded = (f"{part:{width}}" for part, width in zip(parts, COLUMNS, strict=True))
                yield "  ".join(padded).rstrip()

    def write(self, path: Path) -> None:
        """As JSON, or as Markdown for any other name."""
        records = self.records()
        if path.suffix == ".json":
            path.write_text(json.dumps(records, indent=1) + "\n", encoding="utf-8")
            return
        names = ("row", "case", "expected", "measured", "result")
        rows = [names, ("---",) * 5, *([record[name] for name in names] for record in records)]
        text = "".join(f"| {' | '.join(map(str, row))} |\n" for row in rows)
        path.write_text(text, encoding="utf-8")


class Measured:
    """States figures in a test's rows: `assert measured("bias", error, "%") <= 0.005`."""

    def __init__(self, rows: dict[int, Row]) -> None:
        self._rows = rows

    def __call__(self, what: str, value: Any, unit: str = "", row: int | None = None) -> float:
        """State a figure (of one of the test's rows) and return it; "%" shows a share of one."""
        for one in self._rows.values() if row is None else [self._rows[row]]:
            one.state(what, float(value), unit)
        return float(value)

    def falls_short(self, why: str) -> None:
        """Say that the row does not hold, though the test holds us to what does."""
        for row in self._rows.values():
            row.shortfalls.append(why)


_TABLE = pytest.StashKey[Table]()


def _rows_of(item: pytest.Item) -> list[int]:
    return sorted({number for mark in item.iter_markers("stability") for number in mark.args})


def _is_long(item: pytest.Item) -> bool:
    """Whether it is marked so, or the marker names a part of its parameters."""
    marks = [*item.iter_markers("thorough")]
    named = item.name.partition("[")[2]
    return any(not mark.args or any(part in named for part in mark.args) for mark in marks)


def _in_turn(items: list[pytest.Item]) -> Iterator[pytest.Item]:
    """Of tests IN_TURN that run by several backends, alike in all else, those by each backend whose
    turn it is not: that backends agree is held elsewhere (tests/kernels, test_layers_agree)."""
    ways: dict[tuple[str, ...], dict[str, pytest.Item]] = {}
    for item in items:
        function, _, given = item.nodeid.partition("[")
        parts = given.rstrip("]").replace(" ", "-").split("-")
        backends = BACKENDS & set(parts)
        if len(backends) == 1 and IN_TURN & set(item.path.parts) and not _is_long(item):
            others = (part for part in parts if part not in backends)
            ways.setdefault((function, *others), {}).setdefault(*backends, item)
    for (function, *_), by in ways.items():
        turn = sorted(by)[zlib.crc32(function.encode()) % len(by)]
        yield from (item for backend, item in by.items() if backend != turn)


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("stability")
    text = "run the tests of the stability table alone, at their full counts, and print it"
    group.addoption("--stability", action="store_true", help=text)
    group.addoption("--thorough", action="store_true", help="run what takes long, too")
    text = "also write the table there: .json, or .md"
    group.addoption("--stability-report", type=Path, metavar="FILE", help=text)


def pytest_configure(config: pytest.Config) -> None:
    config.stash[_TABLE] = Table()


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Keep the marked tests, if asked to, and leave out what takes long unless asked for it."""
    if not (config.getoption("--thorough") or config.getoption("--stability")):
        for item in filter(_is_long, items):
            item.add_marker(pytest.mark.skip(reason="runs with --thorough"))
        for item in _in_turn(items):
            item.add_marker(pytest.mark.skip(reason="another backend's turn; runs with --thorough"))
    for item in items:
        for number in _rows_of(item):
            if number not in ROWS:
                raise pytest.UsageError(f"{item.nodeid}: the stability table has no row {number}")
    if config.getoption("--stability"):
        config.hook.pytest_deselected(items=[item for item in items if not _rows_of(item)])
        items[:] = [item for item in items if _rows_of(item)]


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: Any) -> Any:
    """Count the outcome in the rows of the test."""
    report = yield
    for number in _rows_of(item):
        row = item.config.stash[_TABLE].rows[number]
        if report.failed:
            row.failed.append(item.name)
        elif hasattr(report, "wasxfail"):
            row.shortfalls.append(report.wasxfail)
        elif report.skipped:
            row.skipped.append(str(report.longrepr[2]).removeprefix("Skipped: "))
        elif report.when == "call":
            row.passed += 1
    return report


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    """Print the table, and write it where asked."""
    table = config.stash[_TABLE]
    if config.getoption("--stability"):
        terminalreporter.section("stability")
        for line in table.lines():
            terminalreporter.write_line(line)
    if path := config.getoption("--stability-report"):
        table.write(path)


@pytest.fixture
def measured(request: pytest.FixtureRequest) -> Measured:
    """Takes the figures of a test marked `stability(row)`."""
    rows = _rows_of(request.node)
    assert rows, "measured is for tests marked stability(row)"
    return Measured({number: request.config.stash[_TABLE].rows[number] for number in rows})


@pytest.fixture
def thorough(request: pytest.FixtureRequest) -> bool:
    """Whether to run at full counts: with --stability or --thorough."""
    options = request.config
    return bool(options.getoption("--stability") or options.getoption("--thorough"))
