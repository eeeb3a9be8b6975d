# SPDX-License-Identifier: GPL-3.0-or-later
"""Which lights a visible point asks, and a tree of all others, by which it draws those that may
bring it the most (light_tree.glsl)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..kernels.lights import IS_GLOW
from ..kernels.records import LIGHT_NODE, LIGHT_PLACE

# A visible point asks each light, by a shadow ray or by a few, up to so many weak ones. Of more it
# asks DRAWN_RAYS, drawn by the tree. Distant lights are asked each.
MOST_ASKED = 64
DRAWN_RAYS = 32
STRONG = 1 / 16  # of the flux of all that are not distant: weak is a light that has no more of it
# MOST_ASKED and DRAWN_RAYS are times the share that weak lights have of that flux. At least so many
# rays are drawn, and only from more than twice as many lights.
LEAST_DRAWN = 8
# Of one lamp's triangles, which are alike, fewer: times the square of the share, as the variance
# that drawing adds grows with that.
DRAWN_OF_ONE, LEAST_OF_ONE = 8, 2
ASKED = -1.0  # as a place in the tree
# By how many lights at most, levels that a tree has more than it needs: with them few lights far
# away need not share a node with half of the others. Each costs every draw two nodes; memory
# doubles with it. Splits are looked for in the first levels, where nodes hold what is far apart.
SPARE_LEVELS = ((256, 1), (1 << 16, 2), (1 << 18, 1))
SEARCHED_LEVELS = 6
MOST_GROUPS = 16  # of lights, whose photons' importance is measured apart
BOTH_SIDES = 2.0  # a reach, as in light.glsl
ROUNDING = 1e-5  # of cosines: a node must not lose what a light in it has

Doubles = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True)
class AskedLights:
    """Where a visible point's shadow rays go."""

    lights: Indices  # (A,) their numbers; one ray goes to each, and more to a world by portals
    drawn: int = 0  # rays to others, each to one by the tree

    @property
    def rays(self) -> int:
        """A point's, in all."""
        return len(self.lights) + self.drawn


def asked_lights(
    flux: Doubles,
    distant: int,
    glows: NDArray[np.bool_] | bool = False,
    are_one: Callable[[NDArray[np.bool_]], bool] = lambda _: False,
) -> AskedLights:
    """Those of lights of these fluxes (L,), in any unit, of which so many first ones are distant,
    and some stand for what media emit. All of them, but where many have little. `are_one`: whether
    some of them (L,) are one lamp."""
    local = flux.copy()
    local[:distant] = 0.0
    whole = float(local.sum())
    weak = local <= STRONG * whole
    weak[:distant] = False
    share = float(local[weak].sum()) / whole if whole > 0.0 else 1.0
    # Most of what glows brings about as much as what is beside it.
    share -= float(local[weak & glows].sum()) / whole if whole > 0.0 else 0.0
    most, rays, least = MOST_ASKED * share, DRAWN_RAYS * share, LEAST_DRAWN
    if are_one(local > 0.0):
        rays, least = DRAWN_OF_ONE * share**2, LEAST_OF_ONE
        most = 2 * rays
    if weak.sum() <= max(most, 2 * least):
        return AskedLights(np.arange(len(flux)))
    asked = np.flatnonzero((flux > 0.0) & ~weak)
    rays = max(rays, least)  # the others may all be dark
    return AskedLights(asked, 2 ** round(math.log2(rays)))  # for few programs


def is_of_media(lights: NDArray[Any]) -> NDArray[np.bool_]:
    """(L,) which of a table's stand for what media emit."""
    found: NDArray[np.bool_] = lights["found_by"].astype(np.int64) & IS_GLOW > 0
    return found


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


def light_tree(all_lights: Bounds, asked: Indices) -> tuple[Any, Any]:
    """LIGHT_NODEs of lights but those that are asked, and LIGHT_PLACE of all, and of all leaves,
    of which some are empty. Node 0 is none."""
    others = np.setdiff1d(np.arange(len(all_lights.flux)), asked)
    lights = all_lights.at(others)
    leaves = leaves_for(len(others))
    leaf = _leaf_of_each(lights, leaves)
    places = LIGHT_PLACE.zeros(max(len(all_lights.flux), len(asked) + leaves))
    places["place"][asked], places["place"][others] = ASKED, leaf
    places["light"][: len(asked)], places["light"][len(asked) + leaf] = asked, others
    nodes = LIGHT_NODE.zeros(2 * leaves)
    found = Bounds(*(np.zeros((leaves, *x.shape[1:])) for x in vars(lights).values()))
    for name, values in vars(lights).items():
        getattr(found, name)[leaf] = values
    while True:
        first = len(found.flux)
        own = nodes[first : 2 * first]
        for name, values in vars(found).items():
            own[name] = values
        own["spread"] = np.maximum(found.spread - ROUNDING, -1.0)
        own["reach"] = np.where(
            found.reach < BOTH_SIDES, np.maximum(found.reach - ROUNDING, 0.0), BOTH_SIDES
        )
        if first == 1:
            break
        found = _union(found)
    return nodes, places


def leaves_for(count: int) -> int:
    """Of a tree of so many lights: a power of two, and up to 2^18 lights more than there are."""
    levels = max(count - 1, 0).bit_length()
    return 1 << (levels + next((more for most, more in SPARE_LEVELS if count <= most), 0))


def _leaf_of_each(lights: Bounds, leaves: int) -> Indices:
    """(n,): those of a node are close together. Each node's are split along the longest side of the
    box about their middles: in halves, or in the first levels, where there are spare leaves, so
    that what the halves bring together, by flux and size, is the least."""
    lights = _where_lit(lights)
    middles = (lights.low + lights.high) / 2
    count = len(middles)
    order, first = np.arange(count), np.zeros(count, np.int64)  # each one's node's first leaf
    begin, size = np.zeros(min(count, 1), np.int64), np.full(min(count, 1), count)
    room, level = leaves, 0
    while room > 1:
        order = _sorted(order, middles, begin, size)
        room, level = room // 2, level + 1
        left = (size + 1) // 2
        if level <= SEARCHED_LEVELS and leaves > count:
            left = np.array(
                [
                    _best_split(lights.at(order[b : b + n]), room)
                    for b, n in zip(begin, size, strict=True)
                ]
            )
        first += room * (np.arange(count) >= np.repeat(begin + left, size))
        begin, size = _children(begin, size, left)
    found = np.zeros(count, np.int64)
    found[order] = first
    return found


def _where_lit(lights: Bounds) -> Bounds:
    """With those that are dark where one is that is not: no split is to be for them."""
    is_lit = lights.flux > 0.0
    if not is_lit.any():
        return lights
    one = int(np.argmax(is_lit))
    low, high = (_either(is_lit, x, x[one : one + 1]) for x in (lights.low, lights.high))
    return replace(lights, low=low, high=high)


def _best_split(lights: Bounds, room: int) -> int:
    """How many of a node's lights, in their order, its first child has; each has room for so
    many."""
    count = len(lights.flux)
    fewest, most = max(count - room, 1), min(room, count - 1)
    if fewest > most or not lights.flux.any():
        return (count + 1) // 2
    first = _spread_of(lights)[fewest - 1 : most]
    other = _spread_of(lights.at(np.s_[::-1]))[::-1][fewest : most + 1]
    return fewest + int(np.argmin(first + other))


def _spread_of(lights: Bounds) -> Doubles:
    """(n,) of the first 1, 2, ... n lights: their flux times the square of their box's size."""
    low = np.minimum.accumulate(lights.low, axis=0)
    size = np.maximum.accumulate(lights.high, axis=0) - low
    found: Doubles = np.cumsum(lights.flux) * np.square(size).sum(axis=1)
    return found


def _either(chosen: Any, one: Doubles, other: Doubles) -> Doubles:
    """Rows of one or the other."""
    return np.where(chosen.reshape(-1, *[1] * (one.ndim - 1)), one, other)


def _either_of(chosen: Any, one: Bounds, other: Bounds) -> Bounds:
    pairs = zip(vars(one).values(), vars(other).values(), strict=True)
    return Bounds(*(_either(chosen, a, b) for a, b in pairs))


def groups_of(middles: Doubles, flux: Doubles, distant: int) -> list[Indices]:
    """Lights (n,) that have any flux, MOST_GROUPS at most, by what is close together; the first
    ones, so many of them from afar, each alone."""
    used = np.flatnonzero(flux > 0.0)
    if len(used) <= MOST_GROUPS:
        return [used[i : i + 1] for i in range(len(used))]
    afar, near = used[used < distant], used[used >= distant]
    near = near[in_order(middles[near])]
    alone = [afar] if len(afar) > MOST_GROUPS // 2 else [afar[i : i + 1] for i in range(len(afar))]
    parts = min(MOST_GROUPS - len(alone), len(near))
    return [*alone, *(np.array_split(near, parts) if parts else [])]


def in_order(middles: Doubles) -> Indices:
    """Lights (n, 3) so that those of a node are close together: halved along the longest side of
    the box about their middles, and again."""
    count = len(middles)
    order = np.arange(count)
    begin, size = np.zeros(min(count, 1), np.int64), np.full(min(count, 1), count)
    while (size > 1).any():
        order = _sorted(order, middles, begin, size)
        begin, size = _children(begin, size, (size + 1) // 2)
    return order


def _children(begin: Indices, size: Indices, left: Indices) -> tuple[Indices, Indices]:
    """Of nodes whose first ones have so many lights: where those of each begin in the order, and
    how many they are; of those that have any."""
    begin = np.stack([begin, begin + left], 1).ravel()
    size = np.stack([left, size - left], 1).ravel()
    return begin[size > 0], size[size > 0]


def _sorted(order: Indices, middles: Doubles, begin: Indices, size: Indices) -> Indices:
    """Lights in an order, each node's along the longest side of the box about their middles."""
    there = middles[order]
    low, high = (f.reduceat(there, begin, axis=0) for f in (np.minimum, np.maximum))
    axis = np.repeat(np.argmax(high - low, axis=1), size)
    node = np.repeat(np.arange(len(size)), size)
    found: Indices = order[np.lexsort((there[np.arange(len(order)), axis], node))]
    return found


def _union(children: Bounds) -> Bounds:
    """Of each pair; what is dark widens nothing."""
    one, other = children.at(np.s_[0::2]), children.at(np.s_[1::2])
    lit = _either_of(one.flux > 0.0, _about(one, other), other)
    return _either_of(other.flux > 0.0, lit, one)


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
