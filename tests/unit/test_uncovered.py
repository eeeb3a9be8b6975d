# SPDX-License-Identifier: GPL-3.0-or-later
"""Indirect light over its coverage, and what a picture makes of little that is covered."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from addon.photon.film.film import Statistics
from addon.photon.film.picture import BRIGHTER, first_half, picture_of


def means(light: Any, covered: Any, weight: Any) -> dict[str, Any]:
    """Those of a film (h, w, 4) that saw no other light; of (h, w) each."""
    light, covered, weight = (np.asarray(x, float)[..., None] for x in (light, covered, weight))
    nothing = np.zeros((*light.shape[:2], 3))
    return {
        "direct": np.concatenate([nothing, weight], axis=-1),
        "indirect": np.concatenate([np.repeat(light, 3, axis=-1), covered], axis=-1),
        "background": np.concatenate([nothing, np.ones_like(weight)], axis=-1),
        "normal": np.concatenate([nothing, weight], axis=-1),
        "combined": np.concatenate([np.repeat(light, 3, axis=-1), covered], axis=-1),
    }


def indirect(*of: Any) -> list[float]:
    """Of one row."""
    found = picture_of(means(*([row] for row in of)))["Indirect"]
    assert (found == found[..., :1]).all()
    return [float(x) for x in found[0, :, 0]]


def test_half_discs_are_divided() -> None:
    """At an edge, where those beside it are as bright."""
    assert indirect([1, 0.5, 0.5, 1], [1, 0.5, 0.5, 1], [1, 1, 1, 1]) == [1, 1, 1, 1]
    assert indirect([0.5, 0.25], [0.5, 0.25], [0.5, 0.5]) == [0.5, 0.5]


def test_more_than_all_is_divided() -> None:
    assert indirect([3, 3, 3], [1, 1.5, 1], [1, 1, 1]) == [3, 2, 3]


def test_specks_of_little_coverage_are_cut() -> None:
    """Of a tenth of a disc, ten times as bright as those beside it."""
    assert indirect([1, 1, 1], [1, 0.1, 1], [1, 1, 1])[1] == pytest.approx(
        BRIGHTER * (1 + 0.9 * 3 / 2.1)
    )


def test_what_is_little_brighter_than_its_row_stays() -> None:
    """As in a corner of things that are darker: there the quotient is of many photons."""
    assert indirect([0.7, 0.4, 0.7], [1, 0.4, 1], [1, 1, 1])[1] == pytest.approx(1.0)


def test_what_is_darker_than_its_row_stays() -> None:
    assert indirect([1, 0.02, 1], [1, 0.1, 1], [1, 1, 1])[1] == pytest.approx(0.2)


def test_beside_nothing() -> None:
    """Where those beside a pixel show no surface, its own quotient is all that there is."""
    found = indirect([0, 0.2, 0], [0, 0.2, 0], [0, 1, 0])
    assert found == [0, pytest.approx(1.0), 0]
    assert indirect([0.0], [0.0], [0.0]) == [0.0]
    assert indirect([-1.0], [0.5], [1.0]) == [0.0]  # a tilted filter left less than none


def test_halves_make_the_whole() -> None:
    """Whatever is taken for each channel of it."""
    rng = np.random.default_rng(1)
    light, covered = rng.exponential(1.0, (2, 6, 40, 3)), rng.uniform(0, 1.2, (6, 40))
    weight = np.where(rng.random((6, 40)) < 0.8, 1.0, 0.0)
    both = [means(np.zeros((6, 40)), covered * weight, weight) for _ in range(2)]
    for half, own in zip(both, light, strict=True):
        half["indirect"][..., :3] = own * (covered * weight)[..., None]
        half["combined"][..., :3] = half["indirect"][..., :3]
    whole = {name: (both[0][name] + both[1][name]) / 2 for name in both[0]}
    halves = [
        first_half(Statistics(2, whole, {}, {x: half[x] for x in ("indirect", "combined")}, 1))
        for half in both
    ]
    wanted = picture_of(whole)["Indirect"]
    np.testing.assert_allclose((halves[0] + halves[1]) / 2, wanted, rtol=1e-5, atol=1e-6)
    own = whole["indirect"][..., :3] / np.maximum(whole["indirect"][..., 3:], 0.1)
    assert 0.05 < (wanted < 0.999 * own)[weight > 0].mean() < 0.9
