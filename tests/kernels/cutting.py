# SPDX-License-Identifier: GPL-3.0-or-later
"""Discs on a floor, and what both ways to cut them find."""

from __future__ import annotations

from typing import Any

import numpy as np
import photon_stream_native as native
from numpy.typing import NDArray

from addon.photon.backends.native_kernels import tracer_of
from addon.photon.kernels.cuts import Cuts
from addon.photon.stage.geometry import Frame, Mesh
from tests.kernels.conftest import Bench
from tests.scenes import GREY, Builder, cornell, plain_material

RADIUS = 0.3
FINE = 300  # places in a radius, where integrals are sums
UP = (0.0, 0.0, 1.0)
BLACK = plain_material("black", (0.0,) * 3)
MATERIALS = (GREY, BLACK)
DIFFUSE = np.float32([(0.5, 0.5, 0.5, 1.0), (0.0, 0.0, 0.0, 0.0)])  # as Shade writes them
HERE = Frame(np.zeros(3), 1.0)


def even(radius: float) -> Any:
    """One radius everywhere."""
    none = np.zeros((0, 4), np.float32)
    size: Any = {"photons": 1.0, "times": 1.0, "most": radius, "pixel": radius, "eye": None}
    return native.RadiusField(none, none, native.radius_grids(none)[0], **size)


def mesh_of(built: Builder) -> Mesh:
    return Mesh.build(built.scene(cornell().camera, materials=MATERIALS), HERE)


def texels(points: Any, fourth: Any) -> NDArray[np.float32]:
    points = np.atleast_2d(np.asarray(points, np.float32))
    made = np.empty((len(points), 4), np.float32)
    made[:, :3], made[:, 3] = points, fourth
    return made


def cuts_at(
    bench: Bench,
    built: Builder,
    points: Any,
    normals: Any = UP,
    surface: Any = 1.0,
    material: int = 0,
) -> NDArray[np.float32]:
    """(n, 4) cuts of discs of RADIUS, which both ways to compute them agree on."""
    glsl, ours = both_cuts_at(bench, mesh_of(built), points, normals, surface, material)
    # Each is a vector; a tie between obstacles may fall to either.
    pairs = (x.reshape(-1, 2, 2) for x in (glsl, ours))
    apart, length = (
        np.linalg.norm(np.subtract(*pairs), axis=2),
        np.linalg.norm(ours.reshape(-1, 2, 2), axis=2),
    )
    assert (apart < 1e-3 + 1e-3 * length).all(axis=1).mean() > 0.998
    return np.asarray(ours)


def both_cuts_at(
    bench: Bench,
    mesh: Mesh,
    points: Any,
    normals: Any = UP,
    surface: Any = 1.0,
    material: int = 0,
) -> tuple[Any, Any]:
    """By the kernel and by the native core."""
    place = texels(points, surface)
    facing = texels(np.broadcast_to(normals, place[:, :3].shape), 1.0)
    diffuse = np.tile(DIFFUSE[material], (len(place), 1))
    radii = even(2 * RADIUS)
    tables = {
        "nodes": mesh.tree.nodes,
        "triangles": mesh.triangles,
        "radii": radii.table(),
    }
    points = {"place": place, "facing": facing, "diffuse": diffuse}
    glsl = bench.run(Cuts, points, {"radius_scale": 0.5}, tables)["cuts"]
    ours = tracer_of(mesh).cuts(*(x[None] for x in points.values()), radii, radius_scale=0.5)[0]
    return glsl, ours


def floor() -> Builder:
    return Builder().quad((-0.9, -0.9, 0), (0.9, -0.9, 0), (0.9, 0.9, 0), (-0.9, 0.9, 0))


def wall(built: Builder, x: float, low: float = -0.1, high: float = 0.8) -> Builder:
    """One that faces the x axis."""
    return built.quad((x, -0.9, low), (x, 0.9, low), (x, 0.9, high), (x, -0.9, high))
