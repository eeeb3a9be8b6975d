# SPDX-License-Identifier: GPL-3.0-or-later
"""The phase function of media: its values, its samples and their density, all around."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.photon.scene import Lobe, Material, Scene
from addon.photon.stage.kinds import PHASE, check_kinds, lobe_kinds
from tests.kernels.conftest import Bench
from tests.kernels.test_lobes import COLOURED, at, probe, sample
from tests.scenes import camera

ANISOTROPIES = (-0.9, -0.3, 0.0, 5e-4, 0.5, 0.99)


def henyey_greenstein(g: float, cosine: Any) -> NDArray[np.float64]:
    """[1/sr]"""
    value: NDArray[np.float64] = (1 - g * g) / (4 * math.pi * (1 + g * g - 2 * g * cosine) ** 1.5)
    return value


def lobe(g: float) -> Lobe:
    return Lobe(PHASE, COLOURED, {"anisotropy": g})


def test_no_surface_has_it() -> None:
    assert [name for name, kind in lobe_kinds().items() if kind.is_in_media] == [PHASE]
    materials = (Material("m", lobes=(lobe(0.0),)),)
    with pytest.raises(Exception, match="material 'm': kind 'phase' is none of"):
        check_kinds(Scene(camera((0, 0, 1), (0, 0, 0)), materials=materials))


@pytest.mark.parametrize("g", ANISOTROPIES)
def test_values_are_of_the_angle_alone(one_bench: Bench, g: float) -> None:
    """Times the cosine to whatever normal, its colour times Henyey & Greenstein's."""
    rng = np.random.default_rng(5)
    viewer, light = rng.normal(size=(2, 4096, 3))
    viewer /= np.linalg.norm(viewer, axis=1, keepdims=True)
    light /= np.linalg.norm(light, axis=1, keepdims=True)
    viewer, light = viewer.astype(np.float32), light.astype(np.float32)
    first, _ = probe(one_bench, lobe(g), viewer, light)
    exact = henyey_greenstein(g, -(viewer.astype(float) * light).sum(axis=1))
    found = first[:, :3] * np.abs(light[:, 2:])
    bound = 2e-3 if g > 0.9 else 1e-4
    np.testing.assert_allclose(found, exact[:, None] * COLOURED, rtol=bound)
    np.testing.assert_allclose(first[:, 3], exact, rtol=bound)


@pytest.mark.parametrize("g", ANISOTROPIES)
@pytest.mark.parametrize("angle", (0, 85, 140))
def test_samples_go_by_it(one_bench: Bench, g: float, angle: float) -> None:
    """Their cosine to straight on has its distribution, and what they weigh is the colour."""
    viewer = at(angle)
    directions, weights = sample(one_bench, lobe(g), viewer)
    np.testing.assert_allclose(weights, np.broadcast_to(COLOURED, weights.shape), rtol=1e-6)
    cosines = np.sort(-(directions * viewer).sum(axis=1))
    if abs(g) < 1e-3:
        below = (1 + cosines) / 2
    else:
        below = (1 - g * g) / (2 * g) * (1 / np.sqrt(1 + g * g - 2 * g * cosines) - 1 / (1 + g))
    even = (np.arange(len(cosines)) + 0.5) / len(cosines)
    assert np.abs(below - even).max() < 1.95 / math.sqrt(len(cosines))  # Kolmogorov, 0.1 %
    across = np.cross(viewer, (0.0, 1.0, 0.0) if angle else (1.0, 0.0, 0.0))
    assert abs((directions @ across).mean()) < 4 / math.sqrt(3 * len(cosines))
