# SPDX-License-Identifier: GPL-3.0-or-later
"""How bright lights are in each direction, as a table (glsl/lib/profile.glsl)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..kernels.records import PROFILE
from ..scene import Light


def profile_table(lights: tuple[Light, ...]) -> NDArray[Any]:
    """(P,) of PROFILE, one at least: those of the lights that have any, in order."""
    tables = [_table(light) for light in lights if light.profile]
    return np.concatenate(tables) if tables else PROFILE.zeros(1)


def mean_of(light: Light) -> float:
    """Of its profile over all directions, as photons see it: a cell has its corners' mean."""
    if not light.profile:
        return 1.0
    cells, solid = _cells(np.array(light.profile))
    return float((cells * solid).sum() / (4.0 * math.pi))


def _cells(profile: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Means of the corners (rows - 1, columns), and solid angles [sr], of a profile's cells."""
    between = (profile + np.roll(profile, -1, axis=1)) / 2
    heights = np.cos(np.linspace(0.0, math.pi, len(profile)))
    solid = -np.diff(heights)[:, None] * (2.0 * math.pi / profile.shape[1])
    return (between[1:] + between[:-1]) / 2, np.broadcast_to(solid, between[1:].shape)


def _table(light: Light) -> NDArray[Any]:
    profile = np.array(light.profile) / max(mean_of(light), 1e-30)
    cells, solid = _cells(profile)
    flux = cells * solid
    by_row = flux.sum(axis=1)
    table = PROFILE.zeros(profile.size).reshape(profile.shape)
    table["share"] = profile
    table["mean"][:-1] = cells
    table["along"][:-1] = np.cumsum(flux, axis=1) / np.maximum(by_row, 1e-30)[:, None]
    table["down"][:-1] = (np.cumsum(by_row) / max(by_row.sum(), 1e-30))[:, None]
    return table.reshape(-1)
