# SPDX-License-Identifier: GPL-3.0-or-later
"""A box about what the picture shows, whose faces are portals for photons outside it.

Of what a plain of kilometres scatters, little falls on the things that stand on it, and each of
the few photons that do would bring what fell on acres. So where light comes from afar, photons go
on from surfaces outside the box to its faces, too (glsl/lib/reflection.glsl).

By the light that falls straight from where few photons have first landed, at all distances, on
places of the picture, the box is chosen that leaves the least variance.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..kernels.records import PORTAL
from ..stage.geometry import Mesh
from ..stage.portals import MOST_BY_PORTAL, WIDE_PORTAL
from .landed import Landed, trace_few
from .mapper import Mapper
from .view import CELL_WIDTH, EYE_RAYS_A_SIDE, Doubles, View

LARGE = 0.5  # [scene units] the picture's width at its near places from which on no box is tried
PHOTONS, LOOKED_AT = 1 << 12, 1 << 9  # that are traced, and of which light is followed
PLACES = 256  # that stand for all that the picture shows
PAIRS = 2000  # of both, as likely as they add to the variance, that tell of boxes
ALBEDO = 0.5  # what a surface is taken to reflect
LIFT = 2e-6  # of places off their surface [scene units]
ROUNDED = 4e-4  # by as much photons' normals may be off: a plain does not see itself
NEARLY = 0.99  # of the way to a place, on which nothing may stand
DARK = 0.1  # of the mean: what is darker counts no more
PLAIN = 0.5  # of the photons start wherever these have
BEYOND, MARGINS = (0.0, 0.05), (0.02, 0.2, 0.6)  # of first boxes: of places left out, and of sides
ROUNDS = 3  # in which faces are moved
# What is as near to the box, over its sides, shall be inside, and as much more: who comes past the
# faces is rare, and bright.
BESIDE, MORE = 0.25, 0.03
THINNEST = 0.02  # of a box, over its longest side
LEAST_GAIN = 2.0  # over the variance without
AXES = range(3)


@dataclass(frozen=True)
class _Pairs:
    """Places where photons have landed, and of the picture, that see each other."""

    start: NDArray[np.intp]  # (n,) which photon it is
    places: Doubles  # (n, 3) where it has landed
    normals: Doubles  # (n, 3)
    directions: Doubles  # (n, 3) from there to the place of the picture
    ends: Doubles  # (n, 3) that one
    lit: Doubles  # (k, 3) places of the picture that any light comes to in this way
    share: float  # of all of them


def is_small(view: View) -> bool:
    """Whether the picture, at its near places, is less than LARGE wide."""
    return EYE_RAYS_A_SIDE * view.pixel * view.near < LARGE


@dataclass(frozen=True)
class Surrounded:
    """What is shown that has light from about it."""

    faces: NDArray[Any]  # (6,) of PORTAL, of a box
    middle: Doubles  # (3,) of that
    share: float  # of all that is shown


def faces_about(view: View) -> NDArray[Any]:
    """(6,) of PORTAL, of the box about most of what is shown, whatever they gain."""
    box = view.bounds()
    side = (box[1] - box[0]).max()
    return _faces(box + np.outer((-1.0, 1.0), np.full(3, MORE * side + LIFT)))


def surrounded(mapper: Mapper, view: View, mesh: Mesh, index: int) -> Surrounded | None:
    """None if faces gain little. Traces photons of a pass, which start at all distances from what
    is shown."""
    pairs = _pairs(trace_few(mapper, index, PHOTONS), view, mesh)
    if pairs is None:
        return None
    gain, box = _best(pairs)
    if gain < LEAST_GAIN:
        return None
    box = _about(box, pairs.lit)
    return Surrounded(_faces(box), box.mean(axis=0), pairs.share)


def _pairs(found: Landed, view: View, mesh: Mesh) -> _Pairs | None:
    """PAIRS of all, as likely as what goes by the cosine from one to the other adds to the
    picture's variance; None if no light comes that way."""
    some = slice(0, found.first, -(-max(found.first, 1) // LOOKED_AT))
    places, normals = (each.astype(np.float64) for each in found.about(some))
    flux = found.flux[some]
    golden = (np.sqrt(5.0) - 1.0) / 2.0
    shown = ((np.arange(PLACES) + 0.5) * golden % 1.0 * len(view.places)).astype(int)
    ends, facing, seen = view.places[shown], view.normals[shown], view.weights[shown]
    area = (CELL_WIDTH * view.pixel * view.away(ends)) ** 2
    way = ends[None] - places[:, None]
    far = np.maximum(np.linalg.norm(way, axis=2), 1e-20)
    directions = way / far[..., None]
    leaves = np.maximum(np.einsum("nmk,nk->nm", directions, normals) - ROUNDED, 0.0)
    falls = np.maximum(-np.einsum("nmk,mk->nm", directions, facing) - ROUNDED, 0.0)
    chance = np.minimum(ALBEDO * leaves * falls * area / (np.pi * far**2), 1.0)
    chance *= _see(mesh, places + LIFT * normals, directions, NEARLY * far, chance > 0.0)
    light = flux @ chance / area
    dark = DARK * np.average(light, weights=seen)
    if not dark > 0.0:
        return None
    masses = (flux**2)[:, None] * chance * (seen / (light**2 + dark**2) / area**2)
    up_to = np.cumsum(masses)
    drawn = np.searchsorted(up_to, (np.arange(PAIRS) + 0.5) / PAIRS * up_to[-1])
    start, end = np.divmod(drawn, PLACES)
    lit = light > 0.0
    return _Pairs(
        start,
        places[start],
        normals[start],
        directions[start, end],
        ends[end],
        ends[lit],
        float(np.average(lit, weights=seen)),
    )


def _see(
    mesh: Mesh, places: Doubles, directions: Doubles, far: Doubles, asked: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """(n, m) along which of the directions (n, m, 3) from places (n, 3) nothing stands that near;
    of those that are asked for."""
    start, end = np.nonzero(asked)
    ways = directions[start, end]
    hits = mesh.meet(places[start], ways, far[start, end], any_hit=True)
    found = asked.copy()
    found[start, end] = hits[:, 1] == 0.0
    return found


def _best(pairs: _Pairs) -> tuple[float, Doubles]:
    """What a box gains, and its lowest and its highest corner."""
    tried = []
    for beyond in BEYOND:
        low, high = np.quantile(pairs.ends, (beyond, 1.0 - beyond), axis=0)
        sides = np.maximum(high - low, max(THINNEST * (high - low).max(), LIFT))
        middle = (low + high) / 2.0
        for margin in MARGINS:
            box = middle + np.outer((-1.0, 1.0), (0.5 + margin) * sides)
            tried.append((_gain(pairs, box), box))
    gain, box = max(tried, key=lambda one: one[0])
    for at in range(ROUNDS):
        for end, axis, by in ((end, axis, by) for end in (0, 1) for axis in AXES for by in (-1, 1)):
            other = box.copy()
            other[end, axis] += by * 0.5 ** (at + 2) * (box[1] - box[0])[axis]
            if (own := _gain(pairs, other)) > gain:
                gain, box = own, other
    return gain, box


def _gain(pairs: _Pairs, box: Doubles) -> float:
    """The variance without a box over that with it, where some photons start as those that were
    traced, and others where it is worth most with the box: without it, who would learn where?"""
    angles, met = _seen(pairs, box)
    by_portal = MOST_BY_PORTAL * np.sqrt(np.minimum(1.0, angles / WIDE_PORTAL))
    density = np.divide(met, angles, out=np.zeros(len(met)), where=angles > 0.0)
    by_cosine = (pairs.directions * pairs.normals).sum(axis=1) / np.pi
    left = by_cosine / ((1.0 - by_portal) * by_cosine + by_portal * density)
    worth = np.sqrt(np.bincount(pairs.start, left, LOOKED_AT))
    rarer = 1.0 / (PLAIN + (1.0 - PLAIN) * worth / worth.mean())[pairs.start]
    return float(rarer.sum() / (rarer * left).sum())


def _about(box: Doubles, places: Doubles) -> Doubles:
    """With those of places (n, 3) inside that are near."""
    side = np.outer((-1.0, 1.0), box[1] - box[0])
    near = places[
        ((places > (box + BESIDE * side)[0]) & (places < (box + BESIDE * side)[1])).all(1)
    ]
    if not len(near):
        return box
    low, high = np.minimum(box[0], near.min(axis=0)), np.maximum(box[1], near.max(axis=0))
    found: Doubles = np.array([low, high]) + MORE * side
    return found


def _seen(pairs: _Pairs, box: Doubles) -> tuple[Doubles, Doubles]:
    """(n,) the solid angles of a box's faces from where pairs start, as glsl/lib/openings.glsl has
    them, and the sum of the densities of their directions in each, times those."""
    angles, met = np.zeros(len(pairs.places)), np.zeros(len(pairs.places))
    half = (box[1] - box[0]) / 2.0
    for axis, end in ((axis, end) for axis in AXES for end in (0, 1)):
        across, outward = [k for k in AXES if k != axis], 2.0 * end - 1.0
        middle = box.mean(axis=0)
        middle[axis] = box[end, axis]
        away = pairs.places - middle
        area = 4.0 * half[across].prod()
        height = outward * away[:, axis]
        toward = -outward * pairs.directions[:, axis]
        above = np.abs(pairs.normals[:, across]) @ half[across] - (pairs.normals * away).sum(axis=1)
        far = np.maximum(np.linalg.norm(away, axis=1), 1e-6)
        angle = np.where((above > 0.0) & (height > 0.0), area * height / far**3, 0.0)
        angles += angle
        meets = (angle > 0.0) & (toward > 1e-12)
        way = np.divide(height, toward, out=np.zeros(len(far)), where=meets)
        at = away[:, across] + way[:, None] * pairs.directions[:, across]
        inside = meets & (np.abs(at) <= half[across]).all(axis=1)
        met += np.divide(angle * way**2, area * toward, out=np.zeros(len(far)), where=inside)
    return angles, met


def _faces(box: Doubles) -> NDArray[Any]:
    """(6,) of PORTAL, seen from outside."""
    faces = PORTAL.zeros(2 * len(AXES))
    for number, face in enumerate(faces):
        axis, end = divmod(number, 2)
        across, up = (axis + 1) % 3, (axis + 2) % 3
        face["middle"] = box.mean(axis=0)
        face["middle"][axis] = box[end, axis]
        face["axis"][axis], face["across"][across] = 2.0 * end - 1.0, 1.0
        face["width"], face["height"] = (box[1] - box[0])[[across, up]]
    return faces
