# SPDX-License-Identifier: GPL-3.0-or-later
"""Coverage of surfaces that are narrower than the disc: a pass of few probes tells it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from addon.photon.kernels.coverage import Coverage
from addon.photon.ways.native_kernels import tracer_of
from tests.kernels.conftest import Bench
from tests.kernels.test_cuts import DIFFUSE, RADIUS, UP, even, mesh_of, texels, weights
from tests.scenes import Builder

WIDE = 0.1 * RADIUS  # of the strip, to either side of the point
FEW, PASSES = 4, 64
CORNERS = np.array([(-WIDE, -0.8, 0), (WIDE, -0.8, 0), (WIDE, 0.8, 0), (-WIDE, 0.8, 0)])
BELOW = CORNERS - (0, 0, 0.05 * RADIUS)
TWO = [[0, 1, 2], [0, 2, 3]]


def strip() -> Builder:
    return Builder().add(CORNERS, TWO)


def board() -> Builder:
    """A strip with a lower side, which no photon reaches from above."""
    sides = [[0, 1, 5], [0, 5, 4], [1, 2, 6], [1, 6, 5], [2, 3, 7], [2, 7, 6], [3, 0, 4], [3, 4, 7]]
    return Builder().add([*CORNERS, *BELOW], [*TWO, [4, 6, 5], [4, 7, 6], *sides])


def turned() -> Builder:
    """One of two triangles shows its back."""
    return Builder().add(CORNERS, [[0, 1, 2], [0, 3, 2]])


def doubled() -> Builder:
    """Each triangle is there twice."""
    return Builder().add(CORNERS, [*TWO, *TWO])


def divided() -> Builder:
    """More triangles than an outline has."""
    across, up = np.linspace(-WIDE, WIDE, 3), np.linspace(-0.8, 0.8, 81)
    vertices = [(x, y, 0) for y in up for x in across]
    corner = np.array([3 * j + i for j in range(80) for i in range(2)])[:, None]
    triangles = np.concatenate([corner + np.array(added) for added in ((0, 1, 4), (0, 4, 3))])
    return Builder().add(vertices, triangles)


def shares(bench: Bench, built: Builder) -> Any:
    """(2, PASSES, points): the share of a filter that passes find, by GLSL and natively."""
    count = 16
    mesh, radii = mesh_of(built), even(RADIUS)
    place = np.stack([0 * np.arange(count), np.linspace(-0.2, 0.2, count), np.zeros(count)], 1)
    pixel = np.zeros((count, 4), np.float32)
    pixel[:, 0] = np.arange(count)
    up = np.broadcast_to(UP, (count, 3))
    streams = {"pixel": pixel, "place": texels(place, 1.0), "facing": texels(up, 1.0)}
    streams |= {"shading": texels(up, 0.0), "cuts": np.zeros((count, 4), np.float32)}
    streams["diffuse"] = np.tile(DIFFUSE[0], (count, 1))
    tables = {
        "nodes": mesh.tree.nodes,
        "triangles": mesh.triangles,
        "corner_normals": mesh.normals,
        "radii": radii.table(),
    }
    draw: dict[str, Any] = {"probes": FEW, "seed": 3, "depth": 0}
    draw |= {"radius_scale": 1.0, "frame_size": (count, 1)}
    found = []
    for index in range(PASSES):
        draw["first_probe"] = index * FEW
        glsl = bench.run(Coverage, streams, draw, tables, {"FILTER_EPANECHNIKOV": 1})["coverage"]
        arrays = (x[None] for x in streams.values())
        ours = tracer_of(mesh).coverage(*arrays, radii, filter="epanechnikov", **draw)[0][0]
        found.append((glsl[:, :2], ours[:, :2]))
    return np.moveaxis(np.array(found), 1, 0)


def on_strip() -> list[float]:
    """What of the filter, and of the inner one, is on the strip."""
    side = (np.arange(2000) + 0.5) / 1000 - 1
    u, v = np.meshgrid(side, side)
    there, x2 = np.abs(u) * RADIUS < WIDE, u * u + v * v
    filters = weights("epanechnikov", x2), 2 * weights("epanechnikov", 2 * x2)
    return [float((filter_ * there).sum() / 1000**2) for filter_ in filters]


@pytest.mark.parametrize(
    ("made", "noise"), [(strip, 0.12), (board, 0.12), (turned, 1.1), (doubled, 1.1), (divided, 1.1)]
)
def test_narrow_surfaces(one_bench: Bench, made: Callable[[], Builder], noise: float) -> None:
    """The mean is right whatever triangles do. A pass's noise, in shares: by probes alone 0.97."""
    expected = on_strip()
    for found in shares(one_bench, made()):
        np.testing.assert_allclose(found.mean(axis=(0, 1)), expected, rtol=0.02)
        assert (found[..., 0].std(axis=0) / expected[0]).mean() < noise
