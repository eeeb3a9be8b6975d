# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables of results: as text while they are measured, then as Markdown, JSON and one SVG."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import Any

_PREFIXES = ((1e12, "T"), (1e9, "G"), (1e6, "M"), (1e3, "k"))
_COLOURS = {"native": "#d9480f", "compute": "#1864ab", "fragment": "#2b8a3e"}
_WIDTH, _LEFT, _RIGHT, _ROW = 760, 190, 110, 22


def amount(value: float, unit: str = "") -> str:
    """Three digits and a prefix: "3.36 Grays/s"; "-" for what is not known."""
    if not math.isfinite(value):
        return "-"
    for size, prefix in _PREFIXES:
        if abs(value) >= 0.9995 * size:
            return f"{digits(value / size)} {prefix}{unit}"
    return f"{digits(value)} {unit}".rstrip()


def duration(seconds: float) -> str:
    """Three digits in s, ms or µs."""
    if not math.isfinite(seconds):
        return "-"
    for size, unit in ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs")):
        if seconds >= 0.9995 * size or unit == "µs":
            return f"{digits(seconds / size)} {unit}"
    raise AssertionError


def digits(value: float) -> str:
    """Three significant digits, never in powers of ten."""
    if value == 0 or not math.isfinite(value):
        return f"{value:g}"
    places = 2 - math.floor(math.log10(abs(float(f"{value:.2e}"))))
    return f"{value:.{max(places, 0)}f}"


@dataclass
class Table:
    """Rows of cells below their titles, and notes below them."""

    title: str
    heads: Sequence[str]
    rows: list[Sequence[str]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def add(self, *cells: object) -> None:
        """Add a row and print it at once."""
        row = [str(cell) for cell in cells]
        assert len(row) == len(self.heads), row
        self.rows.append(row)
        print("  " + "  ".join(row), flush=True)

    def note(self, text: str) -> None:
        """Add a line below the table and print it at once."""
        self.notes.append(text)
        print(f"  ({text})", flush=True)

    def text(self) -> str:
        """For a console: columns padded, the first to the left, the others to the right."""
        widths = [max(map(len, column)) for column in zip(self.heads, *self.rows, strict=True)]
        lines = [self.title]
        for row in (self.heads, *self.rows):
            first, *others = zip(row, widths, strict=True)
            cells = [first[0].ljust(first[1]), *(cell.rjust(width) for cell, width in others)]
            lines.append("  " + "  ".join(cells).rstrip())
        return "\n".join([*lines, *(f"  ({note})" for note in self.notes)])

    def markdown(self) -> str:
        """For the ledger, tests/bench/README.md."""
        rows = [self.heads, ["---", *["---:"] * (len(self.heads) - 1)], *self.rows]
        lines = ["| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in rows]
        return "\n".join([f"**{self.title}**", "", *lines, "", *(f"- {n}" for n in self.notes)])


@dataclass
class Report:
    """All tables of a run, and the same as data."""

    folder: Path
    head: list[str] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    data: dict[str, Any] = field(default_factory=dict)
    bars: list[tuple[str, float]] = field(default_factory=list)  # (way, seconds of a pass)
    bars_title: str = ""

    def table(self, title: str, *heads: str) -> Table:
        """Begin a table; its rows are printed as they come."""
        table = Table(title, heads)
        self.tables.append(table)
        print(f"\n{title}\n  " + "  ".join(heads), flush=True)
        return table

    def say(self, line: str) -> None:
        """A line about the whole run."""
        self.head.append(line)
        print(line, flush=True)

    def write(self) -> None:
        """bench.json, bench.md and bench.svg; again after each part of a run, so none is lost."""
        self.folder.mkdir(parents=True, exist_ok=True)
        data = {"run": self.head, **self.data}
        text = json.dumps(without_nan(data), indent=1, allow_nan=False)
        (self.folder / "bench.json").write_text(text, encoding="utf-8")
        parts = ["\n".join(f"- {line}" for line in self.head), *(t.markdown() for t in self.tables)]
        (self.folder / "bench.md").write_text("\n\n".join(parts) + "\n", encoding="utf-8")
        if self.bars:
            picture = bar_chart(self.bars_title, self.bars)
            (self.folder / "bench.svg").write_text(picture, encoding="utf-8")


def without_nan(data: Any) -> Any:
    """JSON knows no NaN and no infinity: None instead."""
    if isinstance(data, dict):
        return {str(key): without_nan(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [without_nan(value) for value in data]
    if isinstance(data, float) and not math.isfinite(data):
        return None
    return data


def bar_chart(title: str, bars: Sequence[tuple[str, float]]) -> str:
    """One SVG of horizontal bars, seconds on a logarithmic axis, the shortest first."""
    bars = sorted(bars, key=lambda bar: bar[1])
    low = math.floor(math.log10(bars[0][1]) - 0.2)
    high = max(math.ceil(math.log10(bars[-1][1])), low + 1)
    height = 60 + _ROW * len(bars)

    def across(seconds: float) -> float:
        share = (math.log10(seconds) - low) / (high - low)
        return _LEFT + share * (_WIDTH - _LEFT - _RIGHT)

    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH} {height}" '
        f'width="{_WIDTH}" font-family="sans-serif" font-size="12">',
        f'<rect width="{_WIDTH}" height="{height}" fill="white"/>',
        f'<text x="10" y="20" font-size="14">{escape(title)}</text>',
    ]
    for power in range(low, high + 1):
        x = across(10.0**power)
        parts.append(f'<path d="M{x:.1f} 32V{height - 22}" stroke="#ccc"/>')
        parts.append(
            f'<text x="{x:.1f}" y="{height - 8}" text-anchor="middle">'
            f"{duration(10.0**power)}</text>"
        )
    for row, (name, seconds) in enumerate(bars):
        y = 36 + _ROW * row
        colour = _COLOURS.get(name.split()[0], "#555555")
        parts.append(
            f'<text x="{_LEFT - 8}" y="{y + 13}" text-anchor="end">{escape(name)}</text>'
            f'<rect x="{_LEFT}" y="{y}" width="{across(seconds) - _LEFT:.1f}" '
            f'height="{_ROW - 5}" fill="{colour}"/>'
            f'<text x="{across(seconds) + 6:.1f}" y="{y + 13}">{duration(seconds)}</text>'
        )
    return "".join([*parts, "</svg>"])
