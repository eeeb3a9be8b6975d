# SPDX-License-Identifier: GPL-3.0-or-later
"""Each sampler against its density, filters against their integrals."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.photon.settings import FILTER_DEFINES
from addon.streams import Uniform
from tests.kernels.conftest import Bench
from tests.kernels.statistics import excess
from tests.unit.glsl_files import VALUE, declare

COUNT = 1 << 18
COSINE, DISC, MASS = range(3)
FILTERS = tuple(FILTER_DEFINES)
DRAW = declare(
    "draw_sample",
    {"value": VALUE},
    inputs={"uniform_numbers": VALUE},
    structure=("SAMPLE", *FILTERS),
)
DENSITY = declare("eval_density", {"value": VALUE}, inputs={"at": VALUE})
RINGS, SECTORS = 40, 16


def texels(*columns: Any) -> NDArray[np.float32]:
    """(n, 4) from up to four columns."""
    made = np.zeros((len(columns[0]), 4), np.float32)
    for at, column in enumerate(columns):
        made[:, at] = column
    return made


def draw(bench: Bench, kind: int) -> NDArray[np.float64]:
    """COUNT samples of uniform numbers of 24 bits, as random4 gives them."""
    bits = np.random.default_rng(11).integers(0, 1 << 24, (COUNT, 4))
    u = (bits / (1 << 24)).astype(np.float32)
    result = bench.run(DRAW, {"uniform_numbers": u}, defines={"SAMPLE": kind})
    value = result["value"].astype(np.float64)
    assert np.isfinite(value).all() and (value[:, 3] == 1.0).all()
    return value


def masses(bench: Bench, edges: Any) -> NDArray[np.float64]:
    """Integral of the density [1/sr] over rings between versines (1 - cos)."""
    fine = 64
    steps = edges[:-1, None] + (np.arange(fine) + 0.5) / fine * np.diff(edges)[:, None]
    at = {"at": texels(1.0 - steps.ravel())}
    density = bench.run(DENSITY, at)["value"][:, 0].astype(np.float64)
    return 2 * np.pi * density.reshape(steps.shape).mean(axis=1) * np.diff(edges)


def rings_and_sectors(directions: NDArray[Any], edges: Any) -> NDArray[np.float64]:
    """Counts by versine and azimuth; what lies beyond the last edge, in the last ring."""
    sine2 = directions[:, 0] ** 2 + directions[:, 1] ** 2
    cosine = directions[:, 2]
    # 1 - cos without cancellation, above the horizon; the sampled z is float32.
    versine = np.where(cosine > 0, sine2 / (1 + np.abs(cosine)), 1 - cosine)
    azimuth = np.arctan2(directions[:, 1], directions[:, 0])
    versine = np.minimum(versine, edges[-1] * (1 - 1e-12))
    bins = [edges, np.linspace(-np.pi, np.pi, SECTORS + 1)]
    return np.histogram2d(versine, azimuth, bins)[0]


def assert_rings(counts: NDArray[np.float64], mass: NDArray[np.float64]) -> None:
    """Rings have their mass, sectors are alike, and the two are independent."""
    assert excess(counts.sum(axis=1), mass * COUNT) < 1
    assert excess(counts.sum(axis=0), np.full(SECTORS, COUNT / SECTORS)) < 1
    assert excess(counts, np.repeat(mass[:, None] / SECTORS, SECTORS, 1) * COUNT) < 1


def test_cosine_hemisphere(one_bench: Bench) -> None:
    directions = draw(one_bench, COSINE)
    assert np.abs(np.linalg.norm(directions[:, :3], axis=1) - 1).max() < 1e-6
    assert directions[:, 2].min() >= 0
    edges = np.linspace(0, 1, RINGS + 1)
    mass = masses(one_bench, edges)
    assert mass.sum() == pytest.approx(1, abs=1e-3)
    assert_rings(rings_and_sectors(directions, edges), mass / mass.sum())
    assert np.allclose(mass, np.diff(1 - (1 - edges) ** 2), rtol=1e-3)  # integral of cos / pi


def test_disc(one_bench: Bench) -> None:
    x, y, *_ = draw(one_bench, DISC).T
    assert (x * x + y * y).max() <= 1 + 1e-6
    bins = [np.linspace(0, 1, RINGS + 1), np.linspace(-np.pi, np.pi, SECTORS + 1)]
    counts = np.histogram2d(np.minimum(x * x + y * y, 1), np.arctan2(y, x), bins)[0]
    assert excess(counts, np.full(counts.shape, COUNT / counts.size)) < 1


# Directions in one float.

PACK = declare("pack_and_unpack", {"value": VALUE}, inputs={"direction": VALUE})


def test_packed_directions(bench: Bench) -> None:
    rng = np.random.default_rng(4)
    directions = rng.normal(size=(COUNT, 3))
    axes = np.array([(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1)], float)
    axes = axes[np.any(axes != 0, axis=1)]
    directions[: len(axes)] = axes
    directions[100:200] = axes[0] * [1, 1, 1e-7]  # close to the fold of the octahedron
    directions[200:300, 2] = 0.0
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    value = bench.run(PACK, {"direction": texels(*directions.T)})["value"].astype(np.float64)
    code, back = value[:, 3], value[:, :3]
    assert np.array_equal(code, np.round(code)) and code.min() >= 0 and code.max() < 1 << 24
    assert np.abs(np.linalg.norm(back, axis=1) - 1).max() < 1e-6
    sine = np.linalg.norm(np.cross(directions, back), axis=1)
    angle = np.arctan2(sine, (directions * back).sum(axis=1))
    assert np.degrees(angle).max() < 0.1


WITH_FLUX = declare("pack_with_flux", {"value": VALUE}, inputs={"direction": VALUE, "flux": VALUE})


def test_directions_in_fluxes(bench: Bench) -> None:
    """A flux keeps sixteen bits and, in the mean, more; the direction all that packing leaves."""
    rng = np.random.default_rng(5)
    directions = rng.normal(size=(COUNT, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    fluxes = np.float32(10 ** rng.uniform(-12, 3, (COUNT, 3)))
    fluxes[:100, 1] = 0.0
    given = {"direction": texels(*directions.T), "flux": texels(*fluxes.T)}
    value = bench.run(WITH_FLUX, given)["value"]
    packed = bench.run(PACK, {"direction": given["direction"]})["value"][:, 3]
    apart = np.abs(value[:, 3] - packed)  # packing it twice may move it a step
    assert (np.minimum(apart, np.abs(apart - 4096)) <= 1).mean() > 0.999
    change = value[100:, :3].astype(np.float64) / fluxes[100:] - 1
    assert np.abs(change).max() < 2.0**-15 and abs(change.mean()) < 1e-6
    assert 0 < value[:100, 1].max() < 1.1e-30
    # The native core packs and reads them alike: tests/physics/test_gathered.py.


# Density filters.

FILTER = declare(
    "eval_disc_filter",
    {"value": VALUE},
    inputs={"distance": VALUE},
    uniforms={"radius": Uniform("float")},
    structure=FILTERS,
)


@pytest.mark.parametrize("radius", [1e-3, 0.3, 1.0])
@pytest.mark.parametrize("name", ["constant", "cone", "gaussian", "epanechnikov"])
def test_filter_integrates_to_one(one_bench: Bench, name: str, radius: float) -> None:
    n = 100_000
    distance = (np.arange(n) + 0.5) / n * radius
    value = one_bench.run(
        FILTER,
        {"distance": texels(distance)},
        {"radius": radius},
        defines={f"FILTER_{name.upper()}": 1},
    )["value"][:, 0].astype(np.float64)
    assert value.min() >= 0
    assert (2 * np.pi * distance * value).mean() * radius == pytest.approx(1, abs=1e-4)
    assert np.diff(value).max() <= 1e-6 * value.max()  # never more weight farther away
    if name in ("cone", "epanechnikov"):
        assert value[-1] < 1e-4 * value[0]


@pytest.mark.parametrize("name", ["constant", "cone", "gaussian", "epanechnikov"])
def test_filter_is_sampled_as_it_weighs(one_bench: Bench, name: str) -> None:
    """Coverage's probes: (distance / radius)^2 falls as the filter's mass does over the disc."""
    define = {f"FILTER_{name.upper()}": 1}
    numbers = np.random.default_rng(12).integers(0, 1 << 24, (COUNT, 4)) / (1 << 24)
    drawn = one_bench.run(
        DRAW,
        {"uniform_numbers": numbers.astype(np.float32)},
        defines={"SAMPLE": MASS, **define},
    )["value"][:, 0]
    rings, fine = 50, 200
    squares = (np.arange(rings * fine) + 0.5) / (rings * fine)
    weight = one_bench.run(
        FILTER, {"distance": texels(np.sqrt(squares))}, {"radius": 1.0}, defines=define
    )["value"][:, 0]
    # dA = pi d(x^2): the mass of a ring between equal steps of x^2.
    mass = np.pi * weight.astype(np.float64).reshape(rings, fine).mean(axis=1) / rings
    counts = np.histogram(drawn, bins=rings, range=(0.0, 1.0))[0]
    assert counts.sum() == COUNT and excess(counts, mass / mass.sum() * COUNT) < 1
