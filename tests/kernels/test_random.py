# SPDX-License-Identifier: GPL-3.0-or-later
"""random4: uniform, independent, and the same on both layers."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.streams import Device, Uniform
from tests.kernels.conftest import Bench
from tests.kernels.statistics import excess
from tests.unit.glsl_files import VALUE, declare

COUNT = 1 << 18
UNIFORMS = {name: Uniform("uint") for name in ("seed", "pass_index", "dimension")}
KERNEL = declare("draw_random", {"value": VALUE}, uniforms=UNIFORMS)
REFLECT = 0x100


def draw(bench: Bench, seed: int = 0, pass_index: int = 0, dimension: int = 0) -> NDArray[Any]:
    """(COUNT, 4) numbers, one row an element."""
    uniforms = {"seed": seed, "pass_index": pass_index, "dimension": dimension}
    return bench.run(KERNEL, {}, uniforms, count=COUNT)["value"]


def dependence(a: NDArray[Any], b: NDArray[Any], bins: int = 32) -> float:
    """Excess of the chi-square of pairs over a square of uniform cells."""
    cell = (a * np.float32(bins)).astype(np.int32) * bins + (b * np.float32(bins)).astype(np.int32)
    counts = np.bincount(cell, minlength=bins * bins)
    return excess(counts, np.full(bins * bins, len(a) / bins**2))


@pytest.mark.parametrize(
    ("seed", "pass_index", "dimension"),
    [(0, 0, 0), (0, 1, 0), (1, 0, 0), (0xFFFFFFFF, 1 << 23, 1), (7, 3, REFLECT + 5)],
)
def test_uniform(one_bench: Bench, seed: int, pass_index: int, dimension: int) -> None:
    values = draw(one_bench, seed, pass_index, dimension)
    assert values.min() >= 0.0 and values.max() < 1.0
    for column in values.T:
        for bins in (1000, 16):
            counts = np.histogram(column, bins, (0, 1))[0]
            assert excess(counts, np.full(bins, COUNT / bins)) < 1
    # All 24 bits are in use: the low ones are as fair as the high ones.
    bits = (values.astype(np.float64) * (1 << 24)).astype(np.uint32)
    assert np.array_equal(bits, values.astype(np.float64) * (1 << 24))
    for bit in range(24):
        share = ((bits >> bit) & 1).mean(axis=0)
        assert np.abs(share - 0.5).max() < 5 * 0.5 / COUNT**0.5


def test_four_numbers_are_independent(one_bench: Bench) -> None:
    values = draw(one_bench)
    for a, b in combinations(range(4), 2):
        assert dependence(values[:, a], values[:, b]) < 1
    assert np.abs(np.corrcoef(values.T) - np.eye(4)).max() < 5 / COUNT**0.5


@pytest.mark.parametrize("distance", [1, 2, 3, 512, 1024, 1 << 16])
def test_elements_are_independent(one_bench: Bench, distance: int) -> None:
    values = draw(one_bench)
    for a in range(4):
        for b in range(4):
            assert dependence(values[:-distance, a], values[distance:, b]) < 1


@pytest.mark.parametrize(
    "other",
    [
        {"seed": 1},
        {"seed": 1 << 31},
        {"pass_index": 1},
        {"pass_index": 1 << 20},
        {"dimension": 1},
        {"dimension": REFLECT},
        {"dimension": 0x2000},
        {"dimension": 0x12000},
    ],
    ids=str,
)
def test_streams_of_numbers_are_independent(one_bench: Bench, other: dict[str, int]) -> None:
    """Neighbours in one counter share nothing, nor do an element and its neighbour's neighbour."""
    a, b = draw(one_bench), draw(one_bench, **other)
    for i in range(4):
        for j in range(4):
            assert dependence(a[:, i], b[:, j]) < 1
        assert dependence(a[1:, i], b[:-1, i]) < 1
    assert (a == b).mean() < 1e-5


def test_bounces_of_a_photon_are_independent(one_bench: Bench) -> None:
    """Triples over three bounces fill the cube."""
    triple = [draw(one_bench, dimension=REFLECT + bounce)[:, 0] for bounce in range(3)]
    counts = np.histogramdd(triple, 12, [(0, 1)] * 3)[0]
    assert excess(counts, np.full(12**3, COUNT / 12**3)) < 1


def test_layers_draw_the_same(device: Device) -> None:
    if not device.has_compute:
        pytest.skip(f"{device.name} has no compute programs")
    for state in ((0, 0, 0), (123456789, 99, 0x2003), (0xFFFFFFFF, 0xFFFFFF, 0xFFFFFFFF)):
        a, b = (draw(Bench(device, layer), *state) for layer in ("fragment", "compute"))
        assert a.tobytes() == b.tobytes()


def test_equals_the_paper_in_numpy(bench: Bench) -> None:
    """pcg4d (Jarzynski & Olano 2020) of a seed mixed by lowbias32, written again."""
    mixed = 7
    for shift, factor in ((16, 0x7FEB352D), (15, 0x846CA68B), (16, 1)):
        mixed = (mixed ^ (mixed >> shift)) * factor % (1 << 32)
    v = [np.arange(COUNT, dtype=np.uint32)]
    v += [np.full(COUNT, x, np.uint32) for x in (3, 5, mixed)]
    v = [x * np.uint32(1664525) + np.uint32(1013904223) for x in v]
    for shift in (True, False):
        v[0] = v[0] + v[1] * v[3]
        v[1] = v[1] + v[2] * v[0]
        v[2] = v[2] + v[0] * v[1]
        v[3] = v[3] + v[1] * v[2]
        if shift:
            v = [x ^ (x >> np.uint32(16)) for x in v]
    expected = np.stack([(x >> np.uint32(8)) / np.float64(1 << 24) for x in v], -1)
    assert np.array_equal(draw(bench, seed=7, pass_index=5, dimension=3), expected)
