# SPDX-License-Identifier: GPL-3.0-or-later
"""The benchmark's counts against brute force, its tables and its choices; nothing about time."""

from __future__ import annotations

import json
import math
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest

from addon.photon.eye.compaction import Compaction
from addon.photon.photons.radius_field import RadiusField
from addon.photon.prepare import prepare
from addon.photon.settings import Settings
from addon.streams import Device, HostKernel, Kernel
from tests.scenes import cornell, corners_of

from .speed import backends, choices, machine, paper
from .speed.choices import Choice, Combination, grid, verdict
from .speed.counts import WATCHED, count_pairs, count_work
from .speed.launches import EYE, PHOTON_MAP, PHOTONS, Timer, Watch, kernel_classes
from .speed.passes import Clock, Predictor, Way, compare, rates_of, steady, time_way, ways_of
from .speed.report import Report
from .speed.snapshots import load_scenes

SMALL = Settings(width=24, height=16, photons=1500)
ORIENTED = 0.7071  # glsl/lib/density.glsl


def unpacked(code: np.ndarray) -> np.ndarray:
    """Normals (P, 3) from glsl/lib/packing.glsl's codes."""
    x = np.floor(code / 4096.0)
    e = np.stack([x, code - x * 4096.0], -1) / 4095.0 * 2.0 - 1.0
    z = 1.0 - np.abs(e).sum(-1)
    sign = np.where(e >= 0, 1.0, -1.0)
    folded = (1.0 - np.abs(e[:, ::-1])) * sign
    n = np.concatenate([np.where(z[:, None] < 0, folded, e), z[:, None]], -1)
    return n / np.linalg.norm(n, axis=-1, keepdims=True)


def brute_force(
    place: np.ndarray, facing: np.ndarray, photons: np.ndarray, deposits: np.ndarray, radius: Any
) -> int:
    """Every visible point against every photon."""
    points, normals = place.reshape(-1, 4), facing.reshape(-1, 4)[:, :3]
    offset = points[:, None, :3].astype(float) - photons[None, :, :3]
    near = (offset**2).sum(-1) <= np.square(radius).reshape(-1, 1)
    same = (points[:, None, 3] == photons[None, :, 3]) & (points[:, None, 3] != 0)
    oriented = normals.astype(float) @ unpacked(deposits[:, 3].astype(float)).T >= ORIENTED
    height = (offset * normals[:, None, :]).sum(-1)
    within = 2.0 * height**2 <= (offset**2).sum(-1) + 1e-10  # 45 degrees of the plane
    return int((near & same & oriented & within).sum())


class Seen:
    """What an estimate of a pass was asked."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        from addon.photon.photons.photon_grid import PhotonGrid

        self.points: list[Any] = []
        estimate = PhotonGrid.estimate

        def looked_at(grid: Any, points: Any, *args: Any, **kwargs: Any) -> None:
            self.points.append((points["place"].download(), points["facing"].download()))
            estimate(grid, points, *args, **kwargs)

        monkeypatch.setattr(PhotonGrid, "estimate", looked_at)


@pytest.mark.parametrize("radius", [0.0, 0.4, 6.0])
def test_pairs_as_by_brute_force(
    device: Device, monkeypatch: pytest.MonkeyPatch, radius: float
) -> None:
    """At one radius everywhere and at radii by density, in mirrors and out."""
    scene = cornell(mirror=True)
    settings = replace(steady(SMALL), radius=radius, direct_by_photons=True, first_pass=WATCHED)
    work = count_work(scene, settings, device)
    seen = Seen(monkeypatch)
    settings = replace(settings, backend="fragment", estimator="gather")
    renderer = prepare(scene, settings, device)
    renderer.render_pass()
    assert renderer.photons
    photons, deposits = renderer.photons.mapper.deposits.arrays()
    field = renderer.photons.field.on_host
    expected = [
        brute_force(*points, photons, deposits, field.at(*(x.reshape(-1, 4) for x in points)))
        for points in seen.points
    ]
    renderer.release()
    assert work.deposits == len(photons) > 1000
    assert work.pairs == expected
    assert len(expected) > 1 and min(expected[:2]) > 0
    assert (work.splat_pairs, work.gather_pairs) == (expected[0], sum(expected))


def test_no_photons_no_pairs(device: Device) -> None:
    none = np.zeros((0, 4), np.float32)
    field = RadiusField.even(device, 0.5, 0.0)
    points = np.ones((2, 2, 4), np.float32)
    assert count_pairs(points, points, none, none, field.of_passes(1.0)) == 0
    field.release()


def test_rays_of_a_pass(device: Device) -> None:
    """One eye ray a pixel and one shadow ray from each point that faces the light; of the photons,
    one from the light each, and one more for each that is reflected."""
    work = count_work(cornell(), SMALL, device)
    pixels = SMALL.width * SMALL.height
    assert pixels < work.rays[EYE] <= 2 * pixels
    assert 1500 < work.rays[PHOTONS] < 10 * 1500
    only_eye = count_work(cornell(), replace(SMALL, direct_by_photons=True), device)
    assert only_eye.rays == {PHOTONS: work.rays[PHOTONS], EYE: pixels}
    # No more than the first hits are stored besides.
    assert 0 < only_eye.deposits - work.deposits <= 1500


def test_mirrors_send_more_rays(device: Device) -> None:
    without = count_work(cornell(), SMALL, device)
    mirrored = count_work(cornell(mirror=True), SMALL, device)
    assert mirrored.rays[EYE] > without.rays[EYE]
    assert len(without.pairs) == 1 < len(mirrored.pairs)


@pytest.mark.parametrize("waits", [True, False])
@pytest.mark.parametrize("estimator", ["gather", "splat"])
def test_every_launch_is_watched(
    device: Device, monkeypatch: pytest.MonkeyPatch, waits: bool, estimator: str
) -> None:
    monkeypatch.setattr(Compaction, "compact", lambda *_: None)  # all streams are of one size
    renderer = prepare(
        cornell(mirror=True), replace(SMALL, estimator=estimator, backend="fragment"), device
    )
    renderer.render_pass()
    before = renderer.launches()
    watch = Watch(Timer(device), waits)
    with watch.watching():
        renderer.render_pass()
    launched = {stem: count - before[stem] for stem, count in renderer.launches().items()}
    renderer.release()
    for stem, count in launched.items():
        assert watch.of(stem).launches == count, stem
    assert watch.of("tracer", PHOTONS).launches > 0 < watch.of("tracer", EYE).launches
    assert watch.of(estimator, EYE).launches > 0 == watch.of(estimator, PHOTONS).launches
    # Origin and direction are read, the hit is written.
    eye = watch.of("tracer", EYE)
    assert eye.moved == eye.launches * 3 * 16 * SMALL.width * SMALL.height
    assert watch.to_host > 0 < watch.to_device
    assert all(spent.seconds >= 0 for spent in watch.spent.values())


def test_host_kernels_are_watched(device: Device) -> None:
    settings = replace(SMALL, backend="native")
    renderer = prepare(cornell(), settings, device)
    renderer.render_pass()  # its photons were traced for the radii
    watch = Watch(Timer(device), waits=True)
    with watch.watching():
        renderer.render_pass()
    renderer.release()
    assert watch.of("tracer", EYE).launches == 2 and watch.of("tracer", EYE).seconds > 0
    assert watch.of("on the host", PHOTONS).launches == 1
    assert watch.of("on the host", PHOTON_MAP).launches == 1  # the native core's sort


def test_watching_leaves_no_trace(device: Device) -> None:
    def functions() -> list[Any]:
        runs = [kind._launch for kind in kernel_classes()]
        return [*runs, moderngl.VertexArray.render, moderngl.Texture.write, moderngl.Buffer.read]

    before = functions()
    assert Kernel in kernel_classes() and HostKernel in kernel_classes()
    with pytest.raises(ZeroDivisionError), Watch(Timer(device), True).watching():
        assert functions() != before
        1 / 0
    assert functions() == before


def test_a_way_is_what_the_renderer_takes(device: Device) -> None:
    ways = ways_of(device)
    assert len(set(ways)) == len(ways) == 4 * (2 + device.has_compute)
    way = Way("fragment", "splat", "point")
    timing = time_way(cornell(), way.of(SMALL), device, 0.0, Timer(device))
    assert timing.way == way and str(way) == "fragment splat point"
    assert timing.passes == 1  # the one that warms up and the one that is watched are not timed
    # Points, and those too large for the device as quads.
    assert timing.splats > 0 and timing.watch and timing.watch.of("splat").launches == 2


def test_ways_that_take_turns(device: Device) -> None:
    ways = [Way("fragment", "gather"), Way("native", "splat", "quad")]
    medians = compare(cornell(), SMALL, device, ways, 0.0)
    assert len(medians) == 2 and min(medians) > 0


def test_rates(device: Device) -> None:
    """Counted work over the seconds of what did it."""
    way = Way("fragment", "gather")
    timing = time_way(cornell(), way.of(SMALL), device, 0.0, Timer(device))
    work = count_work(cornell(), steady(SMALL), device)
    rates = rates_of(timing, work)
    assert timing.watch
    gather = timing.watch.of("gather").seconds
    assert math.isclose(rates.pairs, work.gather_pairs / gather)
    assert math.isclose(rates.paths, 1500 / timing.phases["photons"])
    assert math.isclose(
        rates.photon_rays, work.rays[PHOTONS] / timing.watch.of("tracer", PHOTONS).seconds
    )
    timing.watch.spent.clear()  # as of a backend that traces photons in one call
    assert math.isnan(rates_of(timing, work).photon_rays)


def test_predictions_err_on_the_long_side() -> None:
    predictor, way = Predictor(), Way("fragment", "gather")
    assert predictor.seconds(way, 5.0) == 0.0
    predictor.learn(way, 10.0, 1.0)
    predictor.learn(way, 1000.0, 20.0)
    assert predictor.seconds(way, 20.0) == 2.0
    assert predictor.seconds(way, 500.0) == 20.0
    assert predictor.seconds(way, 2000.0) == 40.0
    assert predictor.seconds(Way("compute", "gather"), 5.0) == 0.0


def test_the_papers_cells() -> None:
    cells = paper.cells()
    assert len(cells) == len(set(cells)) == 27
    assert set(paper.KNOWN) <= set(cells)
    assert set(cells[1:3]) == set(paper.KNOWN)  # the smallest first: it predicts the others
    rest = [cell.work for cell in (cells[0], *cells[3:])]
    assert rest == sorted(rest)
    assert paper.KNOWN[paper.Cell(262144, 1.25, 512)].total == 16.92
    assert math.isnan(paper.KNOWN[paper.Cell(262144, 1.5, 512)].tracing)
    assert "ASSUMED" in paper.ASSUMED


@pytest.mark.parametrize("software", [False, True])
def test_the_grid_is_balanced(software: bool) -> None:
    scenes = ["a", "b", "c"]
    combinations = grid(scenes, software, choices.COMBINATIONS)
    assert combinations == grid(scenes, software, choices.COMBINATIONS)
    assert len(set(combinations)) == len(combinations) == choices.COMBINATIONS >= 30
    assert [each.work for each in combinations] == sorted(each.work for each in combinations)
    for name in ("scene", "photons", "radius", "size"):
        counts = Counter(getattr(each, name) for each in combinations)
        assert max(counts.values()) <= min(counts.values()) + 3, name


def test_a_grid_that_is_too_small() -> None:
    everything = len(choices.PHOTONS[True]) * len(choices.RADII) * len(choices.SIZES[True])
    assert len(grid(["a"], True, 1000)) == everything


def test_losses() -> None:
    gather, splat = Way("compute", "gather"), Way("compute", "splat", "quad")
    combination = Combination("room", 4096, 0.0, 64)
    good = Choice(combination, gather, {gather: 1.0, splat: 1.5})
    bad = Choice(combination, gather, {gather: 1.3, splat: 1.0})
    assert good.loss == 0 and good.best == gather
    assert bad.loss == pytest.approx(0.3) and bad.best == splat
    (line,) = verdict([good, bad])
    assert "1 of 2" in line and "slower in 1;" in line and "30% (room, 4096" in line
    assert verdict([]) == []


def test_choices_from_end_to_end(
    device: Device, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All ways are measured, and `auto` is one of them."""
    monkeypatch.setattr(choices, "_SLICE", 0.0)
    monkeypatch.setattr(choices, "_TWICE", -1.0)  # the comparison, too
    monkeypatch.setattr(choices, "_AGAIN", 0.0)
    monkeypatch.setattr(choices, "SIZES", {False: (16,), True: (16,)})
    report = Report(tmp_path)
    choices.measure_choices(report, device, {"room": cornell()}, Clock(100.0), 1)
    (data,) = report.data["choices"]
    assert set(data["seconds"]) == {str(way) for way in ways_of(device, ("quad",))}
    assert data["chosen"] in data["seconds"] and data["skipped"] == [] and data["loss"] >= 0


def test_ways_from_end_to_end(
    device: Device, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ways = [Way("fragment", "gather"), Way("native", "gather"), Way("fragment", "splat", "quad")]
    monkeypatch.setattr(backends, "ways_of", lambda _: ways)
    monkeypatch.setattr(backends, "_SLICE", 0.0)
    report, timer = Report(tmp_path), Timer(device)
    backends.measure_ways(report, timer, "room", cornell(), SMALL, Clock(100.0))
    backends.measure_scenes(report, timer, {"room": cornell()}, SMALL, Clock(100.0))
    report.write()
    data = json.loads((tmp_path / "bench.json").read_text())
    assert [*data["ways"]["ways"]] == [str(way) for way in ways] == [way for way, _ in report.bars]
    assert data["scenes"]["room"]["triangles"] == len(cornell().triangles)
    assert "photons: tracer" in (tmp_path / "bench.md").read_text()


def test_no_time_left_is_said(device: Device, tmp_path: Path) -> None:
    report = Report(tmp_path)
    backends.measure_scenes(report, Timer(device), {"room": cornell()}, SMALL, Clock(-1.0))
    assert report.tables[0].rows == [] and "no time left" in report.tables[0].notes[0]


def test_bumpy_sphere_is_closed() -> None:
    scene = machine.bumpy_sphere(12)
    scene.check()
    assert len(scene.triangles) == 2 * 12**2
    _, mesh = machine.build_bvh(scene)
    origins, directions = machine.incoherent_rays(corners_of(mesh), 500)
    assert np.abs(origins).max() < 1 and np.allclose(np.linalg.norm(directions, axis=1), 1)
    import photon_stream_native as native

    inside = np.linalg.norm(origins, axis=1) < 0.7
    count = int(inside.sum())
    origin = np.c_[origins[inside], np.full(count, -1)].astype(np.float32)[None]
    direction = np.c_[directions[inside], np.full(count, 1e30)].astype(np.float32)[None]
    hits = native.Tracer(mesh.tree.nodes, corners_of(mesh)).trace(origin, direction, False)
    assert count > 100 and (hits[..., 1] > 0).all()


def test_a_device_traces_rays(device: Device) -> None:
    scene = machine.bumpy_sphere(4)
    _, mesh = machine.build_bvh(scene)
    assert machine.device_rays(Timer(device), scene, mesh) > 0.0


def test_peers_that_are_absent_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    import sys

    monkeypatch.setitem(sys.modules, "embreex.mesh_construction", None)
    _, mesh = machine.build_bvh(machine.bumpy_sphere(4))
    assert str(machine.embree_rays(mesh)).startswith("not here: ")


def test_scenes_that_are_absent_are_named(tmp_path: Path) -> None:
    cornell().save(tmp_path / "room.npz")
    scenes, exports, refused = load_scenes([tmp_path, tmp_path / "none.npz"])
    assert [*scenes] == ["room"] and exports == {}
    assert refused == [f"{tmp_path / 'none.npz'}: no such snapshot"]


@pytest.mark.blender
def test_blend_files_are_exported() -> None:
    pytest.importorskip("bpy")
    blend = Path(__file__).parents[2] / "blend_scenes" / "cornell_classic.blend"
    scenes, exports, refused = load_scenes([blend])
    assert [*scenes] == [*exports] == ["cornell_classic"] and refused == []
    assert len(scenes["cornell_classic"].triangles) == 30 and exports["cornell_classic"] > 0
