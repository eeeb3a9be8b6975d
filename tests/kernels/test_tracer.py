# SPDX-License-Identifier: GPL-3.0-or-later
"""Tracer against the native core, which another program wrote and other tests check."""

from __future__ import annotations

from typing import Any

import numpy as np
import photon_stream_native as native
import pytest
from numpy.typing import NDArray

from addon.photon.kernels.records import VISIBILITY
from addon.photon.kernels.tracer import Tracer
from addon.photon.scene import RAY_BITS
from addon.photon.stage.upload import texels_of
from tests.kernels.conftest import Bench
from tests.scenes import icosphere
from tests.stability.table import Measured

T_MAX = 3.0e38  # glsl/lib/constants.glsl
RAYS_FROM_THE_EYE = ("camera", "diffuse", "glossy", "transmission")


class Mesh:
    """Triangles with their BVH, and rays."""

    def __init__(self, vertices: Any, triangles: Any) -> None:
        vertices, triangles = np.float32(vertices), np.int32(triangles)
        self.nodes, order, *_ = native.build_bvh(vertices, triangles)
        self.corners: NDArray[np.float32] = vertices[triangles[order]]
        texels = np.zeros((*self.corners.shape[:2], 4), np.float32)
        texels[..., :3] = self.corners
        self.tables = {"nodes": self.nodes, "triangles": texels}

    def trace(
        self, bench: Bench, rays: Any, any_hit: bool = False, **defines: int
    ) -> NDArray[np.float32]:
        """Hits (n, 4): t, triangle + 1, u, v."""
        origins, directions, t_max, skip = rays
        result = bench.run(
            Tracer,
            {
                "origin": np.concatenate([origins, skip[:, None]], 1),
                "direction": np.concatenate([directions, t_max[:, None]], 1),
            },
            tables=self.tables,
            defines={"ANY_HIT": 1, **defines} if any_hit else defines,
        )
        assert result["alive"] == np.count_nonzero(result["hit"][:, 1])
        return result["hit"]


def soup(count: int = 3000) -> Mesh:
    """Triangles of many sizes, all over the place."""
    rng = np.random.default_rng(8)
    size = 10 ** rng.uniform(-3, -0.3, (count, 1, 1))
    vertices = rng.uniform(-0.8, 0.8, (count, 1, 3)) + size * rng.uniform(-1, 1, (count, 3, 3))
    return Mesh(np.clip(vertices, -1, 1).reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))


def rays(count: int, t_max: float = T_MAX) -> tuple[Any, ...]:
    """Random rays within the cube."""
    rng = np.random.default_rng(9)
    origins = rng.uniform(-1, 1, (count, 3)).astype(np.float32)
    directions = rng.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    directions[: count // 10] = np.eye(3)[rng.integers(0, 3, count // 10)]  # along the axes
    skip = np.full(count, -1, np.int32)
    return origins, directions.astype(np.float32), np.full(count, t_max, np.float32), skip


def test_soup_equals_native(bench: Bench) -> None:
    mesh, some = soup(), rays(200_000)
    hit = mesh.trace(bench, some)
    t, triangle, u, v = native.trace(mesh.nodes, mesh.corners, *some)
    assert 0.3 < (triangle >= 0).mean() < 0.99
    same = hit[:, 1] == triangle + 1
    close = np.isclose(hit[:, 0], np.where(triangle < 0, 0, t), rtol=1e-4, atol=1e-6)
    assert (same & close).mean() >= 0.999
    # Where another triangle was found, it is another one at the same distance.
    both = (hit[:, 1] > 0) & (triangle >= 0)
    assert np.isclose(hit[both, 0], t[both], rtol=1e-3, atol=1e-5).mean() >= 0.9999
    assert np.allclose(hit[same & both, 2], u[same & both], atol=2e-3)
    assert np.allclose(hit[same & both, 3], v[same & both], atol=2e-3)
    assert not hit[hit[:, 1] == 0].any()


@pytest.mark.parametrize("t_max", [0.2, T_MAX])
def test_any_hit_equals_native(bench: Bench, t_max: float) -> None:
    mesh, some = soup(), rays(200_000, t_max)
    hit = mesh.trace(bench, some, any_hit=True)
    occluded = native.occluded(mesh.nodes, mesh.corners, *some)
    assert 0.1 < occluded.mean() < 0.99
    assert ((hit[:, 1] > 0) == occluded).mean() >= 0.9999
    assert (hit[:, 0] < t_max).all()


@pytest.mark.parametrize("any_hit", [False, True])
def test_rays_pass_what_is_not_visible_to_them(bench: Bench, any_hit: bool) -> None:
    """As in the native core, and as if it were not there."""
    mesh, some = soup(), rays(50_000, 0.5 if any_hit else T_MAX)
    rng = np.random.default_rng(3)
    surfaces = rng.integers(0, 5, len(mesh.corners))
    table = VISIBILITY.zeros(5)
    table["rays"] = 0, 1, 4, 2, 7
    mesh.tables["triangles"][:, 1, 3] = surfaces  # type: ignore[call-overload]
    mesh.tables |= {"visibility": texels_of(table)}
    hit = mesh.trace(bench, some, any_hit, VISIBILITY=5)
    there = np.isin(surfaces, (1, 2, 4))
    assert there[hit[hit[:, 1] > 0, 1].astype(int) - 1].all()
    bits = table["rays"].astype(np.uint8)[surfaces]
    core = native.Tracer(mesh.nodes, mesh.tables["triangles"], bits)
    origin = np.concatenate([some[0], some[3][:, None]], 1).astype(np.float32)[None]
    direction = np.concatenate([some[1], some[2][:, None]], 1)[None]
    ours = core.trace(origin, direction, any_hit, 5)[0]
    left = mesh.corners[there]
    indices = np.arange(3 * len(left), dtype=np.int32).reshape(-1, 3)
    nodes, order, *_ = native.build_bvh(left.reshape(-1, 3), indices)
    expected = native.trace(nodes, left[order], *some)
    for found in (hit, ours):
        assert ((found[:, 1] > 0) == (expected[1] >= 0)).mean() > 0.9999
        if not any_hit:
            both = (found[:, 1] > 0) & (expected[1] >= 0)
            assert np.isclose(found[both, 0], expected[0][both], rtol=1e-3, atol=1e-5).all()
    everything = core.trace(origin, direction, any_hit)[0]
    assert (everything[:, 1] > 0).sum() > (ours[:, 1] > 0).sum()
    with pytest.raises(ValueError, match=r"visible"):
        native.Tracer(mesh.nodes, mesh.tables["triangles"], bits[:-1])


@pytest.mark.thorough("compute")
def test_rays_say_by_their_reach_what_they_are(bench: Bench) -> None:
    """Each meets what is visible to its kind; the eye's own go less far than others."""
    mesh, (origins, directions, _, skip) = soup(), rays(50_000)
    rng = np.random.default_rng(4)
    surfaces = rng.integers(0, 4, len(mesh.corners))
    table = VISIBILITY.zeros(4)
    table["rays"] = [RAY_BITS[name] for name in RAYS_FROM_THE_EYE]
    mesh.tables["triangles"][:, 1, 3] = surfaces  # type: ignore[call-overload]
    mesh.tables |= {"visibility": texels_of(table)}
    kinds = rng.integers(0, 5, len(origins))
    bits_of = [RAY_BITS[name] for name in RAYS_FROM_THE_EYE]
    through = RAY_BITS["diffuse"] + RAY_BITS["transmission"]  # by a diffuse lobe: of transmission
    own = np.array([1.0e36, *(T_MAX / (1 + bits) for bits in (*bits_of[1:], through))])
    mixed = origins, directions, own[kinds].astype(np.float32), skip
    hit = mesh.trace(bench, mixed, VISIBILITY=sum(RAY_BITS.values()), BY_REACH=1)
    bits = table["rays"].astype(np.uint8)[surfaces]
    core = native.Tracer(mesh.nodes, mesh.tables["triangles"], bits)
    origin = np.concatenate([origins, skip[:, None]], 1).astype(np.float32)[None]
    direction = np.concatenate([directions, mixed[2][:, None]], 1)[None]
    ours = core.trace(origin, direction, False, 255, True)[0]
    for number, name in enumerate((*RAYS_FROM_THE_EYE, "transmission")):
        some = kinds == number
        expected = mesh.trace(bench, mixed, VISIBILITY=RAY_BITS[name])[some]
        assert 0.2 < (expected[:, 1] > 0).mean() < 0.99
        np.testing.assert_array_equal(hit[some], expected)
        alone = core.trace(origin, direction, False, RAY_BITS[name])[0][some]
        np.testing.assert_array_equal(ours[some], alone)


def test_reach_and_source(bench: Bench) -> None:
    """The hit itself is beyond t_max, and a ray does not see the triangle it left."""
    mesh, (origins, directions, t_max, skip) = soup(), rays(50_000)
    _, triangle, *_ = native.trace(mesh.nodes, mesh.corners, origins, directions, t_max, skip)
    found = triangle >= 0
    first = (origins[found], directions[found], t_max[found], skip[found])
    hit = mesh.trace(bench, first)
    short = mesh.trace(bench, (*first[:2], hit[:, 0], first[3]))
    assert (short[:, 1] == 0).mean() == 1.0
    source = (hit[:, 1] - 1).astype(np.int32)
    behind = mesh.trace(bench, (*first[:3], source))
    there = behind[:, 1] > 0
    assert there.any() and (behind[there, 1] != hit[there, 1]).all()
    assert (behind[there, 0] >= hit[there, 0]).all()


@pytest.mark.thorough("compute")
@pytest.mark.parametrize("any_hit", [False, True])
def test_every_tree_has_the_same_hits(bench: Bench, any_hit: bool, thorough: bool) -> None:
    """To the bit, of triangles everywhere, in one place, needles and a closed mesh: a tree that
    was built for them, and one that was built when they were elsewhere."""
    rng = np.random.default_rng(4)
    ball, sides = icosphere(3)
    loose = rng.uniform(-0.8, 0.8, (900, 1, 3)) + 0.3 * rng.uniform(-1, 1, (900, 3, 3))
    loose[600:, 2] = loose[600:, 1] + 1e-5 * loose[600:, 2]
    points = np.float32(np.concatenate([0.7 * ball, loose.reshape(-1, 3)]))
    triangles = np.concatenate([sides, len(ball) + np.arange(2700).reshape(-1, 3)])
    triangles = np.int32(np.concatenate([triangles, triangles[::3], triangles[::5]]))
    elsewhere = np.float32(np.sin(40 * points))
    nodes, order, *_, cost = native.build_bvh(elsewhere, triangles)
    fitted = native.refit_bvh(nodes, order, points, triangles)
    assert fitted and fitted[3] > 1.5 * cost
    built, its_order, *_ = native.build_bvh(points, triangles)

    count = 120_000 if thorough else 40_000
    origins, directions, t_max, skip = rays(count)
    a, b, c = np.moveaxis(points[triangles[rng.integers(0, len(triangles), len(skip))]], 1, 0)
    share = rng.random((len(skip), 2))
    share[::4] = 0.0  # at corners, and at edges
    share[1::4, 1] = 0.0
    targets = a + share[:, :1] * (b - a) + share[:, 1:] * (c - a)
    # Along their planes, almost.
    graze = np.arange(len(skip)) % 4 == 2
    origins[graze] = (a + 3 * (b - a) + 1e-6 * origins)[graze]
    aimed = np.arange(len(skip)) % 10 > 0
    directions[aimed] = (targets - origins)[aimed]
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    found = []
    for tree, numbers in ((built, its_order), (fitted[0], order)):
        texels = np.zeros((len(triangles), 3, 4), np.float32)
        texels[..., :3] = points[triangles[numbers]]
        texels[:, 2, 3] = numbers
        mesh = Mesh(points, triangles)
        mesh.tables = {"nodes": tree, "triangles": texels}
        hit = mesh.trace(bench, (origins, directions, t_max, skip), any_hit)
        number = np.where(hit[:, 1] > 0, numbers[hit[:, 1].astype(int) - 1], -1)
        found.append(hit[:, 1] > 0 if any_hit else np.column_stack([hit[:, [0, 2, 3]], number]))
    assert np.count_nonzero(np.any(found[0] != found[1], axis=-1)) == 0
    assert any_hit or np.count_nonzero(found[0][:, 3] >= 0) > count / 2


@pytest.mark.thorough("compute")
def test_hits_lie_within_their_boxes(bench: Bench) -> None:
    """Almost in a triangle's plane its distance is rounded by as much as it is long; were it nearer
    than the box, the box might be passed by."""
    rng = np.random.default_rng(6)
    count = 2000
    points = np.float32(rng.uniform(-0.9, 0.9, (count, 3, 3)))
    nearest = []
    for start in range(0, count, 20):  # few at a time: each is hit
        mesh = Mesh(points[start : start + 20].reshape(-1, 3), np.arange(60).reshape(-1, 3))
        a, b, c = np.moveaxis(np.repeat(mesh.corners, 500, axis=0), 1, 0)
        share = rng.random((len(a), 3))
        origins = np.float32(b + share[:, :1] * (b - a) + 1e-7 * rng.normal(size=a.shape))
        directions = np.float32(a + share[:, 1:2] * (c - a) - origins)
        full, none = np.full(len(a), T_MAX, np.float32), np.full(len(a), -1, np.int32)
        hit = mesh.trace(bench, (origins, directions, full, none))
        found = hit[:, 1] > 0
        corners = mesh.corners[hit[found, 1].astype(int) - 1]
        origin, direction = origins[found], directions[found]
        pad = 7.2e-7 + 1.2e-7 * np.abs(origin).max(axis=1, keepdims=True)
        ends = np.stack([corners.min(axis=1) - pad - origin, corners.max(axis=1) + pad - origin])
        entry = (ends / direction).min(axis=0).max(axis=1)
        nearest.append(hit[found, 0] - entry)
    assert sum(map(len, nearest)) > 100_000
    assert np.concatenate(nearest).min() > -1e-6


@pytest.mark.stability(16)
@pytest.mark.thorough("compute-1.0", "fragment-0.001")
@pytest.mark.parametrize("scale", [1.0, 1e-3])
def test_no_ray_leaves_a_closed_mesh(bench: Bench, scale: float, measured: Measured) -> None:
    """A million random rays from inside; scale 1e-3: a small object in a scene of size one."""
    vertices, triangles = icosphere(4)
    mesh = Mesh(vertices * scale, triangles)
    origins, directions, t_max, skip = rays(1_000_000)
    origins = origins * np.float32(0.55 * scale)  # the corners of the cube are inside
    hit = mesh.trace(bench, (origins, directions, t_max, skip))
    assert measured("on the device, of 4e6", np.count_nonzero(hit[:, 1] == 0)) == 0
    t, triangle, *_ = native.trace(mesh.nodes, mesh.corners, origins, directions, t_max, skip)
    assert (triangle >= 0).all()
    same = (hit[:, 1] == triangle + 1) & np.isclose(hit[:, 0], t, rtol=1e-4)
    assert same.mean() >= 0.999


@pytest.mark.stability(15)
def test_rays_at_edges_and_corners(bench: Bench, measured: Measured, thorough: bool) -> None:
    """Where triangles meet, one of them is hit."""
    vertices, triangles = icosphere(3)
    mesh = Mesh(vertices, triangles)
    a, b = mesh.corners[:, 0], mesh.corners[:, 1]
    rng = np.random.default_rng(2)
    count = 2_000_000 if thorough else 100_000
    pick, share = rng.integers(0, len(a), count), rng.random((count, 1))
    share[: count // 5] = 0.0
    targets = a[pick] * (1 - share) + b[pick] * share
    origins = rng.uniform(-0.4, 0.4, (count, 3)).astype(np.float32)
    directions = targets - origins
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    full, none = np.full(count, T_MAX, np.float32), np.full(count, -1, np.int32)
    hit = mesh.trace(bench, (origins, np.float32(directions), full, none))
    assert measured(f"on the device, of {2 * count:.0e}", np.count_nonzero(hit[:, 1] == 0)) == 0


USELESS = [
    ("origin", np.nan),
    ("origin", np.inf),
    ("origin", -np.inf),
    ("direction", np.nan),
    ("direction", np.inf),
    ("direction", -np.inf),
    ("t_max", np.nan),
    ("t_max", 0.0),
    ("t_max", -1.0),
]


@pytest.mark.stability(26)
@pytest.mark.parametrize("any_hit", [False, True])
def test_useless_rays_miss(bench: Bench, any_hit: bool, measured: Measured) -> None:
    vertices, triangles = icosphere(2)
    mesh = Mesh(vertices, triangles)
    some = rays(3 * len(USELESS) + 2)
    origins, directions, t_max, _ = some
    origins *= np.float32(0.1)
    assert (mesh.trace(bench, some, any_hit)[:, 1] > 0).all()
    for row, (what, value) in enumerate(USELESS):
        for axis in range(3):
            at = 3 * row + axis
            if what == "t_max":
                t_max[at] = value
            else:
                {"origin": origins, "direction": directions}[what][at, axis] = value
    directions[-2:] = 0.0
    hit = mesh.trace(bench, some, any_hit)
    assert measured(f"hits of {len(hit)} such rays", np.count_nonzero(hit.any(axis=1))) == 0


@pytest.mark.stability(18)
@pytest.mark.parametrize("count", [0, 1])
def test_next_to_nothing(bench: Bench, count: int) -> None:
    mesh = Mesh([(-1, -1, 0), (1, -1, 0), (0, 1, 0)], np.array([[0, 1, 2]])[:count])
    origins = np.float32([[0, 0, 1], [0, 0, 1], [5, 5, 1]])
    directions = np.float32([[0, 0, -1], [0, 0, 1], [0, 0, -1]])
    full, none = np.full(3, T_MAX, np.float32), np.full(3, -1, np.int32)
    hit = mesh.trace(bench, (origins, directions, full, none))
    assert hit[:, 1].tolist() == [count, 0, 0]
    if count:
        assert hit[0].tolist() == [1.0, 1.0, 0.25, 0.5]
