# SPDX-License-Identifier: GPL-3.0-or-later
"""Every lobe of glsl/bsdf: samples by its density, weights, albedo, energy, reciprocity.

What lets light through has most of its tests in test_glass_lobes.py, what media have all in
test_phase.py."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.photon.kernels.records import LOBE, MATERIAL_LOBE, SHAPE
from addon.photon.scene import SUBSURFACE, Lobe, Material
from addon.photon.scene.materials import COATS
from addon.photon.stage.kinds import lobe_kinds
from addon.photon.stage.material_tables import material_tables
from addon.photon.stage.programs import program_tables
from addon.photon.stage.switches import made_bsdf
from addon.streams import Uniform
from tests.kernels.conftest import Bench
from tests.kernels.statistics import Cells, assert_density
from tests.unit.glsl_files import VALUE, declare

COUNT = 1 << 18
ANGLES = (0, 30, 60, 85)  # of the viewer from the normal [deg]
SOME_ANGLES = [0, *(pytest.param(x, marks=pytest.mark.thorough) for x in (30, 60)), 85]
WHITE, COLOURED = (1.0, 1.0, 1.0), (0.5, 0.1, 0.3)


@dataclass(frozen=True)
class Case:
    """What is tested of a kind."""

    parameters: tuple[Mapping[str, Any], ...]  # sets of them
    is_reciprocal: bool = True
    # How far the albedo is from what is reflected, if it is Cycles' estimate; else it is a bound.
    # Metal's tells nothing but how choices are made: no layer hangs on it.
    estimate: float | None = None


def microfacets(**more: Any) -> tuple[Mapping[str, Any], ...]:
    """Smooth and rough, of one bounce and of all, and stretched."""
    shapes = (0.04, 0.04, 0.0, 1.0), (0.25, 0.25, 0.0, 0.0), (0.25, 0.25, 0.0, 1.0)
    shapes += (0.6, 0.6, 0.0, 1.0), (0.5, 0.1, 0.7, 1.0)
    names = "alpha_x", "alpha_y", "turn", "compensated"
    return tuple(dict(zip(names, shape, strict=True)) | more for shape in shapes)


def glass(ior: float, reflects: float, is_open: float = 0.0) -> Mapping[str, Any]:
    """Of a kind that reflects, and how."""
    return {"ior": ior, "tint": WHITE, "reflects": reflects, "open": is_open}


# A kind without an entry fails.
CASES = {
    "mirror": Case(({},)),
    "phong": Case(tuple({"exponent": n} for n in (0.0, 1.0, 10.0, 1000.0))),
    "ggx": Case(microfacets(), is_reciprocal=False, estimate=0.008),
    "ggx_metal": Case(microfacets(tint=(1.0, 0.6, 0.2)), is_reciprocal=False, estimate=0.35),
    "ggx_dielectric": Case(microfacets(ior=1.5), is_reciprocal=False, estimate=0.015),
    "transparent": Case(({},)),
    "translucent": Case(({},)),
    # Held to "ggx" by test_sheets.py.
    "ggx_sheet": Case(tuple({"alpha": 0.25, "through": through} for through in (0.0, 1.0))),
    "glass": Case((glass(1.5, 2.0), glass(1 / 1.5, 1.0), glass(1.0, 0.0), glass(1.5, 2.0, 1.0))),
    "ggx_glass": Case(
        tuple(
            glass(ior, reflects, is_open) | {"alpha": alpha, "compensated": compensated}
            for ior, reflects, alpha, compensated, is_open in (
                (1.5, 2.0, 0.04, 1.0, 0.0),
                (1 / 1.5, 2.0, 0.04, 1.0, 0.0),
                (1.33, 1.0, 0.25, 1.0, 0.0),
                (1 / 1.5, 2.0, 0.6, 1.0, 0.0),
                (2.4, 2.0, 0.25, 0.0, 0.0),
                (1.5, 0.0, 0.25, 0.0, 0.0),
                (1 / 1.5, 0.0, 0.1, 0.0, 0.0),
                (1.5, 2.0, 0.25, 1.0, 1.0),
                (1 / 1.5, 0.0, 0.1, 0.0, 1.0),
            )
        ),
        is_reciprocal=False,
    ),
    # Of no wavelength they are as glass.
    "dispersive_glass": Case((glass(1.5, 2.0) | {"dispersion": 0.03},)),
    "ggx_dispersive_glass": Case(
        (
            {
                "alpha": 0.25,
                "switches": 5.0,
                "ior": 1.5,
                "tint": WHITE,
                "open": 0.0,
                "dispersion": 0.03,
            },
        ),
        is_reciprocal=False,
    ),
    "coat": Case(
        tuple(
            {"alpha": a, "ior": 1.5, "cover": c} for a, c in ((1e-3, 1.0), (0.09, 0.5), (0.5, 1.0))
        ),
        is_reciprocal=False,
        estimate=0.015,
    ),
    # About the surface's own normal, as a coat.
    "bent_coat": Case(
        tuple(
            {"alpha": a, "ior": 1.5, "cover": c, "normal_x": 0.5, "normal_y": 0.5, "normal_z": 1.0}
            for a, c in ((0.09, 0.5), (0.5, 1.0))
        ),
        is_reciprocal=False,
        estimate=0.015,
    ),
    "oren_nayar": Case(tuple({"diffuse_roughness": r} for r in (0.3, 1.0)), estimate=0.003),
    "sheen": Case(tuple({"roughness": r} for r in (0.2, 0.6)), is_reciprocal=False, estimate=0.001),
    **{
        kind: Case(
            tuple({"size": s, "edge": e} for s, e in ((0.5, 0.0), (0.3, 0.2), (0.7, 0.9))), False
        )
        for kind in ("toon", "glossy_toon")
    },
    "velvet": Case(tuple({"sigma": s} for s in (0.3, 1.0))),
}
# By the same code as others of their kind, or as ggx of that shape.
LIKE_OTHERS = ("phong 10.0", "ggx_metal 0.25", "ggx_dielectric 0.25", "ggx_metal 0.6")
LIKE_OTHERS += ("ggx_dielectric 0.6", "toon 0.3", "glossy_toon 0.3")


def case_of(kind: str, parameters: Mapping[str, Any]) -> Any:
    name = " ".join([kind, *map(str, parameters.values())])
    marks = [pytest.mark.thorough] if name.startswith(LIKE_OTHERS) else []
    return pytest.param(Lobe(kind, COLOURED, parameters), id=name, marks=marks)


EACH = [case_of(kind, parameters) for kind, case in CASES.items() for parameters in case.parameters]
ABOVE = [each for each in EACH if not lobe_kinds()[each.values[0].kind].transmits]
BROAD = [each for each in ABOVE if not lobe_kinds()[each.values[0].kind].is_delta]
DELTA = [each for each in ABOVE if each not in BROAD]
# What a photon's flux is multiplied by at such a lobe at most. By visible normals alone it is 3.3.
MOST_GAINED = 2.4
PROBE = declare(
    "probe_lobe",
    {"first": VALUE, "second": VALUE},
    inputs={"viewer": VALUE, "other": VALUE},
    uniforms={
        "colour": Uniform("vec3"),
        "kind": Uniform("float"),
        "parameters": Uniform("vec4"),
        "more": Uniform("vec4"),
    },
    records=(LOBE, SHAPE),
    structure=("SAMPLE", "PHOTON", "PASSED"),
)


def test_every_kind_is_tested() -> None:
    surfaces = {name for name, kind in lobe_kinds().items() if not kind.is_in_media}
    assert CASES.keys() == surfaces - {SUBSURFACE}  # tests/physics/test_subsurface.py


def probe(bench: Bench, lobe: Lobe, viewer: Any, other: Any, **defines: int) -> tuple[Any, Any]:
    """The kernel's two outputs, (n, 4) each, of directions or numbers (n, 3 or 2)."""
    materials = (Material("m", lobes=(lobe,)),)
    row: Any = material_tables(materials, program_tables(materials).compiled)[1][0]
    assert row.dtype == MATERIAL_LOBE.dtype
    inputs = {}
    for name, given in (("viewer", viewer), ("other", other)):
        inputs[name] = np.zeros((len(other), 4), np.float32)
        inputs[name][:, : np.shape(given)[-1]] = given
    values = {
        "colour": tuple(map(float, row["colour"])),
        "kind": float(row["kind"]),
        "parameters": tuple(map(float, row["parameters"])),
        "more": tuple(map(float, row["more"])),
    }
    made = made_bsdf({lobe.kind})
    result = bench.run(PROBE, inputs, values, defines=defines, made=made)
    return result["first"].astype(float), result["second"].astype(float)


def sample(bench: Bench, lobe: Lobe, viewer: Any, seed: int = 11) -> tuple[Any, Any]:
    """COUNT directions and their weights, of uniform numbers of 24 bits as random4 gives them."""
    numbers = np.random.default_rng(seed).integers(0, 1 << 24, (COUNT, 2)) / (1 << 24)
    first, second = probe(bench, lobe, np.broadcast_to(viewer, (COUNT, 3)), numbers, SAMPLE=1)
    assert np.isfinite(first).all() and np.isfinite(second).all() and second.min() >= 0
    assert np.abs(np.linalg.norm(first[:, :3], axis=1) - 1).max() < 1e-5
    return first[:, :3], second[:, :3]


def at(angle: float) -> NDArray[np.float64]:
    return np.array([math.sin(math.radians(angle)), 0.0, math.cos(math.radians(angle))])


@pytest.mark.parametrize("angle", SOME_ANGLES)
@pytest.mark.parametrize("lobe", BROAD)
def test_samples_have_the_density(one_bench: Bench, lobe: Lobe, angle: float) -> None:
    viewer = at(angle)
    first, _ = sample(one_bench, lobe, viewer, seed=12)
    fine = (64, 48) if lobe.kind == "sheen" else Cells.FINE
    # Toon's has an edge about the normal.
    axis = np.array((0.0, 0.0, 1.0)) if lobe.kind == "toon" else viewer * (-1, -1, 1)
    cells = Cells(first, axis, fine)
    density = probe(one_bench, lobe, np.broadcast_to(viewer, cells.points.shape), cells.points)
    is_above = cells.points[:, 2] > 0  # below the surface a kind's density may be what it will
    directions, _ = sample(one_bench, lobe, viewer)
    above = directions[directions[:, 2] > 0]
    assert_density(above, cells, density[0][:, 3] * is_above, len(above) / COUNT)


@pytest.mark.parametrize("angle", SOME_ANGLES)
@pytest.mark.parametrize("lobe", BROAD)
def test_weight_is_bsdf_and_cosine_over_density(one_bench: Bench, lobe: Lobe, angle: float) -> None:
    viewer = np.broadcast_to(at(angle), (COUNT, 3))
    directions, weight = sample(one_bench, lobe, at(angle))
    value, _ = probe(one_bench, lobe, viewer, directions)
    above = (directions[:, 2] > 0) & (value[:, 3] > 1e-20)
    assert above.mean() > 0.99 * (directions[:, 2] > 0).mean() > 0
    expected = value[above, :3] * directions[above, 2:] / value[above, 3:]
    np.testing.assert_allclose(weight[above], expected, rtol=2e-3, atol=1e-6)
    assert not weight[directions[:, 2] <= 0].any()


@pytest.mark.parametrize("angle", SOME_ANGLES)
@pytest.mark.parametrize("lobe", BROAD)
def test_nothing_is_reflected_where_no_ray_goes(one_bench: Bench, lobe: Lobe, angle: float) -> None:
    """Shadow rays find no light that the lobe's own would not."""
    numbers = np.random.default_rng(5).normal(size=(20000, 3))
    numbers[:, 2] = np.abs(numbers[:, 2])
    to_light = numbers / np.linalg.norm(numbers, axis=1, keepdims=True)
    value, _ = probe(one_bench, lobe, np.broadcast_to(at(angle), to_light.shape), to_light)
    assert not value[value[:, 3] == 0.0, :3].any()


@pytest.mark.parametrize("angle", [0, 60, 88])
@pytest.mark.parametrize("alpha", [0.25, 0.7, 1.0])
def test_photons_gain_little(one_bench: Bench, alpha: float, angle: float) -> None:
    """Of white microfacets, whose bounces between them leave towards the horizon."""
    names = "alpha_x", "alpha_y", "turn", "compensated"
    lobe = Lobe("ggx", WHITE, dict(zip(names, (alpha, alpha, 0.0, 1.0), strict=True)))
    weight = photons(one_bench, lobe, angle)[1]
    assert 1.0 < weight.max() < MOST_GAINED


@pytest.mark.thorough("-30-", "-60-", "-0-colour1", "-85-colour0")
@pytest.mark.parametrize("colour", [WHITE, COLOURED])
@pytest.mark.parametrize("angle", ANGLES)
@pytest.mark.parametrize("lobe", BROAD)
def test_no_more_than_the_albedo(
    one_bench: Bench, lobe: Lobe, angle: float, colour: tuple[float, float, float]
) -> None:
    """By quadrature and by samples, which agree; and the albedo is one at most."""
    lobe, viewer = Lobe(lobe.kind, colour, lobe.parameters), at(angle)
    directions, weight = sample(one_bench, lobe, viewer)
    cells = Cells(directions, viewer * (-1, -1, 1))
    value, albedo = probe(
        one_bench, lobe, np.broadcast_to(viewer, cells.points.shape), cells.points
    )
    integral = cells.integral(value[:, :3] * np.maximum(cells.points[:, 2:], 0.0)).sum(axis=(0, 1))
    error = 4 * weight.std(axis=0) / math.sqrt(COUNT)
    assert (np.abs(weight.mean(axis=0) - integral) <= error + 3e-3 * integral).all()
    estimate = CASES[lobe.kind].estimate
    if estimate:
        # Cycles has tables for round lobes, and takes no energy for lost where none is given back.
        shape = lobe.parameters
        is_known = shape.get("alpha_x") == shape.get("alpha_y") and shape.get("compensated", 1.0)
        away = np.abs(weight.mean(axis=0) - albedo[0, :3])
        assert (away <= (estimate if is_known else max(estimate, 0.16)) + error).all()
    else:
        assert (weight.mean(axis=0) <= albedo[0, :3] * 1.001 + error).all()
    assert (albedo[0, :3] <= 1 + 1e-6).all()
    _, passed = probe(one_bench, lobe, viewer[None], viewer[None], PASSED=1)
    expected = (1 - albedo[0, :3].max()) * tint_of(lobe, angle)
    np.testing.assert_allclose(passed[0, :3], expected, atol=1e-6)


def tint_of(lobe: Lobe, angle: float) -> Any:
    """What a coat leaves of what it lies over: its tint to the power of the way through it."""
    if lobe.kind not in COATS:
        return np.ones(3)
    given: Any = lobe.parameters
    inside = math.cos(math.asin(math.sin(math.radians(angle)) / given["ior"]))
    return 1 - given["cover"] + given["cover"] * np.power(lobe.colour, 1 / inside)


def photons(bench: Bench, lobe: Lobe, angle: float) -> tuple[Any, Any]:
    """COUNT directions that photons go on in, and their weights; below the surface none."""
    numbers = np.random.default_rng(13).integers(0, 1 << 24, (COUNT, 2)) / (1 << 24)
    light = np.broadcast_to(at(angle), (COUNT, 3))
    first, second = probe(bench, lobe, light, numbers, SAMPLE=1, PHOTON=1)
    return first[:, :3], second[:, :3] * (first[:, 2:3] > 0)


@pytest.mark.parametrize("angle", ANGLES[1::2])
@pytest.mark.parametrize("lobe", BROAD)
def test_photons_go_the_eyes_way_back(one_bench: Bench, lobe: Lobe, angle: float) -> None:
    """They carry on what the eye's path would: its viewer is where they go."""
    lobe, light = Lobe(lobe.kind, WHITE, lobe.parameters), at(angle)
    directions, weight = photons(one_bench, lobe, angle)
    cells = Cells(directions, light * (-1, -1, 1))
    value, _ = probe(one_bench, lobe, cells.points, np.broadcast_to(light, cells.points.shape))
    integral = cells.integral(value[:, :3] * np.maximum(cells.points[:, 2:], 0.0)).sum(axis=(0, 1))
    error = 4 * weight.std(axis=0) / math.sqrt(COUNT)
    assert (np.abs(weight.mean(axis=0) - integral) <= error + 5e-3 * integral).all()


@pytest.mark.parametrize("angle", ANGLES)
@pytest.mark.parametrize("lobe", DELTA)
def test_delta_lobes(one_bench: Bench, lobe: Lobe, angle: float) -> None:
    """One direction with all of the albedo, and none that is met by chance."""
    viewer = at(angle)
    directions, weight = sample(one_bench, lobe, viewer)
    assert np.ptp(directions, axis=0).max() == np.ptp(weight, axis=0).max() == 0
    assert directions[0, 2] > 0
    value, albedo = probe(one_bench, lobe, np.broadcast_to(viewer, (COUNT, 3)), directions)
    assert not value.any()
    np.testing.assert_allclose(weight[0], albedo[0, :3], rtol=1e-5)
    assert (albedo[0, :3] <= 1 + 1e-6).all()


def test_mirror_directions(one_bench: Bench) -> None:
    for angle in ANGLES:
        directions, _ = sample(one_bench, Lobe("mirror", WHITE), at(angle))
        np.testing.assert_allclose(directions[0], at(angle) * (-1, -1, 1), atol=1e-6)


def test_phong_is_the_papers(one_bench: Bench) -> None:
    """Lafortune & Willems: k_s (n + 2) / (2 pi) cos^n; straight above it reflects k_s exactly."""
    rng = np.random.default_rng(6)
    viewer, light = rng.normal(size=(2, 10_000, 3))
    for v in (viewer, light):
        v /= np.linalg.norm(v, axis=1, keepdims=True)
        v[:, 2] = np.abs(v[:, 2])
    light[::2] = viewer[::2] * [-1, -1, 1] + 0.05 * light[::2]
    light /= np.linalg.norm(light, axis=1, keepdims=True)
    cosine = np.maximum((light * [-1, -1, 1] * viewer).sum(axis=1), 0)
    for n in (1.0, 10.0, 1000.0):
        lobe = Lobe("phong", COLOURED, {"exponent": n})
        expected = (n + 2) / (2 * np.pi) * cosine[:, None] ** n * COLOURED
        value, _ = probe(one_bench, lobe, viewer, light)
        np.testing.assert_allclose(value[:, :3], expected, rtol=1e-3, atol=1e-6)
        _, weight = sample(one_bench, lobe, at(0))
        np.testing.assert_allclose(weight.mean(axis=0), COLOURED, rtol=5e-3)


@pytest.mark.parametrize("lobe", BROAD)
def test_reciprocity(one_bench: Bench, lobe: Lobe) -> None:
    if not CASES[lobe.kind].is_reciprocal:
        pytest.skip(f"{lobe.kind} is not reciprocal")
    rng = np.random.default_rng(6)
    a, b = rng.normal(size=(2, 100_000, 3))
    b[::2] = a[::2] * [-1, -1, 1] + 0.05 * b[::2]  # half of the pairs in the lobe
    for v in (a, b):
        v /= np.linalg.norm(v, axis=1, keepdims=True)
        v[:, 2] = np.abs(v[:, 2])
    forth, back = (probe(one_bench, lobe, *pair)[0][:, :3] for pair in ((a, b), (b, a)))
    assert forth.min() >= 0 and forth.max() > 0
    np.testing.assert_allclose(forth, back, rtol=1e-3, atol=1e-6)


@pytest.mark.thorough("compute")  # the same text
@pytest.mark.parametrize("lobe", EACH)
def test_always_finite(bench: Bench, lobe: Lobe, thorough: bool) -> None:
    """For random, grazing and opposite directions, on either side; and for the ends of numbers."""
    rng = np.random.default_rng(8)
    sixth = 50 if thorough else 20
    some = rng.normal(size=(6 * sixth, 3))
    some[2 * sixth : 4 * sixth, 2] *= 1e-7  # grazing
    some[4 * sixth : 5 * sixth, 2] = 0.0
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    some = np.concatenate([some / np.linalg.norm(some, axis=1, keepdims=True), axes])
    some = np.concatenate([some, some * [-1, -1, 1], some * [1, 1, -1], -some])
    viewer, light = (x.reshape(-1, 3) for x in np.broadcast_arrays(some[:, None], some[None]))
    for value in probe(bench, lobe, viewer, light):
        assert np.isfinite(value).all() and value.min() >= 0
    ends = np.array([0.0, 1.0 / (1 << 24), 0.5, 1.0 - 1.0 / (1 << 24)])
    numbers = np.stack(np.meshgrid(ends, ends), -1).reshape(-1, 2)
    viewer = np.repeat(some, len(numbers), axis=0)
    directions, weight = probe(bench, lobe, viewer, np.tile(numbers, (len(some), 1)), SAMPLE=1)
    assert np.isfinite(directions).all() and np.isfinite(weight).all() and weight.min() >= 0
    assert np.abs(np.linalg.norm(directions[:, :3], axis=1) - 1).max() < 1e-5
