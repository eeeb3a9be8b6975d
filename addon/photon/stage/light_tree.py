# SPDX-License-Identifier: GPL-3.0-or-later
"""Which lights a visible point asks, and a tree of all others, by which it draws those that may
bring it the most (light_tree.glsl)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..kernels.records import LIGHT_NODE, LIGHT_PLACE

# A visible point asks each light, one shadow ray each, up to so many weak ones. Of more of those it
# asks DRAWN_RAYS, drawn by the tree. Distant lights are asked each.
MOST_ASKED = 64
DRAWN_RAYS = 32
STRONG = 1 / 16  # of the flux of all that are not distant: weak is a light that has no more of it
# MOST_ASKED and DRAWN_RAYS are times the share that weak lights have of that flux. At least so many
# rays are drawn, and only from more than twice as many lights.
LEAST_DRAWN = 8
ASKED = -1.0  # as a place in the tree
BOTH_SIDES = 2.0  # a reach, as in light.glsl
ROUNDING = 1e-5  # of cosines: a node must not lose what a light in it has

Doubles = NDArray[np.float64]


@dataclass(frozen=True)
class AskedLights:
    """Where a visible point's shadow rays go."""

    lights: NDArray[np.int64]  # (A,) their numbers; one ray goes to each
    drawn: int = 0  # rays to others, each to one by the tree

    @property
    def rays(self) -> int:
        """A point's, in all."""
        return len(self.lights) + self.drawn


def asked_lights(flux: Doubles, distant: int) -> AskedLights:
    """Those of lights of these fluxes (L,), in any unit, of which so many first ones are distant.
    All of them, but where many have little."""
    local = flux.copy()
    local[:distant] = 0.0
    whole = float(local.sum())
    weak = local <= STRONG * whole
    weak[:distant] = False
    share = float(local[weak].sum()) / whole if whole > 0.0 else 1.0
    if weak.sum() <= max(MOST_ASKED * share, 2 * LEAST_DRAWN):
        return AskedLights(np.arange(len(flux)))
    asked = np.flatnonzero((flux > 0.0) & ~weak)
    drawn = 2 ** round(math.log2(DRAWN_RAYS * share))  # for few programs
    return AskedLights(asked, max(drawn, LEAST_DRAWN))


@dataclass(frozen=True)
class Bounds:
    """Where lights are and shine, as LightBounds of light.glsl; and how much."""

    low: Doubles  # (n, 3)
    high: Doubles  # (n, 3)
    axis: Doubles  # (n, 3) unit
    spread: Doubles  # (n,)
    reach: Doubles  # (n,)
    flux: Doubles  # (n,)

    def at(self, places: Any) -> Bounds:
        """Some of them."""
        return Bounds(*(values[places] for values in vars(self).values()))


def light_tree(all_lights: Bounds, asked: NDArray[np.int64]) -> tuple[Any, Any]:
    """LIGHT_NODEs of lights but those that are asked, and (L,) of LIGHT_PLACE of all."""
    others = np.setdiff1d(np.arange(len(all_lights.flux)), asked)
    lights = all_lights.at(others)
    order = in_order((lights.low + lights.high) / 2)
    count = len(order)
    places = LIGHT_PLACE.zeros(len(asked) + count)
    places["place"][asked], places["place"][others[order]] = ASKED, np.arange(count)
    places["light"] = np.concatenate([asked, others[order]])
    levels = _levels(count)
    nodes = LIGHT_NODE.zeros(max(1 << len(levels), 2))
    below: Bounds | None = None
    for level, (begin, size) in reversed([*enumerate(levels)]):
        leaves = lights.at(order[np.minimum(begin, count - 1)])
        found = leaves if below is None else _either(size > 1, _union(below), leaves)
        own = nodes[1 << level : 2 << level]
        for name, values in vars(found).items():
            own[name] = values
        own["spread"] = np.maximum(found.spread - ROUNDING, -1.0)
        own["reach"] = np.where(
            found.reach < BOTH_SIDES, np.maximum(found.reach - ROUNDING, 0.0), BOTH_SIDES
        )
        own["flux"][size == 0] = 0.0
        below = found
    return nodes, places


def _either(chosen: Any, one: Bounds, other: Bounds) -> Bounds:
    pairs = zip(vars(one).values(), vars(other).values(), strict=True)
    return Bounds(*(np.where(chosen.reshape(-1, *[1] * (a.ndim - 1)), a, b) for a, b in pairs))


def _halves(begin: Any, size: Any) -> tuple[Any, Any]:
    """The children of nodes; without any lights where a node has one alone."""
    left = np.where(size > 1, (size + 1) // 2, 0)
    right = np.where(size > 1, size // 2, 0)
    return np.stack([begin, begin + left], 1).ravel(), np.stack([left, right], 1).ravel()


def _levels(count: int) -> list[tuple[Any, Any]]:
    """Where the lights of each node of a level begin in the order, and how many they are."""
    levels = []
    begin, size = np.zeros(1, np.int64), np.full(1, count)
    while count and size.any():
        levels.append((begin, size))
        begin, size = _halves(begin, size)
    return levels


def in_order(middles: Doubles) -> NDArray[np.int64]:
    """Lights (n, 3) so that those of a node are close together: halved along the longest side of
    the box about their middles, and again. The heap's shape is that of _halves."""
    count = len(middles)
    order = np.arange(count)
    for begin, size in _levels(count)[:-1]:
        begin, size = begin[size > 0], size[size > 0]
        there = middles[order]
        low, high = (f.reduceat(there, begin, axis=0) for f in (np.minimum, np.maximum))
        axis = np.repeat(np.argmax(high - low, axis=1), size)
        node = np.repeat(np.arange(len(size)), size)
        order = order[np.lexsort((there[np.arange(count), axis], node))]
    return order


def _union(children: Bounds) -> Bounds:
    """Of each pair; what is dark widens nothing."""
    one, other = children.at(np.s_[0::2]), children.at(np.s_[1::2])
    lit = _either(one.flux > 0.0, _about(one, other), other)
    return _either(other.flux > 0.0, lit, one)


def _about(one: Bounds, other: Bounds) -> Bounds:
    both = (one.reach >= BOTH_SIDES) & (other.reach >= BOTH_SIDES)
    turned = both & ((one.axis * other.axis).sum(axis=1) < 0.0)
    other_axis = np.where(turned[:, None], -other.axis, other.axis)
    axis, spread = _cone(one.axis, one.spread, other_axis, other.spread)
    mixed = ~both & ((one.reach >= BOTH_SIDES) | (other.reach >= BOTH_SIDES))
    reach = np.minimum(one.reach, other.reach)
    return Bounds(
        np.minimum(one.low, other.low),
        np.maximum(one.high, other.high),
        axis,
        np.where(mixed, -1.0, spread),
        np.where(both, BOTH_SIDES, np.where(mixed, 0.0, reach)),
        one.flux + other.flux,
    )


def _cone(a: Doubles, cos_a: Doubles, b: Doubles, cos_b: Doubles) -> tuple[Doubles, Doubles]:
    """Axes and cosines of the narrowest cones about pairs of cones."""
    angle_a, angle_b = (np.arccos(np.clip(cosine, -1.0, 1.0)) for cosine in (cos_a, cos_b))
    apart = 2.0 * np.arctan2(np.linalg.norm(a - b, axis=1), np.linalg.norm(a + b, axis=1))
    angle = (angle_a + angle_b + apart) / 2.0
    has_b, has_a = angle_a >= np.minimum(apart + angle_b, np.pi), angle_b >= apart + angle_a
    sine = np.sin(apart)
    share = np.divide(angle - angle_a, apart, out=np.zeros_like(apart), where=apart > 0.0)
    slerped = np.sin((1.0 - share) * apart)[:, None] * a + np.sin(share * apart)[:, None] * b
    length = np.linalg.norm(slerped, axis=1)
    all_around = (angle >= np.pi) | (sine < 1e-9) | (length == 0.0)
    axis = slerped / np.where(length > 0.0, length, 1.0)[:, None]
    axis, angle = _where(all_around, (a, np.pi), (axis, angle))
    axis, angle = _where(has_a & ~has_b, (b, angle_b), (axis, angle))
    axis, angle = _where(has_b, (a, angle_a), (axis, angle))
    return axis, np.cos(angle)


def _where(chosen: Any, one: tuple[Any, Any], other: tuple[Any, Any]) -> tuple[Any, Any]:
    return np.where(chosen[:, None], one[0], other[0]), np.where(chosen, one[1], other[1])
