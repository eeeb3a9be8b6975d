# SPDX-License-Identifier: GPL-3.0-or-later
"""build_bvh through its Python binding: layout, dtypes, skipped triangles, errors."""

from __future__ import annotations

import numpy as np
import photon_stream_native as native
import pytest
from numpy.typing import NDArray

VERTICES = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], np.float32)
TRIANGLES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], np.int32)


def soup(count: int, seed: int = 0) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Small triangles scattered over the unit cube."""
    rng = np.random.default_rng(seed)
    vertices = rng.random((count, 1, 3)) + 0.05 * rng.random((count, 3, 3))
    triangles = np.arange(3 * count, dtype=np.int32).reshape(-1, 3)
    return vertices.reshape(-1, 3).astype(np.float32), triangles


def test_layout() -> None:
    vertices, triangles = soup(2000)
    nodes, order, not_finite, degenerate, _ = native.build_bvh(vertices, triangles)
    assert nodes.dtype == np.float32 and nodes.shape[1:] == (16,) and nodes.flags.c_contiguous
    assert order.dtype == np.int32 and sorted(order) == list(range(2000))
    assert (not_finite, degenerate) == (0, 0)
    corners = vertices[triangles[order]]
    seen = np.zeros(2000, int)
    stack = [(0, 1)]
    while stack:
        node, depth = stack.pop()
        assert depth <= native.MAX_DEPTH
        for child in np.split(nodes[node], 2):
            low, high, first, size = child[:3], child[4:7], int(child[3]), int(child[7])
            if size == 0:
                assert first > node
                stack.append((first, depth + 1))
                continue
            assert size <= native.MAX_LEAF
            seen[first : first + size] += 1
            leaf = corners[first : first + size].reshape(-1, 3)
            assert (leaf.min(0) == low).all() and (leaf.max(0) == high).all()
    assert (seen == 1).all()


@pytest.mark.stability(18)
@pytest.mark.parametrize("count", [0, 1])
def test_missing_children(count: int) -> None:
    nodes, order, *_ = native.build_bvh(VERTICES, TRIANGLES[:count])
    missing = [3e38, 3e38, 3e38, -1, -3e38, -3e38, -3e38, 0]
    assert nodes.shape == (1, 16) and len(order) == count
    assert (nodes[0, 8:] == np.array(missing, np.float32)).all()
    expected = [0, 0, 0, 0, 1, 1, 0, 1] if count else missing
    assert (nodes[0, :8] == np.array(expected, np.float32)).all()


@pytest.mark.stability(19)
def test_bad_triangles_are_skipped_and_counted() -> None:
    huge = np.array([[np.nan, 0, 0], [np.inf, 0, 0], [1e31, 0, 0]], np.float32)
    vertices = np.concatenate([VERTICES, huge])
    bad = np.array([[0, 1, 4], [0, 1, 5], [6, 1, 2], [0, 1, 1], [3, 3, 3]], np.int32)
    triangles = np.concatenate([bad, TRIANGLES])
    nodes, order, not_finite, degenerate, _ = native.build_bvh(vertices, triangles)
    clean_nodes, clean_order, *_ = native.build_bvh(VERTICES, TRIANGLES)
    assert (not_finite, degenerate) == (3, 2)
    assert (nodes == clean_nodes).all() and (order == clean_order + len(bad)).all()


def test_deterministic() -> None:
    mesh = soup(50_000)
    nodes, order, *_ = native.build_bvh(*mesh)
    for _ in range(3):
        again, order_again, *_ = native.build_bvh(*mesh)
        assert again.tobytes() == nodes.tobytes() and (order_again == order).all()


@pytest.mark.stability(21)
@pytest.mark.parametrize("value", [-1, 4, 2**31 - 1])
def test_bad_index(value: int) -> None:
    triangles = TRIANGLES.copy()
    triangles[2, 1] = value
    with pytest.raises(ValueError, match=rf"triangles\[2, 1\] = {value} is outside \[0, 4\)"):
        native.build_bvh(VERTICES, triangles)


def test_bad_arrays() -> None:
    with pytest.raises(TypeError, match="vertices: expected float32, got float64"):
        native.build_bvh(VERTICES.astype(np.float64), TRIANGLES)
    with pytest.raises(TypeError, match="triangles: expected int32, got int64"):
        native.build_bvh(VERTICES, TRIANGLES.astype(np.int64))
    with pytest.raises(TypeError, match="vertices: expected a numpy array of float32, got list"):
        native.build_bvh(VERTICES.tolist(), TRIANGLES)
    with pytest.raises(ValueError, match=r"triangles: expected shape \[any, 3\], got \[4, 2\]"):
        native.build_bvh(VERTICES, TRIANGLES[:, :2].copy())
    with pytest.raises(ValueError, match="vertices: expected a C-contiguous array"):
        native.build_bvh(np.asfortranarray(VERTICES), TRIANGLES)
