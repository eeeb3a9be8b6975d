# SPDX-License-Identifier: GPL-3.0-or-later
"""Portals of photons: rectangles, such as a door's gap, through which light that has bounced falls
on what the picture shows. Photons go on through them by glsl/lib/openings.glsl.

They are looked for where what is about the eye sees no lamp, by the paths of few photons that
count, and kept where other photons tell that they leave much less variance at equal time.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import photon_stream_native as native
from numpy.typing import NDArray

from ..kernels.records import PORTAL
from ..stage.geometry import Mesh
from ..stage.light_tree import is_of_media
from ..stage.tables import Tables
from .landed import Landed, trace_few
from .mapper import Mapper
from .portals import LIFT, NO_PORTALS, sphere
from .view import Doubles, ShownCells, View

AROUND = 256  # rays from the eye
MOST_ASKED = 8  # lamps, the strongest
LIT = 0.05  # of what these rays meet, that sees a lamp: then light does not come from elsewhere
PHOTONS = 1 << 15  # that tell where portals are, and as many what they are worth
TELLING = 240  # paths that are looked at
ROUNDS = 2
FEWEST = 40  # photons that count
# Where this share of photons, those that count most, adds less than that of the variance, all are
# about as good.
FEW, MOST_OF_IT = 0.05, 0.6
WIDE = 2.5  # how much wider cells are, of which few photons tell
DARK = 0.1  # of the mean: what is darker counts no more
LEAST_GAIN = 1.5  # over the variance without, at as many landings


def sees_no_lamp(mesh: Mesh, tables: Tables, eye: list[float] | None) -> bool:
    """Whether next to nothing about the eye sees a lamp; False where there is no eye, or
    light from afar."""
    # What media emit is inside a mesh, which would hide it.
    near = np.flatnonzero((tables.by_flux > 0.0) & ~is_of_media(tables.lights))
    if eye is None or tables.distant_lights or not len(near):
        return False
    directions = sphere(AROUND)
    origins = np.tile(np.array(eye), (AROUND, 1))
    far, triangle = mesh.meet(origins, directions).astype(np.float64).T[:2]
    met = (origins + (far - LIFT)[:, None] * directions)[triangle > 0.0]
    strongest = near[np.argsort(-tables.by_flux[near], kind="stable")[:MOST_ASKED]]
    lamps = tables.lights["position"][strongest].astype(np.float64)
    lit = sees_lamp(mesh, np.tile(met, (len(lamps), 1)), np.repeat(lamps, len(met), axis=0))
    return len(met) > 0 and bool(lit.reshape(len(lamps), -1).any(axis=0).mean() < LIT)


def portals_by(mapper: Mapper, tables: Tables, view: View, index: int) -> NDArray[Any]:
    """(n,) of PORTAL; none if they gain little. Traces passes of photons from `index` on.

    Paths tell where portals are best that were found by first ones, of which there are few.
    """
    shown = view.cells(WIDE, by_side=True)
    plain = landed = _landed(mapper, index, shown)
    totals = _totals([plain], shown)
    if not _is_promising(plain, totals):
        return NO_PORTALS
    found = []
    for at in range(ROUNDS):
        portals = _found(landed, totals)
        if not len(portals):
            break
        tables.set_photon_portals(portals)
        landed = _landed(mapper, index + at + 1, shown)
        totals = _totals([plain, landed], shown)
        # Photons take the longer the more often they land.
        left = _variance(landed, totals) / _variance(plain, totals)
        found.append((left * len(landed.flux) / len(plain.flux), portals))
    tables.set_photon_portals(NO_PORTALS)
    left, portals = min(found, key=lambda one: one[0], default=(1.0, NO_PORTALS))
    return portals if left * LEAST_GAIN <= 1.0 else NO_PORTALS


@dataclass(frozen=True)
class _Landed(Landed):
    """And those of them that have bounced and are in what is shown."""

    rows: NDArray[np.intp]  # (k,) which these are
    at: NDArray[np.intp]  # (k,) the cells that they are in
    shown: Doubles  # (k,) their flux


def _landed(mapper: Mapper, index: int, shown: ShownCells) -> _Landed:
    """Trace few photons of a pass."""
    found = trace_few(mapper, index, PHOTONS)
    at = shown.at(found.places[found.first :], found.facing[found.first :])
    there = np.flatnonzero(at >= 0)
    rows = found.first + there
    return _Landed(**vars(found), rows=rows, at=at[there].astype(np.intp), shown=found.flux[rows])


def _totals(passes: list[_Landed], shown: ShownCells) -> Doubles:
    """(c,) what the squares of fluxes in cells count, by the strict measure: by the mean of passes,
    as none knows of all that others bring."""
    count, total = len(shown.numbers), np.zeros(len(shown.numbers))
    for landed in passes:
        total += np.bincount(landed.at, landed.shown, count) / len(passes)
    dark = DARK * shown.seen * total.sum() / max(shown.seen.sum(), 1e-30)
    weights: Doubles = np.divide(
        shown.seen, total**2 + dark**2, out=np.zeros(count), where=dark > 0.0
    )
    return weights


def _variance(landed: _Landed, totals: Doubles) -> float:
    """What a pass's photons add to the picture's."""
    return float((totals[landed.at] * landed.shown**2).sum())


def _is_promising(landed: _Landed, totals: Doubles) -> bool:
    """Whether few of a pass's photons add most of the variance."""
    own = totals[landed.at] * landed.shown**2
    of_photons = np.sort(np.bincount(landed.numbers[landed.rows], own, PHOTONS))[::-1]
    most = of_photons[: int(FEW * PHOTONS)].sum()
    return bool(most > MOST_OF_IT * of_photons.sum())


def _found(landed: _Landed, totals: Doubles) -> NDArray[Any]:
    """By the paths of some photons, as likely as they count; these landed in the order of bounces.

    Where flux is less than it would be by the cosine, as much likelier are paths: so the flux
    alone is what they count for.
    """
    numbers, masses = landed.numbers, np.zeros(len(landed.flux))
    masses[landed.rows] = totals[landed.at] * landed.shown
    of_photons = np.bincount(numbers, masses, PHOTONS)
    if (of_photons > 0.0).sum() < FEWEST:
        return NO_PORTALS
    up_to = np.cumsum(of_photons)
    drawn = np.searchsorted(up_to, (np.arange(TELLING) + 0.5) / TELLING * up_to[-1])
    times = np.bincount(drawn, minlength=PHOTONS)
    rows = np.flatnonzero(times[numbers])
    rows = rows[np.argsort(numbers[rows], kind="stable")]
    of_path = numbers[rows]
    own = masses[rows] * times[of_path] / of_photons[of_path]
    rectangles, _ = native.photon_portals(
        *landed.about(rows), of_path.astype(np.uint32), own.astype(np.float32)
    )
    portals = PORTAL.zeros(len(rectangles) // 3)
    portals.view(np.float32).reshape(-1, 4)[:] = rectangles
    return portals


def sees_lamp(mesh: Mesh, places: Doubles, lamp: Doubles) -> NDArray[np.bool_]:
    """(n,) from which places a lamp is seen, one (3,) or each its own (n, 3)."""
    away = lamp - places
    far = np.linalg.norm(away, axis=1)
    directions = away / np.maximum(far, 1e-20)[:, None]
    hits = mesh.meet(places, directions, 0.99 * far, any_hit=True)
    seen: NDArray[np.bool_] = hits[:, 1] == 0.0
    return seen
