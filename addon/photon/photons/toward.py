# SPDX-License-Identifier: GPL-3.0-or-later
"""Near lights aimed at what the picture shows, before any photon tells: from far away hardly one in
a million goes there."""

from __future__ import annotations

from collections.abc import Callable, Collection

import numpy as np
from numpy.typing import NDArray

from ..stage.aims import Aim, Aims
from ..stage.tables import Tables
from .importance import lights_of, numbers_of
from .mapper import Mapper
from .starts import MOST_PLAIN, Starts
from .view import Doubles, View

PHOTONS = 1 << 16  # that are looked at a round, of all lights
ROUNDS = 8  # at most, each of which comes closer
CLOSEST = 256  # photons of a light that tell where those of the next round shall start
ENOUGH = 0.2  # of a light's photons go there: half of all do not
ASIDE = 0.1  # of the longest side of the box about what is shown: photons are sent beside it, too
CLOSER = 1.1  # times as many as in the round before: else no round comes closer
MARGIN = 0.125  # of a box's side, on both of them: others may go there, too
TURN = 1  # the number that tells the turn about an axis: of it 1 is 0 again
# A box is halved as long as what counts is narrower than this, of one of its sides.
NARROW = 0.75
MOST_NODES = 1024
LEAST_SHARE = 1 / 4096  # of a half: each halving takes digits of the numbers

Box = tuple[Doubles, Doubles]  # the lowest and the highest corner, (4,) each


def aims_toward(
    mapper: Mapper,
    tables: Tables,
    view: View,
    seed: int,
    index: int,
    lights: Collection[int],
    use: Callable[[Starts], object],
) -> dict[int, Aim]:
    """Aims of lights at the box about what the picture shows, by their numbers. Passes from `index`
    on tell, whose photons start as those do that `use` was given."""
    shares = np.zeros(len(tables.by_flux))
    shares[list(lights)] = 1.0 / len(lights)
    low, high = view.bounds()
    aside = ASIDE * (high - low).max()
    low, high = low - aside, high + aside
    aims: dict[int, Aim] = {}
    before = 0.0
    for at in range(index, index + ROUNDS):
        use(Starts(shares, Aims(len(shares), aims) if aims else None))
        missed = missed_by(mapper.rays(at, PHOTONS)[:PHOTONS].astype(np.float64), low, high)
        number = np.arange(PHOTONS, dtype=np.uint32)
        light = lights_of(tables, number, seed, at, PHOTONS)
        numbers, _ = numbers_of(tables, light, number, seed, at)
        least = 1.0
        for own in lights:
            those = np.flatnonzero((light == own) & (missed < np.inf))
            if not len(those):
                continue
            met = int((missed[those] == 0.0).sum())
            closest = those[np.argsort(missed[those], kind="stable")[: max(CLOSEST, met)]]
            aims[own] = Aim(tree_about(boxes_of(numbers[closest])), np.zeros(3))
            least = min(least, met / len(those))
        if least >= ENOUGH or 0.0 < least <= CLOSER * before:
            break
        before = least
    return aims


def missed_by(rays: Doubles, low: Doubles, high: Doubles) -> Doubles:
    """(n,) how far rays (n, 6) pass by the middle of a box; 0: they meet the box; inf: there is no
    ray."""
    origin, direction = rays[:, :3], rays[:, 3:]
    with np.errstate(divide="ignore", invalid="ignore"):
        planes = (np.stack([low, high])[:, None] - origin) / direction
    enters = np.nanmax(planes.min(axis=0), axis=1, initial=0.0)
    leaves = np.nanmin(planes.max(axis=0), axis=1, initial=np.inf)
    to_middle = (low + high) / 2 - origin
    along = (to_middle * direction).sum(axis=1)
    # What goes away from it has it behind, ever farther.
    beside = np.sqrt(np.maximum((to_middle**2).sum(axis=1) - along * np.abs(along), 0.0))
    found = np.where(enters <= leaves, 0.0, beside)
    return np.where(direction.any(axis=1), found, np.inf)


def boxes_of(numbers: NDArray[np.float32]) -> list[Box]:
    """About numbers (n, 4): one, or two where a turn begins between them."""
    turns = np.sort(numbers[:, TURN])
    gaps = np.diff(turns)
    parts = [np.ones(len(numbers), bool)]
    if len(gaps) and gaps.max() > 0.5:
        parts = [numbers[:, TURN] <= turns[gaps.argmax()], numbers[:, TURN] > turns[gaps.argmax()]]
    found = []
    for part in parts:
        low, high = (f(numbers[part], axis=0).astype(np.float64) for f in (np.min, np.max))
        margin = np.maximum(MARGIN * (high - low), 2.0**-24)
        found.append((np.maximum(low - margin, 0.0), np.minimum(high + margin, 1.0)))
    return found


def tree_about(boxes: list[Box]) -> NDArray[np.float32]:
    """(N, 4) as AIM_NODE, by which MOST_PLAIN of all numbers are anywhere, and the others evenly in
    boxes, or not far beside."""
    whole = sum(float(np.prod(high - low)) for low, high in boxes)

    def share(low: Doubles, high: Doubles) -> float:
        inside = sum(float(np.prod(np.maximum(x, 0.0))) for x in _overlaps(boxes, low, high))
        return MOST_PLAIN * float(np.prod(high - low)) + (1.0 - MOST_PLAIN) * inside / whole

    nodes = [np.zeros(4, np.float32)]
    waiting = [(0, np.zeros(4), np.ones(4))]
    while waiting and len(nodes) < MOST_NODES:
        node, low, high = waiting.pop(0)
        there = [x for x in _overlaps(boxes, low, high) if (x > 0.0).all()]
        if not there:
            continue
        widths = np.max(there, axis=0) / (high - low)
        axis = int(widths.argmin())
        if widths[axis] >= NARROW:
            continue
        middle = low.copy(), high.copy()
        middle[0][axis] = middle[1][axis] = (low[axis] + high[axis]) / 2
        lower, upper = (low, middle[1]), (middle[0], high)
        part = share(*lower) / (share(*lower) + share(*upper))
        part = min(max(part, LEAST_SHARE), 1.0 - LEAST_SHARE)
        nodes[node] = np.array([axis, part, len(nodes), 0.0], np.float32)
        waiting += [(len(nodes), *lower), (len(nodes) + 1, *upper)]
        nodes += [np.zeros(4, np.float32), np.zeros(4, np.float32)]
    return np.array(nodes, np.float32)


def _overlaps(boxes: list[Box], low: Doubles, high: Doubles) -> list[Doubles]:
    """The sides of what each box has in common with another; some below 0: nothing."""
    return [np.minimum(own[1], high) - np.maximum(own[0], low) for own in boxes]
