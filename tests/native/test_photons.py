# SPDX-License-Identifier: GPL-3.0-or-later
"""sort_photons through its Python binding."""

from __future__ import annotations

import numpy as np
import photon_stream_native as native
import pytest

CELLS = (7, 5, 3)


@pytest.mark.parametrize("columns", [3, 4])
@pytest.mark.parametrize("count", [0, 1, 100_000])
def test_equals_a_stable_sort(count: int, columns: int) -> None:
    positions = np.random.default_rng(0).random((count, columns), np.float32)
    origin, cell_size = np.array([0.1, 0.0, -0.2], np.float32), np.float32(0.15)
    start, order = native.sort_photons(positions, origin, float(cell_size), CELLS)
    index = np.floor((positions[:, :3] - origin) / cell_size).astype(int)
    x, y, z = np.clip(index, 0, np.array(CELLS) - 1).T
    cell = (z * CELLS[1] + y) * CELLS[0] + x
    assert start.dtype == order.dtype == np.uint32
    assert (order == np.argsort(cell, kind="stable")).all()
    assert (start == np.searchsorted(np.sort(cell), np.arange(np.prod(CELLS) + 1))).all()


def test_accepts_plain_numbers() -> None:
    start, order = native.sort_photons(np.ones((2, 3), np.float32), [0, 0, 0], 1, (2, 2, 2))
    assert start.tolist() == [0] * 8 + [2] and order.tolist() == [0, 1]


def test_position_that_is_not_finite() -> None:
    positions = np.zeros((1000, 4), np.float32)
    positions[:, 3] = np.nan  # Not a coordinate.
    native.sort_photons(positions, [0, 0, 0], 1.0, CELLS)
    positions[321, 2] = np.inf
    with pytest.raises(ValueError, match=r"positions\[321, 2\] = inf is not finite"):
        native.sort_photons(positions, [0, 0, 0], 1.0, CELLS)


@pytest.mark.parametrize(
    ("origin", "cell_size", "cells", "message"),
    [
        ([0, np.nan, 0], 1.0, CELLS, r"origin\[1\] = NaN is not finite"),
        ([0, 0], 1.0, CELLS, "origin: expected three"),
        ([0, 0, 0], 0.0, CELLS, "cell_size = 0 is not a positive number"),
        ([0, 0, 0], np.inf, CELLS, "cell_size = inf is not a positive number"),
        ([0, 0, 0], 1.0, (7, 0, 3), r"cells\[1\] = 0 is not positive"),
        ([0, 0, 0], 1.0, (7, 5, -3), r"cells\[2\] = -3 is not positive"),
        ([0, 0, 0], 1.0, (512, 512, 513), "more than 134217728 cells"),
    ],
)
def test_bad_grid(
    origin: list[float], cell_size: float, cells: tuple[int, int, int], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        native.sort_photons(np.zeros((1, 3), np.float32), origin, cell_size, cells)


def test_bad_positions() -> None:
    with pytest.raises(ValueError, match="positions: expected 3 or 4 columns, got 2"):
        native.sort_photons(np.zeros((1, 2), np.float32), [0, 0, 0], 1.0, CELLS)
    with pytest.raises(TypeError, match="positions: expected float32, got float64"):
        native.sort_photons(np.zeros((1, 3)), [0, 0, 0], 1.0, CELLS)  # type: ignore[arg-type]
