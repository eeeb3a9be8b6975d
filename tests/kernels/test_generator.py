# SPDX-License-Identifier: GPL-3.0-or-later
"""Generator: photons of equal flux, and each light's share of them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from addon.photon.kernels.generator import Generator
from addon.photon.stage.geometry import Frame
from addon.photon.stage.light_tables import choose_lights, light_table
from addon.photon.stage.switches import made_lights
from tests.kernels.conftest import Bench
from tests.scenes import emitted_flux, plain_light

FRAME = Frame(np.array([1.0, 2.0, 3.0]), 4.0)
LIGHTS = (
    plain_light(
        "spot", "SPOT", (0, 0, 0), (40, 20, 10), (0, 0.6, -0.8), spot_size=1.2, spot_blend=0.3
    ),
    plain_light("off", "POINT", (1, 0, 0), (0, 0, 0)),
    plain_light("point", "POINT", (2, 0, 0), (3, 5, 7)),
    plain_light(
        "narrow", "SPOT", (3, 0, 0), (1e4, 0, 0), spot_size=math.radians(2), spot_blend=0.0
    ),
    plain_light("faint", "POINT", (4, 0, 0), (1e-3, 1e-3, 1e-3)),
)


def emit(
    bench: Bench,
    lights: Any = LIGHTS,
    photons: int = 50_000,
    index: int = 0,
    seed: int = 3,
    passes: int = 1,
) -> dict[str, Any]:
    """The photons of a pass, or of some: origin, direction, flux (n, 4)."""
    values = {"seed": seed, "pass_index": index, "light_count": len(lights)}
    values |= {"photons": photons, "passes": passes}
    table = light_table(lights, FRAME)
    choose_lights(table, np.array([emitted_flux(light) for light in lights]))
    made = made_lights({light.kind for light in lights})
    count = -(-photons * passes // 1024) * 1024
    return bench.run(Generator, {}, values, {"lights": table}, count=count, made=made)


def light_of(photons: dict[str, Any]) -> Any:
    """The number of each photon's light, by its place."""
    x = photons["origin"][:, 0] * FRAME.scale + FRAME.centre[0]
    return np.rint(x).astype(int)


def test_no_photon_too_many(bench: Bench) -> None:
    result = emit(bench, photons=5000)
    assert result["alive"] == 5000
    for name in ("origin", "direction", "flux"):
        assert result[name][:5000].any(axis=1).all() and not result[name][5000:].any()
    assert np.array_equal(result["flux"][:5000, 3], np.arange(1, 5001))
    assert (result["origin"][:5000, 3] == -1 - light_of(result)[:5000]).all()


def test_photons_of_passes_together(bench: Bench) -> None:
    """They are those of each pass, and tell by a power of two which it is."""
    result = emit(bench, photons=700, index=5, passes=8)
    assert result["alive"] == 8 * 700
    for part, power in enumerate((0, 25, -25, 50, -50, 75, -75, 100)):
        own = emit(bench, photons=700, index=5 + part)
        for name in ("origin", "direction", "flux"):
            together = result[name][part * 700 : (part + 1) * 700]
            if name == "flux":
                together[:, 3] *= np.float32(2.0) ** np.float32(-power)
            assert np.array_equal(together, own[name][:700])


def test_equal_flux_and_emitted_flux(bench: Bench) -> None:
    """Within a light all photons are equal; together they are what it emits."""
    n = 50_000
    result = {name: value[:n] for name, value in emit(bench, photons=n).items() if name != "alive"}
    light = light_of(result)
    total = sum(emitted_flux(x).mean() for x in LIGHTS)
    for number, one in enumerate(LIGHTS):
        flux = result["flux"][light == number, :3].astype(np.float64)
        share = emitted_flux(one).mean() / total
        # Systematic sampling: the light's share to within one photon.
        assert abs(len(flux) - n * share) <= 1, one.name
        if len(flux):
            assert (flux == flux[0]).all(), one.name
            # In scene units powers are divided by scale^2.
            each = emitted_flux(one) / FRAME.scale**2 / (n * share)
            assert np.allclose(flux[0], each, rtol=1e-5), one.name
    # The mean over the channels of a photon is the same for all lights.
    mean = result["flux"][:, :3].mean(axis=1)
    assert np.allclose(mean, total / FRAME.scale**2 / n, rtol=1e-5)


def test_faint_light_gets_its_share_over_passes(bench: Bench) -> None:
    """A light worth a third of a photon a pass sends one every third pass in the mean."""
    lights = (LIGHTS[2], LIGHTS[4])
    flux = [emitted_flux(x).mean() for x in lights]
    n = 1024
    expected = n * flux[1] / sum(flux)
    assert 0.1 < expected < 0.5
    counts = [
        np.count_nonzero(light_of(emit(bench, lights, n, index)) == 4) for index in range(150)
    ]
    assert max(counts) <= 1
    error = math.sqrt(expected * (1 - expected) / len(counts))
    assert abs(np.mean(counts) - expected) < 4 * error


def test_directions_stay_in_the_cone(bench: Bench) -> None:
    n = 50_000
    result = {name: value[:n] for name, value in emit(bench, photons=n).items() if name != "alive"}
    light = light_of(result)
    directions = result["direction"][:, :3].astype(np.float64)
    assert np.abs(np.linalg.norm(directions, axis=1) - 1).max() < 1e-6
    for number in (0, 3):
        cosine = directions[light == number] @ np.array(LIGHTS[number].direction)
        angle = np.arccos(np.clip(cosine, -1, 1))
        half = math.acos(1 - LIGHTS[number].parameters["outer"])
        assert 0.98 * half < angle.max() <= half * (1 + 1e-3)
    everywhere = directions[light == 2]
    error = 1 / math.sqrt(3 * len(everywhere))
    assert np.abs(everywhere.mean(axis=0)).max() < 4 * error


def test_sphere_light(bench: Bench) -> None:
    """Photons start on the sphere and leave it outwards, from every part of it alike."""
    n, radius = 50_000, 0.8
    lamp = (plain_light("lamp", "POINT", (1.0, 2.0, 3.0), (1, 1, 1), radius=radius),)
    result = emit(bench, lamp, n)
    origin, direction = (
        result[name][:n, :3].astype(np.float64) for name in ("origin", "direction")
    )
    assert np.allclose(np.linalg.norm(origin, axis=1), radius / FRAME.scale, rtol=1e-5)
    normal = origin / np.linalg.norm(origin, axis=1, keepdims=True)
    cosine = (normal * direction).sum(axis=1)
    assert cosine.min() > -1e-5
    # Uniform radiance: cos is distributed with density 2 cos, mean 2/3.
    assert cosine.mean() == pytest.approx(2 / 3, abs=4 * math.sqrt(1 / 18 / n))
    assert np.abs(normal.mean(axis=0)).max() < 4 / math.sqrt(3 * n)


def test_passes_and_seeds_differ(bench: Bench) -> None:
    same, again = emit(bench), emit(bench)
    assert all(np.array_equal(same[name], again[name]) for name in same)
    for other in (emit(bench, index=1), emit(bench, seed=4)):
        assert (other["direction"] == same["direction"]).all(axis=1).mean() < 0.05


def test_no_light_emits(bench: Bench) -> None:
    assert emit(bench, (LIGHTS[1],))["alive"] == 0
