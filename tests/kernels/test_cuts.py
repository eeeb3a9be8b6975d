# SPDX-License-Identifier: GPL-3.0-or-later
"""Where discs end at what stands on their surface."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from addon.photon.stage.geometry import Mesh
from tests.kernels.conftest import Bench
from tests.scenes import Builder, cornell, corners_of

from .cutting import HERE, MATERIALS, both_cuts_at, cuts_at, floor, mesh_of, wall


def assert_cuts(found: Any, first: Any = (0, 0), second: Any = (0, 0)) -> None:
    length = max(np.linalg.norm(first), np.linalg.norm(second))
    np.testing.assert_allclose(found, [[*first, *second]], rtol=1e-4, atol=1e-4 * max(length, 1))


def test_nothing_stands_there(bench: Bench) -> None:
    assert_cuts(cuts_at(bench, floor(), (0, 0, 0)))
    assert_cuts(cuts_at(bench, wall(floor(), 0.31), (0, 0, 0)))
    assert_cuts(cuts_at(bench, wall(floor(), 0.1, low=-0.8, high=-0.1), (0, 0, 0)))


def test_wall(bench: Bench) -> None:
    """A vector towards it, as long as it is near."""
    assert_cuts(cuts_at(bench, wall(floor(), 0.1), (0, 0, 0)), (10, 0))
    assert_cuts(cuts_at(bench, wall(floor(), 0.1), (0.25, 0, 0)), (-1 / 0.15, 0))


def test_walls_of_many_triangles_cut_once(bench: Bench) -> None:
    x = 0.1
    built = floor()
    for y in np.arange(-0.9, 0.9, 0.01):
        built.quad((x, y, -0.1), (x, y + 0.01, -0.1), (x, y + 0.01, 0.8), (x, y, 0.8))
    points = np.random.default_rng(1).uniform((-0.15, -0.5, 0), (0.09, 0.5, 0), (500, 3))
    found = cuts_at(bench, built, points)
    np.testing.assert_allclose(found[:, 0] * (x - points[:, 0]), 1.0, rtol=1e-3)
    assert not found[:, 2:].any()


def test_two_walls(bench: Bench) -> None:
    """The nearer one first: in a corner, and in a gap narrower than any margin."""
    corner = wall(floor(), 0.1).quad((-0.9, 0.2, 0), (0.9, 0.2, 0), (0.9, 0.2, 1), (-0.9, 0.2, 1))
    assert_cuts(cuts_at(bench, corner, (0, 0, 0)), (10, 0), (0, 5))
    for width in (0.3, 0.001):
        gap = wall(wall(floor(), width / 3), -2 * width / 3)
        assert_cuts(cuts_at(bench, gap, (0, 0, 0)), (3 / width, 0), (-1.5 / width, 0))


def test_box(bench: Bench) -> None:
    """A convex thing lies beyond its cut as a whole; from its corner, too."""
    box = floor().box((0.1, 0.1, -0.01), (0.5, 0.5, 0.5))
    assert_cuts(cuts_at(bench, box, (0, 0, 0)), (5, 5))
    points = np.random.default_rng(2).uniform((-0.2, -0.2, 0), (0.7, 0.7, 0), (2000, 3))
    points = points[((points < 0.1) | (points > 0.5))[:, :2].any(axis=1)]
    found = cuts_at(bench, box, points)
    assert 0.5 < found.any(axis=1).mean() < 1 and not found[:, 2:].any()
    for x, y in ((0.1, 0.1), (0.1, 0.5), (0.5, 0.1), (0.5, 0.5)):
        beyond = ((np.array([x, y]) - points[:, :2]) * found[:, :2]).sum(axis=1)
        assert (beyond[found.any(axis=1)] > 0.99).all()


@pytest.mark.parametrize(
    ("low", "high", "cut"),
    [
        (0.05, 0.8, True),  # a door a little above the floor
        (0.08, 0.8, False),
        (-0.01, 0.006, True),  # a rug
        (-0.01, 0.001, False),
    ],
)
def test_heights(bench: Bench, low: float, high: float, cut: bool) -> None:
    """What is looked at lies 0.003 and 0.06 above this disc."""
    found = cuts_at(bench, floor().box((0.1, -0.5, low), (0.5, 0.5, high)), (0, 0, 0))
    assert_cuts(found, (10, 0) if cut else (0, 0))


def test_own_surface(bench: Bench) -> None:
    """What bends up slowly is no obstacle, what stands up steeply is; another's is in any case."""
    ball = Builder().sphere((0, 0, 0), 0.8, subdivisions=3)
    corners = corners_of(mesh_of(ball))[..., :3]
    points = corners.transpose(0, 2, 1) @ (0.5, 0.3, 0.2)
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inwards = -across / np.linalg.norm(across, axis=1, keepdims=True)
    assert not cuts_at(bench, ball, points, inwards).any()
    assert cuts_at(bench, ball, points, inwards, surface=2.0)[:, :2].any(axis=1).all()
    room = Builder().box((-0.9, -0.9, 0), (0.9, 0.9, 0.9))
    assert_cuts(cuts_at(bench, room, (0.8, 0, 0)), (10, 0))


def test_no_point(bench: Bench) -> None:
    """No surface, a black one, no number."""
    built = wall(floor(), 0.1)
    for options in ({"surface": 0.0}, {"material": 1}):
        assert not cuts_at(bench, built, (0, 0, 0), **options).any()
    assert not cuts_at(bench, built, (np.nan, 0, 0), (np.nan, 0, 0)).any()


@pytest.mark.parametrize(("quads", "is_cut"), [(60, True), (70, False)])
def test_more_than_can_be_looked_at(bench: Bench, quads: int, is_cut: bool) -> None:
    """Where triangles crowd, here beside a wall and between the levels, nothing is cut."""
    built = wall(floor(), 0.1)
    for x in np.linspace(-0.2, 0.0, quads):
        built.quad((x, 0, 0.03), (x + 0.01, 0, 0.03), (x + 0.01, 0.01, 0.03), (x, 0.01, 0.03))
    assert cuts_at(bench, built, (0.0, 0.0, 0.0)).any() == is_cut


def test_every_tree_makes_the_same_cuts(bench: Bench) -> None:
    """To the bit, also where obstacles are equally near, and triangles share a corner."""
    built, rng = floor(), np.random.default_rng(3)
    posts = [(x, y) for x in np.arange(-3, 4) / 4 for y in np.arange(-3, 4) / 4]
    for x, y in posts:
        built.box((x - 1 / 32, y - 1 / 32, -0.1), (x + 1 / 32, y + 1 / 32, 0.3))
    middles = np.array([(x + 1 / 8, y + 1 / 8, 0.0) for x, y in posts])  # of four corners
    between = middles - (0.0, 1 / 8, 0.0)  # of two sides
    points = np.concatenate(
        [middles, between, rng.uniform((-0.9, -0.9, 0), (0.9, 0.9, 0), (500, 3))]
    )
    scene = built.scene(cornell().camera, materials=MATERIALS)
    elsewhere = replace(scene, vertices=np.sin(50 * scene.vertices + np.arange(3)))
    old = replace(Mesh.build(elsewhere, HERE).tree, cost=np.inf)  # taken, however badly it does
    fresh, fitted = Mesh.build(scene, HERE), Mesh.build(scene, HERE, old)
    assert fitted.tree.order is old.order and not np.array_equal(fresh.tree.order, old.order)
    assert fresh.area == fitted.area
    one, other = both_cuts_at(bench, fresh, points), both_cuts_at(bench, fitted, points)
    assert np.count_nonzero(one[1].any(axis=1)) > 500
    for cuts, theirs in zip(one, other, strict=True):
        assert cuts.tobytes() == theirs.tobytes()
