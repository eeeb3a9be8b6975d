# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers that are even over passes: of a pixel, and of photons."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from addon.photon.film.film import in_first_half
from addon.photon.kernels.records import PIXEL
from addon.streams import Uniform
from tests.kernels.conftest import Bench
from tests.unit.glsl_files import VALUE, declare

PIXELS, PASSES, PHOTONS = 256, 96, 1000
UNIFORMS = {name: Uniform("uint") for name in ("seed", "pass_index")}
EVEN = declare(
    "draw_even",
    {"value": VALUE},
    inputs={"pixel": PIXEL},
    uniforms=UNIFORMS | {"dimension": Uniform("uint"), "frame_size": Uniform("ivec2")},
)
PHOTON = declare("draw_photon", {"value": VALUE}, uniforms=UNIFORMS | {"photons": Uniform("uint")})


def groups() -> list[list[int]]:
    """The passes that are even together: sixteen of a half, one after the other."""
    halves: tuple[list[int], list[int]] = [], []
    for number in range(PASSES):
        halves[in_first_half(number)].append(number)
    return [half[at : at + 16] for half in halves for at in range(0, len(half) - 15, 16)]


def drawn(bench: Bench) -> NDArray[Any]:
    """(PASSES, PIXELS, 4): two numbers of a dimension, and two of another."""
    given: dict[str, Any] = {"seed": 9, "dimension": 0x1000, "frame_size": (bench.WIDTH, 1)}
    return np.stack(
        [
            bench.run(EVEN, {}, given | {"pass_index": index}, count=PIXELS)["value"]
            for index in range(PASSES)
        ]
    )


def test_sixteen_passes_of_a_half_fill_the_square(one_bench: Bench) -> None:
    """Each of its halvings into sixteen boxes has one number in each; and chance moves them."""
    values = drawn(one_bench)
    assert values.min() >= 0.0 and values.max() < 1.0
    assert len(groups()) == 6
    for group in groups():
        for first in (0, 2):
            x, y = np.moveaxis(values[group][..., first : first + 2], -1, 0)  # (16, PIXELS)
            for k in range(5):
                box = (x * 2**k).astype(int) * 2 ** (4 - k) + (y * 2 ** (4 - k)).astype(int)
                assert (np.sort(box, axis=0) == np.arange(16)[:, None]).all()
    assert np.abs(values.mean(axis=(0, 1)) - 0.5).max() < 5 / (12 * values[..., 0].size) ** 0.5


def test_dimensions_and_halves_know_nothing_of_each_other(one_bench: Bench) -> None:
    """How often two are on the same side of the middle is up to chance, of each pixel."""
    is_high = drawn(one_bench) >= 0.5
    one, other = ([g for g in groups() if in_first_half(g[0]) == first] for first in (True, False))
    for group in groups():
        alike = (is_high[group][..., 0] == is_high[group][..., 2]).sum(axis=0)
        assert 4 < ((alike - 8) ** 2).mean() < 12  # 8: eight pairs, each alike or not
    for a, b in zip(one, other, strict=True):
        alike = (is_high[a][..., 0] == is_high[b][..., 0]).sum(axis=0)
        assert 4 < ((alike - 8) ** 2).mean() < 12


def test_photons_go_on_from_pass_to_pass(one_bench: Bench) -> None:
    """Of a half: as if a pass had sixteen times as many. Other groups have other numbers."""

    def starts(index: int) -> NDArray[Any]:
        given = {"seed": 9, "pass_index": index, "photons": PHOTONS}
        return one_bench.run(PHOTON, {}, given, count=16 * PHOTONS)["value"].reshape(-1, 4)

    firsts = []
    for group in groups():
        all_of_them = starts(group[0])
        firsts.append(all_of_them[0])
        for number, index in enumerate(group):
            ours = all_of_them[number * PHOTONS : (number + 1) * PHOTONS]
            np.testing.assert_array_equal(starts(index)[:PHOTONS], ours)
        counts = np.histogramdd(all_of_them, 4, [(0, 1)] * 4)[0]
        assert np.abs(counts - 16 * PHOTONS / 256).max() < 8
    assert len(np.unique(np.array(firsts), axis=0)) == len(firsts)
