# SPDX-License-Identifier: GPL-3.0-or-later
"""Weights of lobes that are packed into a float."""

from __future__ import annotations

import numpy as np
import pytest

from addon.photon.kernels.records import SHAPE
from addon.photon.stage.spectrum import WEIGHT_STEP
from tests.kernels.conftest import Bench
from tests.unit.glsl_files import VALUE, declare

PACK = declare(
    "pack_weight",
    {"found": VALUE},
    inputs={"weights": VALUE},
    structure=("TINTED",),
    records=(SHAPE,),
)


def packed(bench: Bench, weights: np.ndarray) -> np.ndarray:
    given = np.zeros((len(weights), 4), np.float32)
    given[:, :3] = weights
    found = bench.run(PACK, {"weights": given}, defines={"TINTED": 1})["found"]
    kept: np.ndarray = found[:, :3].astype(float)
    return kept


@pytest.mark.parametrize(
    ("low", "high", "off"),
    [(1.0 / 64.0, 32.0, 0.002), (32.0, 2.0**17, 0.008), (1e-6, 1.0 / 64.0, None)],
)
def test_how_much_is_rounded(bench: Bench, low: float, high: float, off: float | None) -> None:
    """Of the largest channel; of the faintest all by as much."""
    rng = np.random.default_rng(3)
    most = np.exp(rng.uniform(np.log(low), np.log(high), 4096))
    weights = (most[:, None] * rng.random((4096, 3))).astype(np.float32)
    weights[np.arange(4096), rng.integers(0, 3, 4096)] = most
    away = np.abs(packed(bench, weights) - weights).max(axis=1)
    assert (away / most).max() < off if off else away.max() < 0.501 / 511.0 / 64.0


def test_what_is_exact(bench: Bench) -> None:
    """Nothing, white, and the colours of a spectrum, whose sum is white."""
    steps = np.random.default_rng(4).integers(0, 512, (512, 3)) * WEIGHT_STEP
    weights = np.concatenate([[[0.0] * 3, [1.0] * 3, [4.0] * 3], steps]).astype(np.float32)
    np.testing.assert_allclose(packed(bench, weights), weights, rtol=1e-6)
