# SPDX-License-Identifier: GPL-3.0-or-later
"""Sheets of rough glass: as white microfacets, times their colour; through them the same, on the
other side."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from addon.photon.scene import Lobe
from tests.kernels.conftest import Bench
from tests.kernels.test_lobes import COLOURED, COUNT, WHITE, at, probe

FLIP = np.array((1, 1, -1))
ALPHAS = (0.1, 0.5, 1.0)
ANGLES = (0, 40, 80)
Both = Callable[[Lobe, Any], Any]  # of a lobe and what turns directions round


def alike(alpha: float, found: Both, rtol: float = 1e-4) -> None:
    """What is found of plain microfacets, and of both kinds of sheets."""
    ways = {"alpha_x": alpha, "alpha_y": alpha, "turn": 0.0, "compensated": 1.0}
    expected = found(Lobe("ggx", WHITE, ways), 1)
    assert np.any(expected)
    for through, flip in ((0.0, 1), (1.0, FLIP)):
        lobe = Lobe("ggx_sheet", COLOURED, {"alpha": alpha, "through": through})
        np.testing.assert_allclose(found(lobe, flip), expected, rtol=rtol, atol=1e-5)


def colour_of(lobe: Lobe) -> Any:
    return np.asarray(lobe.colour)


@pytest.mark.thorough("0.5-", "-40")
@pytest.mark.parametrize("angle", ANGLES)
@pytest.mark.parametrize("alpha", ALPHAS)
def test_values_and_densities(one_bench: Bench, alpha: float, angle: float) -> None:
    light = np.random.default_rng(5).normal(size=(COUNT, 3))
    light /= np.linalg.norm(light, axis=1, keepdims=True)

    def found(lobe: Lobe, flip: Any) -> Any:
        viewer = np.broadcast_to(at(angle), light.shape)
        value, albedo = probe(one_bench, lobe, viewer, light * flip)
        return np.hstack([value[:, :3] / colour_of(lobe), value[:, 3:], albedo / (*lobe.colour, 1)])

    alike(alpha, found)


@pytest.mark.thorough("0.5-", "-40-")
@pytest.mark.parametrize("photon", [{}, {"PHOTON": 1}], ids=["eye", "photon"])
@pytest.mark.parametrize("angle", ANGLES)
@pytest.mark.parametrize("alpha", ALPHAS)
def test_rays_and_photons(
    one_bench: Bench, alpha: float, angle: float, photon: dict[str, int]
) -> None:
    """By which light goes on as much; white loses nothing of the eye's."""
    numbers = np.random.default_rng(13).integers(0, 1 << 24, (COUNT, 2)) / (1 << 24)

    def found(lobe: Lobe, flip: Any) -> Any:
        viewer = np.broadcast_to(at(angle), (COUNT, 3))
        first, second = probe(one_bench, lobe, viewer, numbers, SAMPLE=1, **photon)
        goes_on = (first[:, :3] * flip)[:, 2] > 0
        return (second[:, :3] * goes_on[:, None]).mean(axis=0) / colour_of(lobe)

    # Plain microfacets send some photons by the cosine, sheets do not.
    alike(alpha, found, rtol=0.03 if photon else 1e-3)
    if not photon:
        through = Lobe("ggx_sheet", WHITE, {"alpha": alpha, "through": 1.0})
        np.testing.assert_allclose(found(through, FLIP), 1.0, atol=0.02)
