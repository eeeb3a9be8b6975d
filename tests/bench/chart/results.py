# SPDX-License-Identifier: GPL-3.0-or-later
"""What a run of the chart found, and the tables that are made of it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

from .measure import (
    Point,
    efficiency,
    error_at,
    seconds_by_slope,
    seconds_to,
    slope,
)

TARGETS = (1e-1, 3e-2, 1e-2, 3e-3, 1e-3)
OURS = "Photon Stream"


@dataclass
class SceneResult:
    """One scene: curves by contender, and pictures after about the same time."""

    name: str
    notes: str  # of its reference
    reference: Any  # (h, w, 3)
    curves: dict[str, list[Point]] = field(default_factory=dict)
    refused: dict[str, str] = field(default_factory=dict)  # contenders left out, and why
    pictures: dict[str, list[Any]] = field(default_factory=dict)  # beside the curves' points
    where: dict[str, float] = field(default_factory=dict)  # our seconds by phase
    half_noise: float = 0.0  # strict relMSE of half A against half B, halved

    @property
    def equal_time(self) -> float:
        """The longest time at which every contender has a picture [s]; 0 without any."""
        return min((points[-1].seconds for points in self.curves.values() if points), default=0.0)

    def at_equal_time(self) -> dict[str, int]:
        """Index of each contender's last point within the equal time, or of its first."""
        limit = self.equal_time * 1.001
        return {
            name: max([i for i, p in enumerate(points) if p.seconds <= limit], default=0)
            for name, points in self.curves.items()
            if points
        }


Table = tuple[list[str], list[list[str]]]  # titles, rows


def equal_error(scene: SceneResult) -> Table:
    """Seconds to each error; and how many times longer than ours that is."""
    titles = ["seconds to strict relMSE", *(f"{t:g}" for t in TARGETS), "slope", "1/(MSE t)"]
    rows = []
    ours = {t: seconds_to(scene.curves.get(OURS, []), t) for t in TARGETS}
    for name, points in scene.curves.items():
        cells = []
        for target in TARGETS:
            cells.append(_reached(points, target, ours[target] if name != OURS else math.inf))
        rows.append([name, *cells, _number(slope(points)), _number(efficiency(points))])
    return titles, rows


def _reached(points: list[Point], target: float, ours: float) -> str:
    """Seconds to an error, in brackets how many times ours; `>` where it was not reached, then
    `~` what the curve's slope leads to."""
    if not points:
        return "no picture in time"

    def told(sign: str, seconds: float) -> str:
        ratio = f" ({sign}{_number(seconds / ours, 2)}x)" if math.isfinite(ours) else ""
        return f"{sign}{_number(seconds)}{ratio}"

    own = seconds_to(points, target)
    if math.isfinite(own):
        return told("", own)
    later = seconds_by_slope(points, target)
    guess = f", {told('~', later)}" if math.isfinite(later) else ""
    return told(">", points[-1].seconds) + guess


def equal_time(scene: SceneResult) -> Table:
    """Errors after the same time, all pixels, interior and edge band apart."""
    time = scene.equal_time
    titles = [
        f"after {_number(time)} s", "strict relMSE", "of ours", "picture at", "strict relMSE",
        "interior", "edge band", "lenient", "HDR-FLIP", "interior", "edge band",
    ]  # fmt: skip
    mine, rows = error_at(scene.curves.get(OURS, []), time), []
    for name, index in scene.at_equal_time().items():
        points = scene.curves[name]
        point, error = points[index], error_at(points, time)
        rows.append([
            name, _number(error), _number(error / mine) + "x", f"{_number(point.seconds)} s",
            f"{point.error.value:.2e} ± {point.error.deviation:.0e}",
            f"{point.interior.value:.2e}", f"{point.band.value:.2e}", f"{point.lenient.value:.2e}",
            *(_number(v) for v in (point.flip, point.flip_interior, point.flip_band)),
        ])  # fmt: skip
    return titles, rows


def summary(scenes: list[SceneResult], contenders: list[str]) -> str:
    """A Markdown table: each contender's seconds to strict relMSE 1e-2 and 1e-3; ~ by its slope."""
    lines = [
        f"| seconds to strict relMSE 1e-2 / 1e-3 | {' | '.join(contenders)} |",
        "|---" * (len(contenders) + 1) + "|",
    ]
    for scene in scenes:
        cells = []
        for name in contenders:
            points = scene.curves.get(name, [])
            cells.append(" / ".join(_short(points, t) for t in (1e-2, 1e-3)) if points else "-")
        lines.append(f"| {scene.name} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def _short(points: list[Point], target: float) -> str:
    own, later = seconds_to(points, target), seconds_by_slope(points, target)
    if math.isfinite(own):
        return _number(own, 2)
    if math.isfinite(later):
        return f"~{_number(later, 2)}"
    return "never" if math.isfinite(slope(points)) else f"> {_number(points[-1].seconds, 2)}"


def where_time_goes(scene: SceneResult) -> str:
    """Our passes' seconds by phase."""
    total = sum(scene.where.values())
    return ", ".join(
        f"{phase} {seconds:.2f} s ({seconds / total:.0%})" for phase, seconds in scene.where.items()
    )


def verdicts(scenes: list[SceneResult]) -> list[str]:
    """The chart's promises, and how they stand."""
    found = []
    by_name = {scene.name: scene for scene in scenes}
    for name in ("cornell_classic", "door_ajar"):
        for target, wanted in ((1e-2, 20), (1e-3, 10)):
            if name in by_name:
                found.append(_verdict(by_name[name], target, wanted))
    if (scene := by_name.get("mirror_caustic")) and scene.curves.get("Cycles"):
        cycles = min(p.error.value for p in scene.curves["Cycles"])
        mine = seconds_to(scene.curves.get(OURS, []), cycles)
        found.append(
            f"mirror_caustic: Cycles ends at strict relMSE {cycles:.2g}, slope "
            f"{slope(scene.curves['Cycles'][-4:]):.2f}; ours passes that after {_number(mine)} s"
        )
    return found


def _verdict(scene: SceneResult, target: float, wanted: float) -> str:
    mine = seconds_to(scene.curves.get(OURS, []), target)
    points = scene.curves.get("Cycles", [])
    where = f"; where our time goes: {where_time_goes(scene)}"
    if not math.isfinite(mine) or not points:
        found = {
            name: seconds_by_slope(scene.curves.get(name, []), target) for name in (OURS, "Cycles")
        }
        later = ", ".join(f"{name} {_number(seconds)} s" for name, seconds in found.items())
        return (
            f"{scene.name}: strict relMSE {target:g} not reached by ours (by slope: {later}){where}"
        )
    theirs, sign = seconds_to(points, target), ""
    if not math.isfinite(theirs):
        theirs, sign = points[-1].seconds, "more than "
    told = (
        f"{scene.name}: strict relMSE {target:g} in {_number(mine)} s, Cycles in {sign}"
        f"{_number(theirs)} s: {sign}{_number(theirs / mine, 2)} times sooner, wanted {wanted}"
    )
    if theirs / mine >= wanted:
        return f"{told}: met"
    later = seconds_by_slope(points, target) if sign else math.inf
    if not math.isfinite(later):
        return f"{told}: {'open' if sign else 'missed'}{where}"
    state = "met" if later / mine >= wanted else "missed"
    ratio = _number(later / mine, 2)
    told += f"; by Cycles' slope in {_number(later)} s, {ratio} times: {state} by that"
    return told if state == "met" else f"{told}{where}"


def _number(value: float, digits: int = 3) -> str:
    """Rounded to significant digits."""
    if math.isfinite(value):
        return f"{float(f'{value:.{digits}g}'):g}"
    return "-" if math.isnan(value) else "never"
