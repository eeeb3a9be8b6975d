# SPDX-License-Identifier: GPL-3.0-or-later
"""With which probability photons start at each light, and where on it: by what reaches the
picture.

With shares p of the photons, lights add a / p each to the irradiance's relative variance, of which
the least is left where p goes with the root of a. So do parts of what one light emits.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
import photon_stream_native as native
from numpy.typing import NDArray

from ..stage.aims import Aim, Aims
from ..stage.tables import Tables
from .importance import Importance, closest_to
from .view import Doubles, View

# What these photons have not met must be found by others: at least so many start by flux alone, and
# at most, for places that no light reaches are none to wait for.
LEAST_PLAIN, MOST_PLAIN = 0.25, 0.5
ENOUGH_PHOTONS = 24  # photons of a light that tell where others shall start
FAR_BY_FLUX = 0.1  # of photons of light from afar, where others go to all distances alike
NO_AIMS: Mapping[int, Aim] = MappingProxyType({})
NEAREST = 0.1  # of the way from the eye to what it sees: no photons are closer together at first


@dataclass(frozen=True)
class Starts:
    """Where photons start."""

    shares: Doubles  # (L,) the probabilities of lights
    aims: Aims | None


def even_shares(tables: Tables) -> Doubles:
    """As many photons of each group of lights, and within it by flux."""
    groups, shares = tables.light_groups, np.zeros(len(tables.by_flux))
    for group in groups:
        shares[group] = tables.by_flux[group] / tables.by_flux[group].sum() / len(groups)
    return shares


def starts_by(
    importance: Importance,
    tables: Tables,
    view: View,
    are_aimed: bool = True,
    proposals: Mapping[int, Aim] = NO_AIMS,
) -> Starts:
    """Those that leave the least variance. `proposals`: aims of lights, for where they leave less
    than what is learned."""
    least = max(LEAST_PLAIN, 1.0 - importance.known)
    aims = _aims_by(importance, tables, view, min(least, MOST_PLAIN)) if are_aimed else {}
    for light, aim in proposals.items():
        if importance.counted(light) < ENOUGH_PHOTONS:
            continue
        own, learned = importance.of(light), aims.get(light)
        if _moment(own, tables, light, aim) < _moment(own, tables, light, learned):
            aims[light] = aim
    moments = _moments(importance, tables, aims)
    flux, groups = tables.by_flux, tables.light_groups
    of_group = np.array([flux[group].sum() for group in groups])
    parts = [moments[group] / flux[group] for group in groups]
    deviation = np.sqrt([part.sum() * own for part, own in zip(parts, of_group, strict=True)])
    least = min(least, MOST_PLAIN) if are_aimed else least
    told = deviation if deviation.any() else of_group
    share = least * of_group + (1.0 - least) * told / told.sum()
    shares = np.zeros(len(flux))
    for group, own, all_of_it in zip(groups, share, of_group, strict=True):
        shares[group] = flux[group] * (own / all_of_it)
    return Starts(shares, Aims(len(flux), aims) if aims else None)


def variance(importance: Importance, tables: Tables, starts: Starts) -> float:
    """What a pass's photons would leave that start so, up to a factor."""
    moments = _moments(importance, tables, starts.aims.by_light if starts.aims else {})
    there = moments > 0.0
    return float((moments[there] / starts.shares[there]).sum())


def proposed(distant_lights: int, view: View, extent: float, middle: Doubles) -> dict[int, Aim]:
    """Lights afar aimed at all distances from a middle alike, but for a share that goes by flux;
    `extent`: the radius of the discs that photons start on."""
    halvings = int(-np.log2(_nearest(view, middle, extent)))
    nodes = np.zeros((2 * halvings + 1, 4), np.float32)
    # Each halves a disc's inner part again, and that one is the first of its halves.
    order = np.arange(halvings + 1)
    inside = FAR_BY_FLUX * 0.5**order + (1.0 - FAR_BY_FLUX) * (1.0 - order / (halvings + 1.0))
    at = np.maximum(2 * order[:-1] - 1, 0)
    nodes[at, 0], nodes[at, 2] = 2.0, 2 * order[:-1] + 1
    nodes[at, 1] = inside[1:] / inside[:-1]
    return {light: Aim(nodes, middle) for light in range(distant_lights)}


def _nearest(view: View, middle: Doubles, extent: float) -> float:
    """The square of the distance down to which photons are looked for about a middle, over that of
    the disc about it; `extent` as of `proposed`."""
    reach = extent + float(np.linalg.norm(middle))
    return float(np.clip(NEAREST * view.near / reach, 1e-7, 1.0)) ** 2


def _aims_by(importance: Importance, tables: Tables, view: View, least: float) -> dict[int, Aim]:
    """Those of lights that have a group for themselves, where they leave less variance."""
    aims = {}
    for group in tables.light_groups:
        light = int(group[0])
        own = importance.of(light)
        if len(group) > 1 or len(own.mass) < ENOUGH_PHOTONS:
            continue
        middle, nearest = np.zeros(3), 1.0
        if light < tables.distant_lights:
            # As in a window.
            middle = closest_to(own.rays, np.sqrt(own.mass), view.middle)
            nearest = _nearest(view, middle, float(-own.rays[0, :3] @ own.rays[0, 3:]))
        numbers, masses = _about(own, tables, light, middle)
        masses = (masses / masses.max()).astype(np.float32)
        nodes, _ = native.aim_tree(numbers, masses, least, nearest)
        if len(nodes) > 1:
            aims[light] = Aim(nodes, middle)
    return aims


def _moments(importance: Importance, tables: Tables, aims: dict[int, Aim]) -> Doubles:
    """What each light adds to the variance, times its photons."""
    count = len(tables.by_flux)
    moments: Doubles = np.bincount(importance.light, importance.mass, count).astype(np.float64)
    for light, aim in aims.items():
        moments[light] = _moment(importance.of(light), tables, light, aim)
    return moments


def _moment(own: Importance, tables: Tables, light: int, aim: Aim | None) -> float:
    """What a light adds to the variance, times its photons, which `own` are."""
    if aim is None or not len(own.mass):
        return float(own.mass.sum())
    numbers, masses = _about(own, tables, light, aim.middle)
    return float((masses / native.aim_pdf(aim.nodes, numbers)).sum())


def _about(
    own: Importance, tables: Tables, light: int, middle: Doubles
) -> tuple[NDArray[np.float32], Doubles]:
    """The numbers (n, 4) that a light's photons start by, and what they count for (n,): of a light
    afar those that they would start by about a middle."""
    if light >= tables.distant_lights:
        return own.numbers, own.mass
    numbers, larger = own.about(middle)
    return numbers, own.mass * larger
