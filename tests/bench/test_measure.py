# SPDX-License-Identifier: GPL-3.0-or-later
"""The chart's measures on synthetic pictures whose errors are known."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest

from addon.photon.scene import Camera
from addon.streams import Device
from tests.regression.blocks import discontinuities, grown

from . import many_lights
from .chart import page
from .chart.measure import (
    Error,
    Point,
    efficiency,
    error_at,
    lenient_errors,
    mean_of,
    seconds_by_slope,
    seconds_to,
    slope,
    squared_errors,
)
from .chart.results import SceneResult, equal_error, equal_time, summary, verdicts
from .chart.scenes import SCENES, SIZE, Reference, blend_file, read_reference, reference_file
from .chart.spot import spot_profile
from .chart.svg import figure, spread
from .references import CHECK, mix, shares

H = W = 128


def noisy_reference(seed: int, noise: float) -> tuple[np.ndarray, Reference]:
    """A smooth truth of mean about 1, and two halves of it with noise."""
    random = np.random.default_rng(seed)
    y, x = np.mgrid[:H, :W] / H
    truth = np.stack([1 + 0.8 * x, 1 + 0.5 * y, 1 - 0.5 * x], -1)
    a, b = (truth * (1 + noise * random.standard_normal(truth.shape)) for _ in range(2))
    return truth, Reference(a, b, "")


@pytest.mark.parametrize("bias", [0.0, 0.02, 0.1])
def test_the_references_noise_does_not_bias_the_error(bias: float) -> None:
    """With halves as noisy as the error itself; and the standard error is what scatters."""
    found, deviations = [], []
    for seed in range(40):
        truth, reference = noisy_reference(seed, 0.05)
        error = bias * np.random.default_rng(1000 + seed).standard_normal(truth.shape)
        measured = mean_of(squared_errors(truth + error, reference))
        scale = truth**2 + (0.1 * truth.mean()) ** 2
        found.append(measured.value - (error**2 / scale).mean())
        deviations.append(measured.deviation)
    scatter = np.std(found, ddof=1)
    # The scale is of the same halves: that adds their relative variance, 0.25 %, of the error.
    assert abs(np.mean(found)) < 4 * scatter / math.sqrt(len(found)) + 0.006 * (2.5e-3 + bias**2)
    assert scatter < 2e-4
    assert 0.6 * scatter < np.mean(deviations)  # blocks' scatter holds that of the error itself too


def test_the_strict_measure_sees_the_dark() -> None:
    """A tenth too much everywhere, and in a dark tenth of the picture twice too much."""
    truth = np.ones((H, W, 3))
    truth[: H // 8] = 0.05
    reference = Reference(truth, truth, "")
    mean = truth.mean()
    dark, bright = 0.05**2 + (0.1 * mean) ** 2, 1 + (0.1 * mean) ** 2
    wrong = truth * np.where(truth < 0.1, 2.0, 1.1)
    strict = (0.05**2 / dark + 7 * 0.1**2 / bright) / 8
    assert squared_errors(wrong, reference).mean() == pytest.approx(strict)
    lenient = (0.05**2 / mean**2 + 7 * 0.1**2) / 8
    assert lenient_errors(wrong, reference).mean() == pytest.approx(lenient)
    assert strict > 3 * lenient


def test_an_error_is_resolved_or_not() -> None:
    truth, reference = noisy_reference(1, 0.02)
    assert not mean_of(squared_errors(truth, reference)).resolved
    assert mean_of(squared_errors(truth * 1.05, reference)).resolved


def test_masks_split_the_error() -> None:
    errors = np.arange(H * W, dtype=float).reshape(H, W)
    mask = errors % 3 == 0
    inside, outside = mean_of(errors, mask), mean_of(errors, ~mask)
    share = mask.mean()
    assert inside.value * share + outside.value * (1 - share) == pytest.approx(errors.mean())
    assert math.isnan(mean_of(errors, np.zeros((H, W), bool)).value)


def test_blocks_see_that_neighbours_err_together() -> None:
    """Errors that are constant over 16x16 pixels: as many independent ones as blocks."""
    random = np.random.default_rng(5)
    errors = np.kron(random.standard_normal((8, 8)), np.ones((16, 16)))
    assert mean_of(errors).deviation == pytest.approx(errors.std() / 8, rel=1e-6)


def curve(*points: tuple[float, float]) -> list[Point]:
    return [
        Point(seconds, seconds, *[Error(error, error / 100)] * 4, *[0.1] * 3)
        for seconds, error in points
    ]


def test_seconds_to_an_error() -> None:
    points = curve((1, 0.1), (4, 0.025), (16, 0.00625))
    assert seconds_to(points, 0.1) == 1
    assert seconds_to(points, 0.05) == pytest.approx(2)
    assert seconds_to(points, 0.0125) == pytest.approx(8)
    assert seconds_to(points, 0.5) == 1  # the first point has passed it
    assert seconds_to(points, 0.001) == math.inf
    assert seconds_to([], 0.1) == math.inf


def test_error_after_a_time() -> None:
    points = curve((1, 0.1), (4, 0.025), (16, 0.00625))
    assert error_at(points, 2) == pytest.approx(0.05)
    assert error_at(points, 100) == 0.00625
    assert math.isnan(error_at(points, 0.5))


def test_slope_and_efficiency() -> None:
    points = curve((1, 0.1), (4, 0.025), (16, 0.00625))
    assert slope(points) == pytest.approx(-1)
    assert efficiency(points) == pytest.approx(10)
    assert math.isnan(slope(points[:2]))


def test_extrapolation_by_slope() -> None:
    points = curve((1, 0.1), (4, 0.025), (16, 0.00625))
    assert seconds_by_slope(points, 0.001) == pytest.approx(100)
    assert seconds_by_slope(curve((1, 0.1), (4, 0.099), (16, 0.098)), 0.01) == math.inf
    assert seconds_by_slope(points[:2], 0.001) == math.inf


def test_what_is_below_the_references_noise_is_left_out() -> None:
    lost = Point(64, 64, *[Error(1e-6, 1e-5)] * 4, *[0.1] * 3)
    points = curve((1, 0.1), (4, 0.025), (16, 0.00625))
    assert slope([*points, lost]) == pytest.approx(-1)
    assert seconds_to([*points, lost], 1e-3) == math.inf


def test_the_edge_band() -> None:
    """A plane that faces the camera, nearer in the right half: a band about the step alone."""
    size = 64
    camera = Camera("PERSP", np.eye(4), (-0.5, 0.5, -0.5, 0.5))
    depth = np.full((size, size, 1), 4.0)
    depth[:, size // 2 :] = 3.0
    normal = np.zeros((size, size, 3))
    normal[..., 2] = 1.0
    band = grown(discontinuities({"Depth": depth, "Normal": normal}, camera), 3)
    expected = np.zeros((size, size), bool)
    expected[:, size // 2 - 4 : size // 2 + 4] = True
    assert (band == expected).all()


def test_mixing_references() -> None:
    """By inverse variance; agreement is measured without noise; ours is compared, not mixed in."""
    random = np.random.default_rng(3)
    truth = np.ones((H, W, 3))
    noise = {"one": 0.1, "two": 0.2, CHECK: 0.05}
    pictures = {
        name: {half: truth + sigma * random.standard_normal(truth.shape) for half in "AB"}
        for name, sigma in noise.items()
    }
    pictures[CHECK] = {half: picture + 0.1 for half, picture in pictures[CHECK].items()}
    mixed, words = mix(pictures)
    assert mixed["A"].mean() == pytest.approx(1, abs=2e-3)
    assert mixed["A"].std() == pytest.approx(math.sqrt(0.8**2 * 0.01 + 0.2**2 * 0.04), rel=0.02)
    assert words[0].startswith("one: weight 0.8") and words[2].startswith(f"{CHECK}: weight 0.00")
    apart = re.search(f"one and {CHECK} differ by relMSE ([^ ]*)", words[4])
    assert apart and float(apart[1]) == pytest.approx(0.01 / (1 + 0.1 / 3) ** 2, rel=0.1)


def test_no_renderer_makes_a_reference_alone() -> None:
    """Where there is another, and ours does not count."""
    assert shares({"one": 1e-9, "two": 1.0, CHECK: 1e-9}) == pytest.approx(
        {"one": 0.9, "two": 0.1, CHECK: 0.0}
    )
    assert shares({"one": 0.5, CHECK: 0.1}) == {"one": 1.0, CHECK: 0.0}


def test_spotlight_profile() -> None:
    angles = np.radians([0.0, 29.9, 30.1, 80.0])
    assert spot_profile(angles, math.radians(60), 0.0).tolist() == [1, 1, 0, 0]
    size, blend = math.radians(90), 0.4
    edge = math.cos(size / 2)
    middle = math.acos(edge + 0.5 * (1 - edge) * blend)
    assert spot_profile(middle, size, blend) == pytest.approx(0.5)


def test_the_page_is_whole() -> None:
    """Tables, SVG and pictures of a made-up run; nothing from elsewhere."""
    random = np.random.default_rng(2)
    picture = random.random((SIZE, SIZE, 3))
    scene = SceneResult("cornell_classic", "made up", picture)
    scene.curves = {
        "Photon Stream": curve((0.1, 0.1), (1, 0.01), (10, 0.001)),
        "Cycles": curve((1, 0.1), (3.1623, 0.031623), (10, 0.01)),
        "LuxCore path": [],
    }
    scene.pictures = {name: [picture] * len(p) for name, p in scene.curves.items()}
    scene.refused = {"LuxCore path": "no picture in time"}
    scene.where = {"photons": 1.0}
    html = page.page(["a machine"], verdicts([scene]), [scene])
    assert html.count("data:image/png;base64,") == 4 and html.count("<svg") == 2
    assert "no picture in time" in html and 'src="http' not in html
    _, rows = equal_error(scene)
    assert rows[1][3] == "10 (10x)"  # 1e-2
    assert rows[1][5] == ">10 (>1x), ~100 (~10x)"  # 1e-3
    assert rows[2][1] == "no picture in time"
    names = ["Photon Stream", "Cycles", "LuxCore path"]
    assert (
        summary([scene], names).splitlines()[-1] == "| cornell_classic | 1 / 10 | 10 / ~100 | - |"
    )
    titles, rows = equal_time(scene)
    assert titles[0] == "after 10 s" and [row[0] for row in rows] == ["Photon Stream", "Cycles"]
    first, second = verdicts([scene])
    assert first.endswith("10 times sooner, wanted 20: missed; where our time goes: "
                          "photons 1.00 s (100%)")  # fmt: skip
    assert second.endswith("more than 1 times sooner, wanted 10; by Cycles' slope in 100 s, "
                           "10 times: met by that")  # fmt: skip


def test_names_beside_curves_do_not_overlap() -> None:
    assert spread([10, 12, 60], 100) == [10, 25, 60]
    assert spread([90, 95, 99], 100) == [70, 85, 100]


def test_a_figure_without_points() -> None:
    assert figure("title", "unit", {"Cycles": []}).endswith("</svg>")


@pytest.mark.parametrize("name", SCENES)
def test_references_are_here(name: str) -> None:
    """Each scene has its reference, small, of two halves that agree."""
    assert blend_file(name).is_file()
    path: Path = reference_file(name)
    if name in ("studio", "daylight", "kitchen") and not path.is_file():
        pytest.skip(f"python -m tests.bench.references {name} has not been run yet")
    assert path.stat().st_size < 1_000_000
    reference = read_reference(name)
    assert reference.a.shape == reference.b.shape == (SIZE, SIZE, 3)
    assert np.isfinite(reference.mean).all() and (reference.a != reference.b).any()
    assert abs(reference.a.mean() / reference.b.mean() - 1) < 0.005
    assert f"{name}.blend" in reference.notes


def test_the_bench_of_many_lights_runs(device: Device) -> None:
    """With a light that the tree draws, and all asked."""
    for rays in (0, 1):
        light, seconds = many_lights.measured(device, many_lights.bulbs(3), rays, passes=2)
        assert light.shape == (many_lights.SIZE, many_lights.SIZE)
        assert light.mean() > 0.0 and seconds > 0.0
