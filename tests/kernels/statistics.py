# SPDX-License-Identifier: GPL-3.0-or-later
"""Chi-square tests without scipy. Seeds are fixed, so nothing flakes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

# Of the standard normal distribution: exceeded with probability 1e-4.
Z_1E4 = 3.719


def critical(freedom: int) -> float:
    """The chi-square value exceeded with probability 1e-4 (Wilson & Hilferty 1931)."""
    a = 2.0 / (9.0 * freedom)
    return freedom * (1.0 - a + Z_1E4 * math.sqrt(a)) ** 3


def excess(observed: Any, expected: Any) -> float:
    """Chi-square of counts over its critical value: above 1 means another distribution.

    Cells that expect fewer than 10 are lumped together.
    """
    observed, expected = np.ravel(observed).astype(float), np.ravel(expected).astype(float)
    assert abs(observed.sum() / expected.sum() - 1) < 1e-3, "not the same number of samples"
    rare = expected < 10
    if rare.any():
        observed = np.append(observed[~rare], observed[rare].sum())
        expected = np.append(expected[~rare], expected[rare].sum())
        if expected[-1] < 1:
            assert observed[-1] <= 12, "samples where none can be"
            observed, expected = observed[:-1], expected[:-1]
    chi2 = ((observed - expected) ** 2 / expected).sum()
    return float(chi2 / critical(len(expected) - 1))


class Cells:
    """Cells of directions about an axis, as full as a sample of directions makes them, and points
    in them to integrate over."""

    RINGS, SECTORS, FINE = 24, 16, (32, 16)  # and steps in each

    def __init__(self, directions: Any, axis: Any, fine: tuple[int, int] = FINE) -> None:
        """`fine`: steps in each, more where a lobe is bright up to the horizon, across cells."""
        self.steps = fine
        self.axis = np.asarray(axis, float)
        side = np.array([0.61, -0.37, 0.7])  # along no plane that a lobe may end at
        across = np.cross(self.axis, side) / np.linalg.norm(np.cross(self.axis, side))
        self._frame = np.stack([across, np.cross(self.axis, across)])
        levels = np.quantile(
            self.versine(directions), np.linspace(0, 1, self.RINGS * self.steps[0] + 1)
        )
        levels[0] = 0.0
        self._edges = np.append(levels[: -1 : self.steps[0]], 2.0)
        # What is rare reaches far.
        last = levels[-2] + (2.0 - levels[-2]) * np.geomspace(1e-6, 1.0, 64)
        ends = np.concatenate([levels[:-1], last])
        self._of_ring = np.minimum(np.arange(len(ends) - 1) // self.steps[0], self.RINGS - 1)
        middle, width = (ends[1:] + ends[:-1]) / 2, np.diff(ends)
        turns = self.SECTORS * self.steps[1]
        azimuth = -np.pi + (np.arange(turns) + 0.5) * 2 * np.pi / turns
        sine = np.sqrt(middle * (2 - middle))
        flat = np.stack([np.cos(azimuth), np.sin(azimuth)], -1) @ self._frame
        points = sine[:, None, None] * flat + (1 - middle)[:, None, None] * self.axis
        self.points = points.reshape(-1, 3)
        self._area = width[:, None] * (2 * np.pi / turns)

    def versine(self, directions: Any) -> Any:
        """1 - cos of the angle from the axis, precise for small ones."""
        return np.minimum(((np.asarray(directions, float) - self.axis) ** 2).sum(axis=1) / 2, 2.0)

    def count(self, directions: Any) -> Any:
        """(rings, sectors) how many lie in each."""
        x, y = self._frame @ np.asarray(directions, float).T
        bins = [self._edges, np.linspace(-np.pi, np.pi, self.SECTORS + 1)]
        versine = np.minimum(self.versine(directions), 2.0 - 1e-12)
        return np.histogram2d(versine, np.arctan2(y, x), bins)[0]

    def integral(self, values: Any) -> Any:
        """(rings, sectors, ...) integrals over solid angle of values at the points."""
        values = np.asarray(values, float)
        fine = values.reshape(len(self._area), self.SECTORS, self.steps[1], *values.shape[1:])
        area = self._area.reshape(-1, 1, *[1] * (values.ndim - 1))
        sums = np.zeros((self.RINGS, *fine.shape[1:2], *values.shape[1:]))
        np.add.at(sums, self._of_ring, fine.sum(axis=2) * area)
        return sums


def assert_density(directions: Any, cells: Cells, density: Any, share: float = 1.0) -> None:
    """Directions, which are a share of all, have a density given at the cells' points."""
    mass = cells.integral(density)
    assert abs(mass.sum() / share - 1) < 3e-3, "the density's integral is another"
    assert excess(cells.count(directions), mass / mass.sum() * len(directions)) < 1
