# SPDX-License-Identifier: GPL-3.0-or-later
"""What a run of the chart found, and the tables that are made of it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

from .measure import Point, efficiency, error_at, seconds_to, slope

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
    half_noise: float = 0.0  # relMSE of half A against half B, halved: what the measure averages

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
    titles = ["seconds to relMSE", *(f"{t:g}" for t in TARGETS), "slope", "1/(MSE t)"]
    rows = []
    ours = {t: seconds_to(scene.curves.get(OURS, []), t) for t in TARGETS}
    for name, points in scene.curves.items():
        cells = []
        for target in TARGETS:
            own = seconds_to(points, target)
            mine = ours[target]
            if math.isfinite(own):
                ratio = f" ({own / mine:.2g}x)" if name != OURS and math.isfinite(mine) else ""
                cells.append(_number(own) + ratio)
            elif points:
                last = points[-1].seconds
                ratio = f" (>{last / mine:.2g}x)" if name != OURS and math.isfinite(mine) else ""
                cells.append(f"> {_number(last)}{ratio}")
            else:
                cells.append("no picture in time")
        rows.append([name, *cells, _number(slope(points)), _number(efficiency(points))])
    return titles, rows


def equal_time(scene: SceneResult) -> Table:
    """Errors after the same time, all pixels, interior and edge band apart."""
    time = scene.equal_time
    titles = [
        f"after {_number(time)} s", "relMSE", "of ours", "picture at", "relMSE", "interior",
        "edge band", "HDR-FLIP", "interior", "edge band",
    ]  # fmt: skip
    mine, rows = error_at(scene.curves.get(OURS, []), time), []
    for name, index in scene.at_equal_time().items():
        points = scene.curves[name]
        point, error = points[index], error_at(points, time)
        rows.append([
            name, _number(error), _number(error / mine) + "x", f"{_number(point.seconds)} s",
            f"{point.error.value:.2e} ± {point.error.deviation:.0e}",
            f"{point.interior.value:.2e}", f"{point.band.value:.2e}",
            *(_number(v) for v in (point.flip, point.flip_interior, point.flip_band)),
        ])  # fmt: skip
    return titles, rows


def summary(scenes: list[SceneResult], contenders: list[str]) -> str:
    """A Markdown table: each contender's seconds to relMSE 1e-2 and 1e-3 in each scene."""
    lines = [
        f"| seconds to relMSE 1e-2 / 1e-3 | {' | '.join(contenders)} |",
        "|---" * (len(contenders) + 1) + "|",
    ]
    for scene in scenes:
        cells = []
        for name in contenders:
            points = scene.curves.get(name, [])
            times = [seconds_to(points, target) for target in (1e-2, 1e-3)]
            last = f"> {points[-1].seconds:.2g}" if points else ""
            cells.append(
                " / ".join(f"{t:.2g}" if math.isfinite(t) else last for t in times)
                if points
                else "-"
            )
        lines.append(f"| {scene.name} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


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
            f"mirror_caustic: Cycles ends at relMSE {cycles:.2g}, slope "
            f"{slope(scene.curves['Cycles'][-4:]):.2f}; ours passes that after {_number(mine)} s"
        )
    return found


def _verdict(scene: SceneResult, target: float, wanted: float) -> str:
    mine = seconds_to(scene.curves.get(OURS, []), target)
    points = scene.curves.get("Cycles", [])
    theirs, bound = seconds_to(points, target), ""
    if not math.isfinite(theirs) and points:
        theirs, bound = points[-1].seconds, "at least "
    if not math.isfinite(mine):
        return (
            f"{scene.name}: relMSE {target:g} not reached by ours; where: {where_time_goes(scene)}"
        )
    ratio = theirs / mine
    state = "met" if ratio >= wanted else ("open" if bound else "missed")
    where = "" if state == "met" else f"; where our time goes: {where_time_goes(scene)}"
    return (
        f"{scene.name}: relMSE {target:g} in {_number(mine)} s, Cycles {bound}{_number(theirs)} s: "
        f"{bound}{ratio:.2g} times sooner, wanted {wanted}: {state}{where}"
    )


def _number(value: float) -> str:
    return "-" if math.isnan(value) else "never" if math.isinf(value) else f"{value:.3g}"
