# SPDX-License-Identifier: GPL-3.0-or-later
"""trace, occluded and trace_brute_force through their Python bindings."""

from __future__ import annotations

from typing import Any

import numpy as np
import photon_stream_native as native
import pytest
from numpy.typing import NDArray


class Case:
    """A soup of triangles, and rays through it."""

    def __init__(self, triangles: int = 300, rays: int = 5000) -> None:
        rng = np.random.default_rng(7)
        vertices = rng.random((triangles, 1, 3)) + 0.3 * rng.random((triangles, 3, 3))
        vertices = vertices.reshape(-1, 3).astype(np.float32)
        indices = np.arange(3 * triangles, dtype=np.int32).reshape(-1, 3)
        self.nodes, order, *_ = native.build_bvh(vertices, indices)
        self.corners: NDArray[np.float32] = vertices[indices[order]]
        self.origins = rng.random((rays, 3)).astype(np.float32)
        self.directions = rng.normal(size=(rays, 3)).astype(np.float32)
        self.t_max = np.full(rays, np.inf, np.float32)
        self.skip = np.full(rays, -1, np.int32)

    def rays(self) -> tuple[Any, ...]:
        return self.origins, self.directions, self.t_max, self.skip

    def trace(self) -> tuple[Any, ...]:
        return native.trace(self.nodes, self.corners, *self.rays())


@pytest.fixture
def case() -> Case:
    return Case()


def test_hits_lie_on_their_triangles(case: Case) -> None:
    t, triangle, u, v = case.trace()
    assert [a.dtype for a in (t, triangle, u, v)] == [np.float32, np.int32, np.float32, np.float32]
    hit = triangle >= 0
    assert 1000 < hit.sum() < len(hit)
    a, b, c = np.moveaxis(case.corners[triangle[hit]], 1, 0)
    u_, v_ = u[hit, None], v[hit, None]
    on_triangle = (1 - u_ - v_) * a + u_ * b + v_ * c
    on_ray = case.origins[hit] + t[hit, None] * case.directions[hit]
    # Relative to the unit size of the scene; grazing hits are the least exact.
    assert np.abs(on_triangle - on_ray).max() < 1e-4
    assert np.median(np.abs(on_triangle - on_ray)) < 1e-7
    assert np.isinf(t[~hit]).all() and not u[~hit].any() and not v[~hit].any()


def test_agrees_with_brute_force(case: Case) -> None:
    t, triangle, *_ = case.trace()
    t64, triangle64, u64, v64 = native.trace_brute_force(case.corners, *case.rays())
    assert t64.dtype == u64.dtype == v64.dtype == np.float64 and triangle64.dtype == np.int32
    assert (triangle == triangle64).mean() > 0.999
    same = (triangle == triangle64) & (triangle >= 0)
    assert np.allclose(t[same], t64[same], rtol=1e-4, atol=1e-6)


def test_occluded_agrees_with_trace(case: Case) -> None:
    _, triangle, *_ = case.trace()
    occluded = native.occluded(case.nodes, case.corners, *case.rays())
    assert occluded.dtype == np.bool_ and (occluded == (triangle >= 0)).all()


def test_t_max_and_skip(case: Case) -> None:
    t, triangle, *_ = case.trace()
    case.t_max = t  # Exclusive: the hit itself is beyond reach.
    assert not native.occluded(case.nodes, case.corners, *case.rays())[triangle >= 0].any()
    case.t_max, case.skip = np.full_like(t, np.inf), triangle
    behind, other, *_ = case.trace()
    hit = triangle >= 0
    assert (other[hit] != triangle[hit]).all() and (behind >= t).all()


@pytest.mark.parametrize("any_hit", [False, True])
def test_few_rays_hit_what_all_do(case: Case, any_hit: bool) -> None:
    """By the tree as it is built; of two triangles at one distance that of the smaller number."""
    corners = np.zeros((2 * len(case.corners), 3, 4), np.float32)
    corners[..., :3] = np.concatenate([case.corners, case.corners])  # each is there twice
    corners[:, 2, 3] = np.random.default_rng(3).permutation(len(corners))
    vertices = corners[..., :3].reshape(-1, 3).copy()
    nodes, order, *_ = native.build_bvh(
        vertices, np.arange(len(vertices), dtype=np.int32).reshape(-1, 3)
    )
    corners = corners[order]
    case.skip[::3] = case.trace()[1][::3]
    case.t_max[::2] = 0.3
    case.directions[0, 1] = case.origins[1, 2] = np.nan
    case.directions[2], case.t_max[3] = 0, np.nan
    origin = np.column_stack([case.origins, case.skip]).astype(np.float32)
    direction = np.column_stack([case.directions, case.t_max])
    few = native.trace_few(nodes, corners, origin, direction, any_hit)
    tracer = native.Tracer(nodes, corners)
    all_of_them = tracer.trace(origin[None], direction[None], any_hit)[0]
    assert few.dtype == np.float32 and not few[:4].any()
    hit = few[:, 1] > 0
    assert 0.2 < hit.mean() < 0.99
    if any_hit:
        np.testing.assert_array_equal(hit, all_of_them[:, 1] > 0)
        assert (few[hit, 0] < case.t_max[hit]).all()
    else:
        np.testing.assert_array_equal(few, all_of_them)


@pytest.mark.parametrize("second", [3, 1])
def test_trees_that_no_build_makes(second: int) -> None:
    """Leaves in no order, and an inner node that has no children: every triangle is still there."""
    missing = [3e38] * 3 + [-1.0] + [-3e38] * 3 + [0.0]
    child = lambda first, count: [-9.0] * 3 + [first] + [9.0] * 3 + [count]  # noqa: E731
    rows = [[*child(1, 0), *missing], [*child(0, 1), *child(2, 0)], [*child(1, 1), *child(3, 1)]]
    if second == 1:
        rows = [[*child(1, 0), *child(0, 4)], [*missing, *missing]]
    corners = np.array([[[-1, -1, z], [2, -1, z], [-1, 2, z]] for z in (2, 3, 4, 1.5)], np.float32)
    ray = [np.array([row], np.float32) for row in ((0, 0, 0), (0, 0, 1))]
    limits = np.array([np.inf], np.float32), np.array([-1], np.int32)
    t, triangle, *_ = native.trace(np.array(rows, np.float32), corners, *ray, *limits)
    assert (t[0], triangle[0]) == (1.5, 3)


@pytest.mark.stability(26)
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_useless_rays_miss(case: Case, bad: float) -> None:
    case.directions[0, 1] = case.origins[1, 2] = bad
    case.directions[2] = 0
    case.t_max[3] = np.nan
    assert (case.trace()[1][:4] == -1).all()
    assert (native.trace_brute_force(case.corners, *case.rays())[1][:4] == -1).all()


@pytest.mark.stability(18)
def test_nothing_to_trace() -> None:
    nodes, *_ = native.build_bvh(np.zeros((0, 3), np.float32), np.zeros((0, 3), np.int32))
    case = Case(triangles=1, rays=3)
    assert (native.trace(nodes, case.corners[:0], *case.rays())[1] == -1).all()
    case = Case(rays=0)
    assert [len(a) for a in case.trace()] == [0, 0, 0, 0]


def test_bad_rays(case: Case) -> None:
    case.skip[17] = 300
    with pytest.raises(ValueError, match=r"skip\[17\] = 300 is outside \[-1, 300\)"):
        case.trace()
    case.skip = case.skip[:-1].copy()
    with pytest.raises(ValueError, match="skip has 4999 rows, but origins has 5000"):
        case.trace()
    case.directions = case.directions.astype(np.float64)
    with pytest.raises(TypeError, match="directions: expected float32, got float64"):
        case.trace()


def test_bad_nodes(case: Case) -> None:
    with pytest.raises(ValueError, match=r"nodes\[\d+, \d+\] = "):
        native.trace(case.nodes, case.corners[:10], *case.rays())
    case.nodes[0, 3] = 0  # The root as its own child: a traversal would never end.
    with pytest.raises(ValueError, match=r"nodes\[0, 3\] = 0, nodes\[0, 7\] = 0"):
        case.trace()
    with pytest.raises(ValueError, match=r"nodes: expected shape \[any, 16\]"):
        native.occluded(case.nodes[:, :8].copy(), case.corners, *case.rays())
    corners = np.zeros((300, 3, 4), np.float32)
    rays = np.column_stack([0 * case.origins[:5] + 0.5, case.t_max[:5]])
    with pytest.raises(ValueError, match=r"nodes\[0, 3\] = 0, nodes\[0, 7\] = 0"):
        native.trace_few(case.nodes, corners, rays, rays, False)
    with pytest.raises(ValueError, match=r"direction: expected shape \[5, 4\]"):
        native.trace_few(case.nodes, corners, rays, rays[:4], False)
