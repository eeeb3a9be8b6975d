# SPDX-License-Identifier: GPL-3.0-or-later
"""Curves over seconds as SVG, both axes logarithmic."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from html import escape

WIDTH, HEIGHT = 670, 420
LEFT, RIGHT, TOP, BOTTOM = 70, 180, 34, 46  # margins; the right one holds the names
COLOURS = {
    "Photon Stream": "#d9480f",
    "Photon Stream + Denoise": "#f59f00",
    "Cycles": "#1864ab",
    "Cycles + OIDN": "#74a9d8",
    "Mitsuba path": "#2b8a3e",
    "Mitsuba ptracer": "#94c973",
    "LuxCore path": "#862e9c",
    "LuxCore PhotonGI": "#d17ee0",
}

Curve = Sequence[tuple[float, float]]  # (seconds, value), both > 0


class Axis:
    """Maps values to pixels by their logarithms."""

    def __init__(self, values: Sequence[float], start: float, end: float) -> None:
        low, high = math.log10(min(values)), math.log10(max(values))
        margin = 0.04 * (high - low) + 0.04
        self._low, self._high = low - margin, high + margin
        self._start, self._end = start, end

    def __call__(self, value: float) -> float:
        share = (math.log10(value) - self._low) / (self._high - self._low)
        return self._start + share * (self._end - self._start)

    def ticks(self) -> list[tuple[float, bool]]:
        """(value, whether it is a power of ten) of the grid lines."""
        decades = range(math.floor(self._low), math.ceil(self._high) + 1)
        values = [(m * 10.0**d, m == 1) for d in decades for m in range(1, 10)]
        return [(v, power) for v, power in values if self._low <= math.log10(v) <= self._high]


def figure(title: str, unit: str, curves: Mapping[str, Curve]) -> str:
    """One SVG; curves by their contenders' names."""
    shown = {name: curve for name, curve in curves.items() if curve}
    across = Axis([x for c in shown.values() for x, _ in c] or [1.0], LEFT, WIDTH - RIGHT)
    up = Axis([y for c in shown.values() for _, y in c] or [1.0], HEIGHT - BOTTOM, TOP)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" '
        f'width="{WIDTH}" font-family="sans-serif" font-size="12">',
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>',
        f'<text x="{LEFT}" y="20" font-size="14">{escape(title)}</text>',
        *_grid(across, up),
    ]
    order = sorted(shown.items(), key=lambda item: up(item[1][-1][1]))
    heights = spread([up(curve[-1][1]) + 4 for _, curve in order], HEIGHT - 4)
    for (name, curve), height in zip(order, heights, strict=True):
        colour = COLOURS.get(name, "#555555")
        places = [(across(x), up(y)) for x, y in curve]
        line = " ".join(f"{x:.1f},{y:.1f}" for x, y in places)
        parts.append(f'<polyline points="{line}" fill="none" stroke="{colour}" stroke-width="2"/>')
        parts += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="{colour}"/>' for x, y in places]
        parts.append(
            f'<text x="{WIDTH - RIGHT + 10}" y="{height:.1f}" fill="{colour}">{escape(name)}</text>'
        )
    middle = (TOP + HEIGHT - BOTTOM) / 2
    parts.append(
        f'<text x="{(LEFT + WIDTH - RIGHT) / 2}" y="{HEIGHT - 8}" text-anchor="middle">'
        "seconds of rendering</text>"
        f'<text x="14" y="{middle}" transform="rotate(-90 14 {middle})" text-anchor="middle">'
        f"{escape(unit)}</text></svg>"
    )
    return "".join(parts)


def spread(heights: Sequence[float], lowest: float, apart: float = 15.0) -> list[float]:
    """Heights from the top down, moved as little as keeps them apart and above the lowest."""
    moved: list[float] = []
    for height in heights:
        moved.append(max([height, *[above + apart for above in moved[-1:]]]))
    for i in reversed(range(len(moved))):
        moved[i] = min(moved[i], lowest - apart * (len(moved) - 1 - i))
    return moved


def _grid(across: Axis, up: Axis) -> list[str]:
    parts = []
    for value, power in across.ticks():
        x, stroke = across(value), "#ccc" if power else "#eee"
        parts.append(f'<path d="M{x:.1f} {TOP}V{HEIGHT - BOTTOM}" stroke="{stroke}"/>')
        if power:
            parts.append(
                f'<text x="{x:.1f}" y="{HEIGHT - 28}" text-anchor="middle">{value:g}</text>'
            )
    for value, power in up.ticks():
        y, stroke = up(value), "#ccc" if power else "#eee"
        parts.append(f'<path d="M{LEFT} {y:.1f}H{WIDTH - RIGHT}" stroke="{stroke}"/>')
        if power:
            parts.append(f'<text x="{LEFT - 6}" y="{y + 4:.1f}" text-anchor="end">{value:g}</text>')
    return parts
