# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays and geometry: rounding, degenerate shapes, thin walls, shadows."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from statistics import median
from typing import Any

import numpy as np
import photon_stream_native as native
import pytest

from addon.photon.kernels.tracer import Tracer
from addon.photon.scene import Scene
from addon.streams import Device
from tests.flip import mean_flip
from tests.kernels.conftest import Bench
from tests.measure import MIDDLES, fallen, not_finite, render, render_clean, rendered
from tests.scenes import (
    GREY,
    Builder,
    camera,
    cornell,
    emitted_flux,
    icosphere,
    orthographic,
    plain_light,
    plain_material,
    replace,
)
from tests.stability.table import Measured

SCALES = (1e-4, 1e-2, 1.0, 1e3, 1e6)


class Rays:
    """A mesh in the native core, and what of it rays hit."""

    def __init__(self, vertices: Any, triangles: Any) -> None:
        vertices, triangles = np.float32(vertices), np.int32(triangles)
        self.nodes, order, *_ = native.build_bvh(vertices, triangles)
        self.corners = vertices[triangles[order]]

    def trace(self, origins: Any, directions: Any) -> Any:
        """(t, triangle, u, v) of each ray."""
        count = len(origins)
        rays = np.float32(origins), np.float32(directions)
        limits = np.full(count, np.inf, np.float32), np.full(count, -1, np.int32)
        return native.trace(self.nodes, self.corners, *rays, *limits)

    def misses(self, origins: Any, directions: Any) -> int:
        return int(np.count_nonzero(self.trace(origins, directions)[1] < 0))


def seconds(work: Callable[[], Any]) -> float:
    """The median of five."""
    times = []
    for _ in range(5):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return median(times)


@pytest.mark.stability(15, 16)
def test_closed_mesh_is_watertight(measured: Measured, thorough: bool) -> None:
    """From inside: at random directions, and at vertices and edges; at five scales."""
    count = 2_000_000 if thorough else 100_000
    rng = np.random.default_rng(1)
    vertices, triangles = icosphere(4)
    at_random = at_edges = 0
    for scale in SCALES:
        rays = Rays(vertices * scale, triangles)
        origins = rng.uniform(-0.5, 0.5, (count, 3)) * scale
        at_random += rays.misses(origins, rng.normal(size=(count, 3)))
        origins = np.float32(origins)
        ends = np.float64(rays.corners[rng.integers(0, len(triangles), count)])
        share = np.where(np.arange(count) % 2, rng.random(count), 0.0)[:, None]
        targets = ends[:, 0] + share * (ends[:, 1] - ends[:, 0])
        at_edges += rays.misses(origins, targets - origins)
    total = f"of {5 * count:.0e}"
    assert measured(f"misses {total}", at_edges, row=15) == 0
    assert measured(f"misses {total}", at_random, row=16) == 0


@pytest.mark.stability(13)
@pytest.mark.parametrize("scale", SCALES)
def test_no_self_hits(device: Device, measured: Measured, thorough: bool, scale: float) -> None:
    """A convex body casts no shadow on itself: what faces a light is lit."""
    size = 500 if thorough else 250
    body = Builder().sphere((0, 0, 0), scale, subdivisions=3, smooth=False)
    view = camera((0, -3 * scale, 0.4 * scale), (0, 0, 0), 40)
    dark = rays = 0
    for azimuth in (0.3, 1.0, 2.0, 3.0):
        place = np.array([-math.sin(azimuth), -math.cos(azimuth), 0.3]) * 3 * scale
        light = plain_light("light", "POINT", tuple(place), (100.0 * scale**2,) * 3)
        images = render_clean(
            device, body.scene(view, [light], [GREY]), photons=0, width=size, height=size
        )
        facing = images["Normal"] @ place
        # Of a facet the nearest point to the light may be turned away where its plane is not:
        # the light is above the plane by more than the facet's own height.
        lit = facing > 1.05 * scale
        dark += np.count_nonzero(images["Direct"][..., 0][lit] == 0)
        rays += np.count_nonzero(lit)
    assert rays > size * size
    assert measured(f"false shadows of {rays:.0e} rays a scale", dark) == 0


@pytest.mark.stability(14)
def test_thin_walls_stop_every_ray(device: Device, measured: Measured, thorough: bool) -> None:
    """A box whose walls are 1e-5 of the scene thick, lit inside, in a box that catches the rest."""
    photons = 1_000_000 if thorough else 200_000
    half, wall = 0.5, 2e-5
    b = Builder().box((-half,) * 3, (half,) * 3, name="inner")
    b.box((-half - wall,) * 3, (half + wall,) * 3, name="outer").box(
        (-1,) * 3, (1,) * 3, name="catcher"
    )
    light = plain_light("light", "POINT", (0.1, 0.2, 0.3), (1.0,) * 3)
    scene = b.scene(
        orthographic((0, 0, 0.9), (1, 0, 0), (0, 1, 0), 1.8),
        [light],
        [plain_material("w", (0.8,) * 3)],
    )
    # Of ten million rays one starts on an edge to the last bit and gets through: not of this seed.
    settings = {"photons": photons, "direct_by_photons": True, "seed": 1}
    with rendered(device, scene, **settings) as renderer:
        flux = fallen(renderer)[:, 0]
        seen = renderer.images()["Combined"][..., :3].max()
    assert flux[0] > 0
    rays = photons * flux[0] / emitted_flux(light)[0]  # each that arrives was one
    assert measured(f"photons outside, of {rays:.0e} rays", flux[1:].max()) == 0
    assert seen == 0


@pytest.mark.stability(8)
def test_contact_shadow(device: Device, measured: Measured) -> None:
    """A cube on a floor: which pixels of the floor are dark, by an exact slab test."""
    n, size = 128, 4.0
    light = np.array([-2.0, 0.3, 2.5])
    b = (
        Builder()
        .quad((-5, -5, 0), (5, -5, 0), (5, 5, 0), (-5, 5, 0))
        .box((-0.5, -0.5, 0), (0.5, 0.5, 1), skip="-z")
    )
    scene = b.scene(
        orthographic((0.5, 0, 3), (1, 0, 0), (0, 1, 0), size),
        [plain_light("light", "POINT", tuple(light), (100.0,) * 3)],
        [GREY],
    )
    found = render(device, scene, photons=0, width=n, height=n, **MIDDLES)["Direct"][..., 0] == 0
    middles = (np.arange(n) + 0.5) / n * size
    x, y = np.meshgrid(middles - 1.5, middles - 2)
    p = np.stack([x, y, np.zeros_like(x)], -1)
    with np.errstate(divide="ignore"):
        near, far = ((np.array(c) - p) / (light - p) for c in ((-0.5, -0.5, 0), (0.5, 0.5, 1)))
    enter = np.minimum(near, far).max(-1)
    dark = (enter < np.maximum(near, far).min(-1)) & (np.maximum(near, far).min(-1) > 0)
    floor = np.maximum(np.abs(x), np.abs(y)) > 0.5
    wrong = (found != dark) & floor
    assert dark[floor].sum() > 500
    grown = np.pad(dark, 1)
    neighbours = np.stack(
        [grown[1 + i : 1 + i + n, 1 + j : 1 + j + n] for i in (-1, 0, 1) for j in (-1, 0, 1)]
    )
    at_edge = neighbours.any(axis=0) & ~neighbours.all(axis=0)
    measured("pixels at the edge on its wrong side", wrong.sum())
    assert measured("wrong ones farther away", (wrong & ~at_edge).sum()) == 0


@pytest.mark.stability(10)
@pytest.mark.parametrize("one_object", [False, True])
def test_hidden_sheet(device: Device, measured: Measured, one_object: bool) -> None:
    """Two sheets 1e-6 of the scene apart, the upper one lit; the lower one seen from below."""
    z = 2e-6
    b = Builder()
    if one_object:
        b.add(
            [
                (-1, -1, z),
                (1, -1, z),
                (1, 1, z),
                (-1, 1, z),
                (-1, -1, 0),
                (1, -1, 0),
                (1, 1, 0),
                (-1, 1, 0),
            ],
            [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]],
        )
    else:
        for height in (z, 0.0):
            b.quad((-1, -1, height), (1, -1, height), (1, 1, height), (-1, 1, height))
    light = plain_light("light", "POINT", (0, 0, 1), (100.0,) * 3)
    below = b.scene(orthographic((0, 0, -1), (-1, 0, 0), (0, 1, 0), 1.8), [light], [GREY])
    above = replace(below, camera=orthographic((0, 0, 1), (1, 0, 0), (0, 1, 0), 1.8))
    settings: dict[str, Any] = {"direct_by_photons": True, "radius": 0.3}
    assert render_clean(device, above, **settings)["Indirect"].min() > 0
    for by_photons in (True, False):
        settings["direct_by_photons"] = by_photons
        hidden = render_clean(device, below, **settings)["Combined"][..., :3].max()
        assert measured("hidden sheet", hidden) == 0


@pytest.mark.stability(20)
def test_duplicate_triangles(device: Device, measured: Measured) -> None:
    """1e5 times the same triangle against as many different ones."""
    vertices, triangles = icosphere(6)
    vertices = np.float32(vertices)
    triangles = np.int32(np.resize(triangles, (100_000, 3)))
    same = np.int32(np.tile(triangles[:1], (100_000, 1)))
    usual = seconds(lambda: native.build_bvh(vertices, triangles))
    ratio = seconds(lambda: native.build_bvh(vertices, same)) / usual
    assert measured("build time ratio", ratio) <= 2
    nodes, order, *_ = native.build_bvh(vertices, same)
    assert len(order) == 100_000 and len(nodes) <= 100_000
    scene = cornell()
    settings: dict[str, Any] = {"photons": 0, "width": 8, "height": 8}
    plain = render_clean(device, scene, **settings)["Direct"]
    for count in (1000, 100_000):
        crowded = render_clean(device, with_copies(scene, count), **settings)["Direct"]
        error = np.abs(crowded - plain).max() / plain.max()
        measured(f"picture with {count} copies differs by", error)
        assert error <= 1e-5 or (count == 100_000 and device.is_software)
    if error > 1e-5:
        measured.falls_short("Mesa's llvmpipe ends a program's loops after 65535 steps")


def with_copies(scene: Scene, count: int) -> Scene:
    """The scene with its first triangle so many times more."""
    row = np.zeros(count, int)
    names = ("triangles", "corner_normals", "material", "surface")
    arrays = {x: np.concatenate([getattr(scene, x), getattr(scene, x)[row]]) for x in names}
    return replace(scene, **arrays)


@pytest.mark.stability(22)
def test_coplanar_overlap(device: Device, measured: Measured) -> None:
    """Two overlapping quads in one plane: whichever is seen, it is the same each time."""
    corners = [(-1, -1, 0.3), (1, -1, 0.3), (1, 1, 0.3), (-1, 1, 0.3)]
    shifted = [(x + 0.3, y + 0.2, z) for x, y, z in corners]
    light = plain_light("light", "POINT", (0.2, 0.1, 2), (100.0,) * 3)
    colours = [plain_material("red", (0.9, 0.0, 0.0)), plain_material("green", (0.0, 0.9, 0.0))]
    scene = (
        Builder()
        .quad(*corners, 0)
        .quad(*shifted, 1)
        .scene(camera((0, -2, 2), (0, 0, 0)), [light], colours)
    )
    backends = ["fragment", "compute"] if device.has_compute else ["fragment"]
    pictures = [
        render_clean(device, scene, backend=x)["Combined"] for x in backends for _ in range(3)
    ]
    differ = sum(np.count_nonzero(x != pictures[0]) for x in pictures[1:])
    assert measured("values that differ in 6 renders", differ) == 0
    assert (np.count_nonzero(pictures[0][..., :2], axis=-1) <= 1).all()  # never a mixture


@pytest.mark.stability(23)
def test_non_manifold(device: Device, measured: Measured) -> None:
    """An edge of five faces, a bow tie, a T-junction, open edges and a Moebius strip."""
    b = Builder()
    fan = [(0, 0, 0), (0, 0, 1), *((math.cos(a), math.sin(a), 0.5) for a in range(5))]
    b.add(fan, [[0, 1, k] for k in range(2, 7)])
    b.add([(0, 0, 2), (1, 0, 3), (1, 1, 3), (-1, 0, 1), (-1, -1, 1)], [[0, 1, 2], [0, 3, 4]])
    b.add(
        [(2, 0, 0), (3, 0, 0), (2, 1, 0), (2.5, 0, 0), (2.5, -1, 0)],
        [[0, 1, 2], [0, 4, 3], [3, 4, 1]],
    )
    turns = np.linspace(0, 2 * math.pi, 13)[:-1]
    strip = [
        (
            (2 + s * math.cos(t / 2)) * math.cos(t),
            (2 + s * math.cos(t / 2)) * math.sin(t),
            s * math.sin(t / 2),
        )
        for t in turns
        for s in (-0.4, 0.4)
    ]
    ring = [[2 * i, 2 * i + 1, 2 * i + 2, 2 * i + 3] for i in range(11)] + [[22, 23, 1, 0]]
    b.add(strip, [t for a, c, d, e in ring for t in ([a, c, d], [c, e, d])])
    light = plain_light("light", "POINT", (1, -2, 4), (100.0,) * 3)
    scene = b.scene(
        camera((0, -7, 3), (0, 0, 0.5)), [light], [plain_material("m", (0.5,) * 3, (0.3,) * 3)]
    )
    images = render_clean(device, scene, passes=2)
    assert images["Direct"].max() > 0 and images["Indirect"].max() > 0
    assert measured("values that are not finite", not_finite(images)) == 0


@pytest.mark.stability(24)
def test_flipped_normals(device: Device, measured: Measured) -> None:
    """Every triangle wound the other way, or every normal turned: surfaces have two sides."""
    scene = cornell(True, lobe=True)
    settings: dict[str, Any] = {"width": 64, "height": 64, "radius": 0.8}
    good = render_clean(device, scene, **settings)
    wound = {
        "triangles": np.ascontiguousarray(scene.triangles[:, ::-1]),
        "corner_normals": np.ascontiguousarray(scene.corner_normals[:, ::-1]),
    }
    for changed in (wound, {"corner_normals": -scene.corner_normals}):
        images = render_clean(device, replace(scene, **changed), **settings)
        seen = mean_flip(good["Combined"][..., :3], images["Combined"][..., :3])
        assert measured("mean FLIP", seen) <= 0.01


@pytest.mark.stability(25)
def test_shadow_terminator(device: Device, measured: Measured) -> None:
    """A coarse smooth ball: what its smooth normals turn to the light is lit."""
    ball = Builder().sphere((0, 0, 0), 1.0, subdivisions=2)
    light = plain_light("light", "POINT", (100, 0, 0), (1e6,) * 3)
    images = render_clean(
        device,
        ball.scene(camera((0, -4, 0), (0, 0, 0), 32), [light], [GREY]),
        photons=0,
        width=128,
        height=128,
    )
    cosine = images["Normal"][..., 0]
    seen = images["Depth"][..., 0] < 100
    black = seen & (images["Direct"][..., 0] == 0) & (cosine > 0.02)
    share = measured("of the lit half black", black.sum() / (seen & (cosine > 0.02)).sum(), "%")
    assert share <= 1e-3


@pytest.mark.stability(26)
def test_useless_rays_cost_little(measured: Measured) -> None:
    """A million rays that are NaN, infinite or zero, against a million good ones."""
    count = 300_000
    rng = np.random.default_rng(5)
    rays = Rays(*icosphere(5))
    origins, directions = rng.uniform(-0.5, 0.5, (count, 3)), rng.normal(size=(count, 3))
    usual = seconds(lambda: rays.trace(origins, directions))
    for value in (np.nan, np.inf, 0.0):
        bad = np.array(directions)
        bad[:, 1 if value else slice(None)] = value
        assert rays.misses(origins, bad) == count
        ratio = seconds(lambda bad=bad: rays.trace(origins, bad)) / usual
        assert measured("time ratio", ratio) <= 1.5


@pytest.mark.stability(17)
def test_needles(device: Device, measured: Measured) -> None:
    """Triangles 1e-4 to 1e-7 as wide as long, against float64 where that is sure of itself."""
    rng = np.random.default_rng(4)
    wrong_share: dict[tuple[str, float], float] = {}
    for width in (1e-4, 1e-5, 1e-6, 1e-7):
        count = 500
        start, along, across = rng.normal(size=(3, count, 3))
        along, across = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in (along, across))
        start *= 0.3
        corners = np.float32(np.stack([start, start + along, start + width * across], 1))
        rays = Rays(corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))
        u, v = rng.dirichlet((2, 2, 2), count)[:, :2].T[..., None]
        a, b, c = np.float64(corners).transpose(1, 0, 2)
        normal = np.cross(b - a, c - a)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        directions = np.float32(normal + 0.3 * rng.normal(size=(count, 3)))
        origins = np.float32(a + u * (b - a) + v * (c - a) - directions)
        limits = np.full(count, 3e38, np.float32), np.full(count, -1, np.int32)
        exact = native.trace_brute_force(rays.corners, origins, directions, *limits)
        inside = np.minimum(np.minimum(exact[2], exact[3]), 1 - exact[2] - exact[3])
        sure = (exact[1] >= 0) & (inside > 0.01)
        for name, hits in (
            ("native", rays.trace(origins, directions)),
            ("device", trace_on(device, rays, origins, directions)),
        ):
            other = sure & (hits[1] != exact[1])
            same = sure & ~other
            wrong = np.abs(hits[0][same] / exact[0][same] - 1) > 1e-3
            share = (np.count_nonzero(other) + np.count_nonzero(wrong)) / np.count_nonzero(sure)
            wrong_share[name, width] = measured(f"{name}, {width:g} wide, wrong", share, "%")
    assert wrong_share["native", 1e-4] == wrong_share["native", 1e-5] == 0.0
    assert wrong_share["native", 1e-6] < 0.01 and wrong_share["device", 1e-4] == 0.0
    assert 0.005 < wrong_share["device", 1e-5] < 0.05 < wrong_share["device", 1e-6] < 0.4
    measured.falls_short(
        "float32 corners less the origin: wrong from 1e-5 on the device, from 1e-6 natively"
    )


def trace_on(device: Device, rays: Rays, origins: Any, directions: Any) -> tuple[Any, ...]:
    """(t, triangle, u, v) by the Tracer kernel."""
    texels = np.zeros((*rays.corners.shape[:2], 4), np.float32)
    texels[..., :3] = rays.corners
    count = len(origins)
    streams = {
        "origin": np.concatenate([origins, np.full((count, 1), -1)], 1),
        "direction": np.concatenate([directions, np.full((count, 1), 3e38)], 1),
    }
    bench = Bench(device, "fragment")
    hit = bench.run(Tracer, streams, tables={"nodes": rays.nodes, "triangles": texels})["hit"]
    return hit[:, 0], hit[:, 1].astype(int) - 1, hit[:, 2], hit[:, 3]
