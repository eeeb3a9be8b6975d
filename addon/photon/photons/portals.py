# SPDX-License-Identifier: GPL-3.0-or-later
"""Portals: rectangles, such as windows, through which the world's light falls on what the picture
shows. Few rays from there tell about where they are, and more about each, to which it is fitted;
shadow rays go through them by glsl/lib/portals.glsl.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import photon_stream_native as native
from numpy.typing import NDArray

from ..kernels.records import PORTAL
from ..stage.geometry import Mesh
from ..stage.portals import MOST_PORTALS
from ..stage.upload import texels_of
from .importance import closest_to, frames_about
from .view import Doubles, View

RAYS = 16, 128, 512, 2048  # of each place, if fewer are too few; 16 tell of out of doors
PLACES = 64  # that stand for all that the picture shows
OPEN = 0.3  # of the rays: out of doors there are no portals
LIFT = 1e-4  # of places off their surface [scene units]
LAYERS = 5  # of what is transparent, and one more
ENOUGH, FEWEST = 300, 30  # rays that tell where portals are; of one of them
MOST_RAYS = 200  # of a portal, that are looked at
STEPS = 8  # of looking for middles
NORMALS, TURNS = 96, 24  # that are tried
SHARE = 0.75  # of the shadow rays, as in portals.glsl
LEAST_GAIN = 2.0  # over E[x^2] without
GOOD = 0.25  # of that: no more portals are tried
MOST = 0.03  # of the rays on a plane, on each side, that do not count
EACH = 2.0  # times the mean: of a place's rays no more are looked at
DARK = 0.1  # of the mean light: below it errors are not relative to a place's own
FITTED = (128, 64)  # places, and rays of each, that rectangles are fitted to
ABOUT = 1.6  # of its sides, where those go
AXES = 6  # of what stands about a window, that are tried as its axis or side
SQUARE, SLANTED = 0.03, 0.9  # cosines of axis and side at most, of two of those and of one
NO_PORTALS = PORTAL.zeros(0)


def portals_of(view: View, mesh: Mesh, transparent: NDArray[np.bool_]) -> NDArray[Any]:
    """(n,) of PORTAL: as many as leave the least variance of direct light from all around, by rays
    that did not make them; none if that gains little.

    `transparent` (K,): which triangles shadow rays to the world pass.
    """
    some = np.linspace(0, len(view.places) - 1, PLACES).astype(int)
    places, normals = view.places[some], view.normals[some]
    for count in RAYS:
        rays = _upwards(places, normals, count)
        comes = np.flatnonzero(_stopped_by(rays, mesh, transparent, by_any=True) < 0)
        is_first = count == RAYS[0]
        if len(comes) > OPEN * len(rays) or not (is_first or len(comes)):
            return NO_PORTALS
        if len(comes) >= ENOUGH and not is_first:
            escaped = _Escaped(rays[comes], comes % PLACES, places, normals)
            return _portals(escaped, partial(_fitted, view, mesh, transparent))
    return NO_PORTALS


def _upwards(places: Doubles, normals: Doubles, count: int) -> Doubles:
    """(count * n, 6) rays from places by the cosine, each of them in other directions."""
    at, own = np.arange(count)[:, None] + 0.5, np.arange(len(places))[None]
    golden = (math.sqrt(5.0) - 1.0) / 2.0
    share = (at / count + own * golden) % 1.0
    turn = 2.0 * np.pi * ((at * golden + own * golden**2) % 1.0)
    first, second = frames_about(normals)
    sine = np.sqrt(share)[..., None]
    directions = sine * (np.cos(turn)[..., None] * first + np.sin(turn)[..., None] * second)
    directions += np.sqrt(1.0 - share)[..., None] * normals
    lifted = np.broadcast_to(places + LIFT * normals, directions.shape)
    rays: Doubles = np.concatenate([lifted, directions], axis=2).reshape(-1, 6)
    return rays


def _stopped_by(
    rays: Doubles, mesh: Mesh, transparent: NDArray[np.bool_], by_any: bool = False
) -> NDArray[np.intp]:
    """(n,) at which triangle rays end, or `by_any` that is in their way; -1: they meet nothing but
    what is transparent, of which a few layers."""
    under_way, ends = np.arange(len(rays)), np.zeros(len(rays), np.intp)
    origins, directions = rays[:, :3].astype(np.float32), rays[:, 3:].astype(np.float32)
    beside: Any = -1
    opaque = not transparent.any()
    for _ in range(LAYERS):
        hits = mesh.meet(origins, directions, beside=beside, any_hit=opaque and by_any)
        triangle = hits[:, 1].astype(np.int32) - 1
        ends[under_way] = triangle
        if opaque:
            break
        on = (triangle >= 0) & transparent[np.maximum(triangle, 0)]
        if not on.any():
            break
        origins = origins[on] + hits[on, :1] * directions[on]
        directions, beside, under_way = directions[on], triangle[on], under_way[on]
    return ends


def _fitted(
    view: View, mesh: Mesh, transparent: NDArray[np.bool_], rectangles: list[_Rectangle]
) -> list[_Rectangle]:
    """The same, each moved to where it leaves the least variance of the light that comes through
    none before it: by rays about it, that few which escape anywhere tell of too little."""
    count, each = FITTED
    some = np.linspace(0, len(view.places) - 1, count).astype(int)
    places, normals = view.places[some], view.normals[some]
    before: list[_Rectangle] = []
    for rectangle in rectangles:
        rays, angles = rectangle.rays_from(places, each)
        above = np.einsum("mnk,mk->mn", rays[..., 3:], normals) > 0.0
        rays[..., :3] += LIFT * normals[:, None]
        seen, _ = np.nonzero(above)
        rays, angles = rays[above], angles[above]
        ends = _stopped_by(rays, mesh, transparent)
        comes = ends < 0
        for other in before:
            comes &= ~other.passed(rays)
        if comes.any():
            found = native.fit_window(
                texels_of(rectangle.record()).reshape(3, 4),
                places.astype(np.float32),
                normals.astype(np.float32),
                seen[comes].astype(np.uint32),
                rays[comes, 3:].astype(np.float32),
                angles[comes].astype(np.float32),
                _frames(mesh, ends[ends >= 0], rectangle.frame[0]),
                SHARE,
                DARK,
            )
            before.append(_Rectangle.of(found.reshape(-1).view(PORTAL.dtype)[0]))
        else:
            before.append(rectangle)
    return before


def _frames(mesh: Mesh, ends: NDArray[np.intp], across: Doubles) -> NDArray[np.float32]:
    """(k, 6) axes and sides of rectangles along what stands most about a window, by the triangles
    (n,) where rays end, or along that and `across`. Whatever tree holds those triangles."""
    _, first, often = np.unique(
        mesh.triangles["number"][ends], return_index=True, return_counts=True
    )
    some = ends[first]
    corners = mesh.corners[some, :, :3].astype(np.float64)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    largest = np.abs(normals).argmax(axis=1)
    normals *= np.sign(normals[np.arange(len(normals)), largest])[:, None]
    _, first, alike = np.unique(normals.round(2), axis=0, return_index=True, return_inverse=True)
    counts = np.bincount(alike.ravel(), often)
    most = normals[first[np.argsort(-counts, kind="stable")[:AXES]]]
    pairs = [(axis, side) for axis in most for side in most if abs(axis @ side) < SQUARE]
    pairs += [(axis, across) for axis in most if abs(axis @ across) < SLANTED]
    return np.array(pairs, np.float32).reshape(-1, 6)


@dataclass(frozen=True)
class _Escaped:
    """Rays that meet nothing, as many sent from each place, by the cosine."""

    rays: Doubles  # (n, 6)
    own: NDArray[np.intp]  # (n,) from which of the places
    places: Doubles  # (m, 3)
    normals: Doubles  # (m, 3)

    def part(self, which: Any) -> _Escaped:
        """Some of them."""
        return replace(self, rays=self.rays[which], own=self.own[which])

    def alike(self) -> Doubles:
        """(k, 6) of each place no more than EACH times the mean of those that have any: next to a
        window most escape, and do so elsewhere than through it."""
        counts = np.bincount(self.own, minlength=len(self.places))
        most = EACH * len(self.own) / np.maximum((counts > 0).sum(), 1)
        order = np.argsort(self.own, kind="stable")
        own = self.own[order]
        rank = np.arange(len(own)) - (np.cumsum(counts) - counts)[own]
        share = np.minimum(most / counts[own], 1.0)
        kept: Doubles = self.rays[order[np.floor((rank + 1) * share) > np.floor(rank * share)]]
        return kept

    def left(self, rectangles: list[_Rectangle]) -> float:
        """E[x^2] of shadow rays over what it is without portals, as relative to the light of each
        place as errors are measured, if the world is as bright everywhere."""
        cosines = np.maximum((self.rays[:, 3:] * self.normals[self.own]).sum(axis=1), 1e-9)
        through, angles = np.zeros(len(self.rays)), np.zeros(len(self.places))
        for one in rectangles:
            through += one.passed(self.rays)
            angles += 2.0 * np.pi * one.angles(self.places)
        by_cosine = cosines / np.pi
        by_portals = np.divide(through, angles[self.own], out=through, where=through > 0.0)
        density = SHARE * by_portals + (1.0 - SHARE) * by_cosine
        falls = np.bincount(self.own, minlength=len(self.places))
        squares = falls**2 + (DARK * falls.mean()) ** 2
        return float((by_cosine / density / squares[self.own]).sum() / (falls / squares).sum())


def _portals(
    escaped: _Escaped, fitted: Callable[[list[_Rectangle]], list[_Rectangle]]
) -> NDArray[Any]:
    """By rays that escape; `fitted` makes better ones of rectangles."""
    rays, others = escaped.part(slice(0, None, 2)).alike(), escaped.part(slice(1, None, 2))
    begin, best = np.median(escaped.places, axis=0), NO_PORTALS
    least = last = 1.0 / LEAST_GAIN
    for count in range(1, MOST_PORTALS + 1):
        middles = _middles(rays, count, begin)
        nearest = _off(rays, middles).argmin(axis=1)
        rectangles = fitted(
            [
                _rectangle(rays[nearest == k], middle)
                for k, middle in enumerate(middles)
                if (nearest == k).sum() >= FEWEST
            ]
        )
        left = others.left(rectangles)
        if count > 1 and left >= last:
            break
        last = left
        if left < least:
            best, least = np.concatenate([one.record() for one in rectangles]), left
        if left < GOOD:
            break
    return best


@dataclass(frozen=True)
class _Rectangle:
    middle: Doubles
    frame: Doubles  # (3, 3) rows across, up, and the normal
    size: Doubles  # (2,)

    @staticmethod
    def of(portal: NDArray[Any]) -> _Rectangle:
        """That of a PORTAL."""
        across, axis = (portal[name].astype(np.float64) for name in ("across", "axis"))
        frame = np.stack([across, np.cross(axis, across), axis])
        size = np.array([portal["width"], portal["height"]], np.float64)
        return _Rectangle(portal["middle"].astype(np.float64), frame, size)

    def at(self, rays: Doubles) -> Doubles:
        """(n, 2) where rays meet its plane, from its middle."""
        return _met(rays, self.middle, self.frame[2]) @ self.frame[:2].T

    def passed(self, rays: Doubles) -> NDArray[np.bool_]:
        """(n,) which rays go through it."""
        ahead = ((self.middle - rays[:, :3]) @ self.frame[2]) * (rays[:, 3:] @ self.frame[2]) > 0.0
        found: NDArray[np.bool_] = ahead & (np.abs(self.at(rays)) <= 0.5 * self.size).all(axis=1)
        return found

    def rays_from(self, places: Doubles, count: int) -> tuple[Doubles, Doubles]:
        """(m, count, 6) rays from places (m, 3) through it and about it, and for how much of all
        directions each stands [sr]."""
        golden = (math.sqrt(5.0) - 1.0) / 2.0
        at, own = np.arange(count)[None], np.arange(len(places))[:, None]
        u = np.stack(
            [(at + own * golden % 1.0) / count, (at * golden + own * golden**2) % 1.0], axis=2
        )
        ends = self.middle + (ABOUT * (u - 0.5) * self.size) @ self.frame[:2]
        way = ends - places[:, None]
        far = np.maximum(np.linalg.norm(way, axis=2), 1e-9)
        directions = way / far[..., None]
        area = ABOUT**2 * self.size.prod()
        angles: Doubles = area / count * np.abs(directions @ self.frame[2]) / far**2
        angles = np.minimum(angles, 2.0 * np.pi / count)  # of places next to it
        rays = np.concatenate([np.broadcast_to(places[:, None], way.shape), directions], axis=2)
        return rays, angles

    def angles(self, places: Doubles) -> Doubles:
        """(n,) its solid angles over 2 pi, 1 at most."""
        local = (places - self.middle) @ self.frame.T
        height = np.maximum(np.abs(local[:, 2]), 1e-20)
        total: Doubles = np.zeros(len(places))
        for x in (-1, 1):
            for y in (-1, 1):
                a = 0.5 * x * self.size[0] - local[:, 0]
                b = 0.5 * y * self.size[1] - local[:, 1]
                total += x * y * np.arctan2(a * b, height * np.sqrt(a * a + b * b + height**2))
        total /= 2.0 * np.pi
        return total

    def record(self) -> NDArray[Any]:
        """(1,) of PORTAL."""
        one = PORTAL.zeros(1)
        one["middle"], one["across"], one["axis"] = self.middle, self.frame[0], self.frame[2]
        one["width"], one["height"] = self.size
        return one


def _rectangle(rays: Doubles, middle: Doubles) -> _Rectangle:
    """The least rectangle that most rays come through, about a middle."""
    rays = rays[:: -(-len(rays) // MOST_RAYS)]
    normals = _hemisphere(NORMALS)
    axis = normals[_spread(rays, middle, normals).argmin()]
    for width in (0.1, 0.03):  # finer about the best
        tried = axis + width * np.concatenate([np.zeros((1, 3)), normals[::2], -normals[::2]])
        tried /= np.linalg.norm(tried, axis=1, keepdims=True)
        axis = tried[_spread(rays, middle, tried).argmin()]
    first, second = frames_about(axis[None])
    plane = np.concatenate([first, second])
    met = _met(rays, middle, axis) @ plane.T
    turns = np.linspace(0.0, np.pi / 2.0, TURNS, endpoint=False)
    turned = np.stack([np.cos(turns), np.sin(turns), -np.sin(turns), np.cos(turns)], axis=1)
    on_axes = np.sort(turned.reshape(-1, 2) @ met.T, axis=1)  # (2 TURNS, n)
    first_side, last_side = _within(on_axes, MOST)
    widths = (last_side - first_side).reshape(-1, 2)
    turn = int(widths.prod(axis=1).argmin())
    across = turned[turn].reshape(2, 2) @ plane
    # Across, up and normal, as GLSL has them by two of them.
    frame = np.vstack([across[0], np.cross(axis, across[0]), axis])
    low, high = (side[2 * turn : 2 * turn + 2] for side in (first_side, last_side))
    return _Rectangle(middle + 0.5 * (low + high) @ across, frame, high - low)


def _within(ordered: Doubles, beyond: float) -> tuple[Doubles, Doubles]:
    """(k,) between what most of each row (k, n) of numbers in order lies."""
    few = int(beyond * ordered.shape[1])
    low: Doubles = ordered[:, few]
    high: Doubles = ordered[:, -1 - few]
    return low, high


def _spread(rays: Doubles, middle: Doubles, normals: Doubles) -> Doubles:
    """(k,) the area on which most rays meet planes of these normals through a middle."""
    first, second = frames_about(normals)
    origin, direction = (rays[:, :3] - middle).T, rays[:, 3:].T
    along = normals @ direction
    along = np.where(np.abs(along) > 1e-3, along, 1e-3)
    ratio = normals @ origin / along
    few = int(MOST * len(rays))
    area: Doubles = np.ones(len(normals))
    for side in (first, second):
        at = side @ origin - ratio * (side @ direction)
        at.partition((few, len(rays) - 1 - few), axis=1)  # sooner than in order
        low, high = _within(at, MOST)
        area *= high - low
    return area


def sphere(count: int) -> Doubles:
    """Unit vectors about as far apart, in all directions, (count, 3)."""
    half = _hemisphere(count // 2)
    return np.concatenate([half, -half])


def _hemisphere(count: int) -> Doubles:
    """Unit vectors about as far apart (Fibonacci's lattice)."""
    at = np.arange(count) + 0.5
    z, turn = at / count, at * np.pi * (3.0 - np.sqrt(5.0))
    ring = np.sqrt(1.0 - z * z)
    return np.stack([ring * np.cos(turn), ring * np.sin(turn), z], axis=1)


def _met(rays: Doubles, middle: Doubles, axis: Doubles) -> Doubles:
    """(n, 3) where rays meet a plane through a middle, from there."""
    along = rays[:, 3:] @ axis
    along = np.where(np.abs(along) > 1e-6, along, 1e-6)
    origin = rays[:, :3] - middle
    found: Doubles = origin - (origin @ axis / along)[:, None] * rays[:, 3:]
    return found


def _middles(rays: Doubles, count: int, begin: Doubles) -> Doubles:
    """(count, 3) where rays come closest together: Lloyd's algorithm for lines, each new middle
    begun at the ray that all others are farthest from."""
    middles = closest_to(rays, np.ones(len(rays)), begin)[None]
    for _ in range(count - 1):
        far = int(_off(rays, middles).min(axis=1).argmax())
        origin, direction = rays[far, :3], rays[far, 3:]
        start = origin + direction * ((begin - origin) @ direction)
        middles = np.concatenate([middles, start[None]])
        for _ in range(STEPS):
            nearest = _off(rays, middles).argmin(axis=1)
            middles = np.array(
                [
                    closest_to(own, np.ones(len(own)), begin) if len(own) else middle
                    for own, middle in ((rays[nearest == k], m) for k, m in enumerate(middles))
                ]
            )
    return middles


def _off(rays: Doubles, middles: Doubles) -> Doubles:
    """(n, k) how far rays pass by middles."""
    to_middle = middles[None] - rays[:, None, :3]
    along = np.einsum("nkj,nj->nk", to_middle, rays[:, 3:])
    square = np.einsum("nkj,nkj->nk", to_middle, to_middle) - along**2
    off: Doubles = np.sqrt(np.maximum(square, 0.0))
    return off
