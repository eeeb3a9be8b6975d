# SPDX-License-Identifier: GPL-3.0-or-later
"""What is left of discs that are cut."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, get_args

import numpy as np
import pytest

from addon.photon.backends import backend
from addon.photon.backends.native_kernels import tracer_of
from addon.photon.kernels.coverage import Coverage
from addon.photon.settings import Filter
from addon.photon.stage.geometry import Mesh
from addon.streams import Device
from tests.kernels.conftest import Bench
from tests.measure import render
from tests.scenes import Builder, cornell

from .cutting import DIFFUSE, FINE, RADIUS, UP, even, floor, mesh_of, texels

PROBES, PASSES = 256, 64
COMPARED = 8  # passes of the shader


def weights(name: str, x2: Any) -> Any:
    """A filter over its mass on a disc of radius 1, at squares of distances."""
    shape = {
        "constant": np.ones_like(x2),
        "cone": 3 * (1 - np.sqrt(x2)),
        "gaussian": 2 / (1 - np.exp(-2)) * np.exp(-2 * x2),
        "epanechnikov": 2 * (1 - x2),
    }[name]
    return np.where(x2 <= 1, shape, 0.0) / np.pi


def on_disc(name: str) -> tuple[Any, Any, tuple[Any, Any]]:
    """Places about a disc of radius one, and what the filter and the inner filter weigh there."""
    side = (np.arange(2 * FINE) + 0.5) / FINE - 1
    u, v = np.meshgrid(side, side)
    squares = u * u + v * v
    return u, v, (weights(name, squares), 2 * weights(name, 2 * squares))


def add_pass(means: Any, shares: Any, tilts: Any) -> None:
    """Add a pass of PASSES to the means of share, scale, and scale times either coordinate of the
    tilt, by disc and filter."""
    for k, scale in enumerate((shares[:, 2], shares[:, 3])):
        means[0, :, k] += shares[:, k] / PASSES
        means[1, :, k] += scale / PASSES
        means[2:, :, k] += scale * tilts[:, 2 * k : 2 * k + 2].T * RADIUS / PASSES


def check_shares(name: str, cuts: Any, x: Any, means: Any, **near: float) -> None:
    """That discs at x before the plate's edge have the share of their scaled, tilted filters that
    lies on the plate and within the cuts, whatever it is divided by: what is even stays even."""
    u, v, filters = on_disc(name)
    for at in range(len(x)):
        a, b, c, d = cuts[at] * RADIUS
        there = (u * a + v * b <= 1) & (u * c + v * d <= 1) & (x[at] + u * RADIUS <= 0.9)
        for k, filter_ in enumerate(filters):
            share, scale, along_u, along_v = means[:, at, k]
            tilted = filter_ * (scale + along_u * u + along_v * v) / FINE**2
            assert share == pytest.approx((tilted * there).sum(), **near)


def check_tilted(name: str, cuts: Any, x: Any, means: Any) -> None:
    """That discs at x before the plate's edge, of these cuts, shares, scales and tilts, have the
    mass that lies on the plate, and within the cuts as much as without tilts; both over what that
    is, where the triangle tells it (SURE and BROAD of glsl/lib/cuts.glsl)."""
    check_shares(name, cuts, x, means, abs=8e-3)
    u, v, filters = on_disc(name)
    for at in range(len(x)):
        a, b, c, d = cuts[at] * RADIUS
        within = (u * a + v * b <= 1) & (u * c + v * d <= 1)
        on_plate = x[at] + u * RADIUS <= 0.9
        known = (filters[0] * within * on_plate).sum()
        sure = np.clip(known / (filters[0] * within).sum() / 0.2 - 4, 0, 1)
        for k, filter_ in enumerate(filters):
            _, scale, along_u, along_v = means[:, at, k]
            tilted = filter_ * (scale + along_u * u + along_v * v) / FINE**2
            left = (filter_ * within).sum() / FINE**2
            over = 1 + sure * np.clip((left - 0.25) / 0.2, 0, 1) * (left - 1)
            tilted *= within  # as good as 16 directions tell
            assert tilted.sum() * over == pytest.approx(left, abs=0.02)
            if at % 2 == 0 and scale * over < 3.0:
                assert abs((tilted * u).sum()) < 0.01 and abs((tilted * v).sum()) < 0.01


def tables_of(mesh: Mesh, radii: Any) -> dict[str, Any]:
    """What coverage reads of a scene."""
    return {
        "nodes": mesh.tree.nodes,
        "triangles": mesh.triangles,
        "corner_normals": mesh.normals,
        "faces": mesh.faces,
        "radii": radii.table(),
    }


def in_glsl(draw: dict[str, Any]) -> dict[str, Any]:
    """The uniforms of the GLSL kernel, by those of the native one."""
    return draw | {"rounds": 1 + (draw["expecting"] > 0)}


class CutDiscs:
    """Points on a plate whose discs are cut, and what coverage takes of them: well on a triangle,
    which holds the disc, and at the plate's edge. `radius_scale`: of a late pass, with radii that
    are as wide then."""

    def __init__(self, radius_scale: float = 1.0, count: int = 40) -> None:
        rng = np.random.default_rng(5)
        self.cuts = np.zeros((count, 4), np.float32)
        for pair in (slice(0, 2), slice(2, 4)):
            angle, away = rng.uniform(0, 2 * np.pi, count), rng.uniform(0.1, 1.2, count) * RADIUS
            self.cuts[:, pair] = np.stack([np.cos(angle), np.sin(angle)], 1) / away[:, None]
        self.cuts[: count // 4, 2:] = 0.0
        self.x = np.where(np.arange(count) % 2 == 0, 0.5, 0.9 - 0.4 * RADIUS)
        self.mesh, self.radii = mesh_of(floor()), even(RADIUS / radius_scale)
        x, y = self.mesh.corners[:, :, :2].mean(axis=1).T
        (own,) = np.flatnonzero(x > y)
        self.draw: dict[str, Any] = {"probes": PROBES, "seed": 3, "depth": 0}
        self.draw |= {"expecting": 0, "least_expected": 0.25, "first_probe": 0}
        self.draw |= {"radius_scale": radius_scale, "frame_size": (count, 1)}
        pixel = np.zeros((count, 4), np.float32)
        pixel[:, 0] = np.arange(count)
        up = np.broadcast_to(UP, (count, 3))
        self.streams = {
            "pixel": pixel,
            "place": texels(np.stack([self.x, 0 * self.x - 0.3, 0 * self.x], 1), 1.0),
            "facing": texels(up, 1.0),
            "shading": texels(up, float(own)),
            "cuts": self.cuts,
            "diffuse": np.tile(DIFFUSE[0], (count, 1)),
        }
        self.tables = tables_of(self.mesh, self.radii)

    def natively(self, name: str) -> tuple[Any, Any]:
        """(points, 4) shares and scales, and tilts, by the native core."""
        streams = (x[None] for x in self.streams.values())
        coverage = tracer_of(self.mesh).coverage
        found = coverage(*streams, self.radii, filter=name, faces=self.mesh.faces, **self.draw)
        return found[0][0], found[1][0]


def test_late_passes(one_bench: Bench) -> None:
    """Discs that are cut are smaller then, to the kernel as to the native core."""
    late, first = CutDiscs(0.3), CutDiscs()
    (shares, tilts), before = late.natively("cone"), first.natively("cone")[1]
    given = late.streams, in_glsl(late.draw), late.tables, {"FILTER_CONE": 1}
    found = one_bench.run(Coverage, *given)
    same = np.isclose(found["tilt"], tilts, rtol=1e-3, atol=1e-3 / RADIUS).all(axis=1)
    same &= np.isclose(found["coverage"], shares, rtol=1e-3, atol=4 / PROBES).all(axis=1)
    assert same.mean() > 0.9  # a probe at the plate's border may fall to either side
    assert not np.isclose(before, tilts, rtol=1e-2, atol=1e-2 / RADIUS).all()


@pytest.mark.thorough("cone", "gaussian", "constant")
@pytest.mark.parametrize("name", get_args(Filter))
def test_coverage_of_cut_discs(one_bench: Bench, name: str) -> None:
    """The tilted filter's mass on the surface and within the cuts, and the inner filter's; within
    the cuts alone each has the mass that it had, and its middle is the point."""
    discs = CutDiscs()
    draw, cuts, x, count = discs.draw, discs.cuts, discs.x, len(discs.x)
    defines = {f"FILTER_{name.upper()}": 1}
    means = np.zeros((4, count, 4))  # share, scale, and scale times either coordinate of the tilt

    def passes() -> Iterator[tuple[Any, Any, Any]]:
        """Add up PASSES by the native core; its shares and tilts, and what the kernel finds, of the
        first."""
        for index in range(PASSES):
            draw["first_probe"] = index * PROBES
            shares, tilts = discs.natively(name)
            add_pass(means, shares, tilts)
            if index < COMPARED:
                yield (
                    shares,
                    tilts,
                    one_bench.run(Coverage, discs.streams, in_glsl(draw), discs.tables, defines),
                )

    for shares, tilts, found in passes():
        # A probe at the plate's border may fall to either side.
        apart = 4 * np.abs(shares[:, 2:]).max() / PROBES
        np.testing.assert_allclose(found["coverage"][:, :2], shares[:, :2], atol=apart)
        np.testing.assert_allclose(found["coverage"][:, 2:], shares[:, 2:], rtol=1e-3)
        np.testing.assert_allclose(found["tilt"], tilts, rtol=1e-3, atol=1e-3 / RADIUS)
    check_tilted(name, cuts, x, means)
    draw |= {"expecting": 4, "least_expected": 0.05}
    means[:] = 0.0
    for shares, _, found in passes():
        same = np.isclose(found["coverage"], shares, rtol=1e-3, atol=8 / PROBES).all(axis=1)
        assert same.mean() > 0.9  # a probe at the plate's border may fall to either side
    check_shares(name, cuts, x, means, rel=0.03, abs=0.01)


def strip(half: float, is_split: bool) -> Builder:
    """A board, so wide to either side in radii, of one quad or of two triangles that are not in
    one plane: then probes look for the second."""
    half, lift = half * RADIUS, 0.5 * half * RADIUS * is_split
    a, b, c, d = (-1.0, -half, 0.0), (1.0, -half, 0.0), (1.0, half, lift), (-1.0, half, 0.0)
    return Builder().add([a, b, c, d], [[0, 1, 3], [2, 3, 1]])


@dataclass
class Strip:
    """Points on a board's first triangle, beside the diagonal, and what coverage takes of them."""

    half: float
    is_split: bool
    count: int = 128

    def __post_init__(self) -> None:
        x = np.linspace(-0.5, -0.3, self.count)
        at = np.stack([x, np.full(self.count, -0.2 * self.half * RADIUS), 0 * x], 1)
        self.mesh, self.radii = mesh_of(strip(self.half, self.is_split)), even(RADIUS)
        middles = self.mesh.corners[:, :, 0].mean(axis=1)
        pixel = np.zeros((self.count, 4), np.float32)
        pixel[:, 0] = np.arange(self.count)
        up = np.broadcast_to(UP, (self.count, 3))
        self.streams = {
            "pixel": pixel,
            "place": texels(at, 1.0),
            "facing": texels(up, 1.0),
            "shading": texels(up, float(np.argmin(middles))),
            "cuts": np.zeros((self.count, 4), np.float32),
            "diffuse": np.tile(DIFFUSE[0], (self.count, 1)),
        }
        self.tables = tables_of(self.mesh, self.radii)

    def draw(self, index: int, least_expected: float) -> dict[str, Any]:
        """The uniforms of a pass."""
        found: dict[str, Any] = {"probes": 4, "first_probe": index * 4, "expecting": 4}
        found |= {"seed": 3, "depth": 0, "frame_size": (self.count, 1)}
        return found | {"least_expected": least_expected, "radius_scale": 1.0}

    def passes(self, count: int, least_expected: float) -> Any:
        """(count, points, 4) shares and scales."""
        arrays = [x[None] for x in self.streams.values()]
        coverage = tracer_of(self.mesh).coverage
        given = {"filter": "cone", "faces": self.mesh.faces}
        draws = (self.draw(index, least_expected) for index in range(count))
        return np.stack([coverage(*arrays, self.radii, **given, **draw)[0][0] for draw in draws])

    def right(self) -> float:
        """The share of the disc."""
        side = (np.arange(2400) + 0.5) / 1200 - 1
        u, v = np.meshgrid(side, side)
        is_there = np.abs(v - 0.2 * self.half) <= self.half
        return float((weights("cone", u * u + v * v) * is_there).sum() / 1200**2)


@pytest.mark.parametrize(("is_split", "off"), [(False, 0.15), (True, 0.8)])
def test_coverage_of_a_strip(one_bench: Bench, is_split: bool, off: float) -> None:
    """What little of a disc is surface is told by each pass to a share `off` of it: four probes, a
    fifth of which find it, tell it to 1.04. By several lanes as by one."""
    board = Strip(0.1, is_split)
    shares = board.passes(32, 1.0)[:, :, 0]
    defines, given = {"FILTER_CONE": 1}, (board.streams, in_glsl(board.draw(31, 1.0)), board.tables)
    found = one_bench.run(Coverage, *given, defines)["coverage"]
    np.testing.assert_allclose(found[:, 0], shares[-1], atol=2e-3)
    lanes = Bench(one_bench.device, "compute").run(Coverage, *given, defines, lanes=8)["coverage"]
    np.testing.assert_allclose(lanes, found, atol=1e-5)
    assert np.mean(shares) == pytest.approx(board.right(), rel=0.02)
    assert np.std(shares) < off * board.right()


@pytest.mark.parametrize("is_split", [False, True])
@pytest.mark.parametrize("half", [0.04, 0.1])
def test_what_a_narrow_strip_is_divided_by(half: float, is_split: bool) -> None:
    """What is expected is as wrong as 16 directions and four probes are, but the quotient of the
    sums is right."""
    board = Strip(half, is_split, 1024)
    sums = board.passes(64, 0.05).sum(axis=(0, 1))
    assert sums[0] / sums[2] == pytest.approx(board.right(), rel=0.02)
    assert sums[1] / sums[3] > sums[0] / sums[2]


def test_lanes_probe_the_same(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """Several invocations a visible point, as where a GPU has many triangles: to rounding."""
    monkeypatch.setattr(device, "prefers_native", False)
    assert [backend.lanes_of_probes(n, 1) for n in (1, 1 << 12, 1 << 16)] == [1, 4, 8]
    assert backend.lanes_of_probes(1 << 16, 1 << 20) == 4
    pictures = []
    for lanes in (1, 4, 8):
        monkeypatch.setattr(backend, "lanes_of_probes", lambda triangles, pixels, n=lanes: n)
        pictures.append(render(device, cornell(True), backend="compute", photons=5000)["Indirect"])
    for several in pictures[1:]:
        assert np.abs(pictures[0] - several).max() <= 1e-5 * pictures[0].max()
        assert (pictures[0] != several).any()
