# SPDX-License-Identifier: GPL-3.0-or-later
"""Walks below surfaces by the native core and in GLSL are the same."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from addon.photon.backends.native_kernels import NativeTriangles, NativeWalk
from addon.photon.kernels.records import PIXEL, RAY_DIRECTION, RAY_ORIGIN, THROUGHPUT, WALK
from addon.photon.kernels.walk import Walk
from addon.photon.stage.geometry import Mesh, frame_of
from addon.photon.stage.upload import texels_of, upload_table
from addon.streams import Device, Stream
from tests.scenes import Builder, camera, plain_light, plain_material

SIZE = (64, 64)
STREAMS = {
    "pixel": PIXEL,
    "origin": RAY_ORIGIN,
    "direction": RAY_DIRECTION,
    "throughput": THROUGHPUT,
    "walk": WALK,
}


def packed(radius: Any, albedo: Any) -> Any:
    """What a walk depends on, as glsl/lib/packed_walk.glsl has it; radii [scene units]."""
    octaves = np.clip(np.log2(np.maximum(radius, 2e-6) / 2e-6) / 21, 0, 1)
    return (np.floor(octaves * 511 + 0.5) * 256 + np.floor(albedo * 255 + 0.5)) * 128


def below(mesh: Mesh) -> dict[str, Any]:
    """Rays into a ball: a tenth is none, a tenth stays above, a tenth has channels that leave at
    once."""
    rng = np.random.default_rng(7)
    shape = SIZE[1], SIZE[0]
    corners = mesh.corners[..., :3].astype(np.float64)
    outer = np.flatnonzero(mesh.corners[:, 1, 3] == mesh.corners[:, 1, 3].min())
    entered = rng.choice(outer, shape)
    shares = rng.dirichlet((1, 1, 1), shape)
    position = (shares[..., None] * corners[entered]).sum(axis=-2)
    direction = -position / np.linalg.norm(position, axis=-1, keepdims=True)
    direction += rng.uniform(-0.4, 0.4, direction.shape)
    direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
    radius = rng.uniform(0.01, 0.3, (*shape, 3))
    radius[rng.random(shape) < 0.1, :2] = 0.0
    walk = packed(radius, rng.uniform(0, 1, radius.shape))
    walk[..., 2] += rng.integers(0, 4, shape)  # Blender's two models of it
    rows, columns = np.indices(shape)
    zeros = np.zeros(shape)
    found: dict[str, Any] = {
        "pixel": np.stack([columns, rows, zeros, zeros], axis=-1),
        "origin": np.concatenate([position, entered[..., None]], axis=-1),
        "direction": np.concatenate([direction, zeros[..., None] + 3e38], axis=-1),
        "throughput": rng.uniform(0.1, 1, (*shape, 4)),
        "walk": np.concatenate([walk, zeros[..., None] + 1], axis=-1),
    }
    found["walk"][rng.random(shape) < 0.1] = 0.0
    found["direction"][rng.random(shape) < 0.1] = 0.0
    return {name: x.astype(np.float32) for name, x in found.items()}


@pytest.mark.parametrize("depth", [0, 3])
def test_walk(device: Device, depth: int) -> None:
    """A smaller ball within is another surface, which walks do not meet."""
    built = Builder().sphere((0, 0, 0), 1.0, 0).sphere((0, 0, 0), 0.9, 0, "inner")
    lamp = plain_light("lamp", "POINT", (0, 0, 3), (1,) * 3)
    materials = (plain_material("m", (0.5,) * 3),)
    scene = built.scene(camera((0, -4, 0), (0, 0, 0), 30), (lamp,), materials)
    mesh = Mesh.build(scene, frame_of(scene))
    given = below(mesh)
    streams = {name: Stream(device, record, SIZE) for name, record in STREAMS.items()}
    for name, values in given.items():
        streams[name].upload(values)
    streams |= {name: Stream(device, record, SIZE) for name, record in Walk.outputs.items()}
    tables = {
        "nodes": upload_table(device, mesh.tree.nodes),
        "triangles": upload_table(device, texels_of(mesh.triangles)),
    }
    triangles = NativeTriangles()
    triangles.take(mesh)
    draw = {"seed": 5, "pass_index": 9, "depth": depth, "frame_size": SIZE}
    found = []
    for kernel, bound in ((Walk(device, "fragment"), tables), (NativeWalk(device, triangles), {})):
        count = kernel.count(streams, bound, draw).wait()
        found.append([streams[name].download().copy() for name in Walk.outputs])
        assert count == found[-1][0].any(axis=-1).sum()
        kernel.release()
    there = given["direction"].any(axis=-1)
    walks = given["walk"][..., 3] > 0
    for name, glsl, ours in zip(Walk.outputs, *found, strict=True):
        assert not glsl[~there].any() and not ours[~there].any()
        stays = there & ~walks
        np.testing.assert_array_equal(ours[stays], given[name.removeprefix("next_")][stays])
        close = np.isclose(ours, glsl, rtol=2e-3, atol=2e-3).all(axis=-1)[there & walks]
        assert close.mean() > 0.99, name  # what goes by an edge may come out elsewhere
    left = found[1][1][there & walks]
    came_out = left.any(axis=-1)
    assert 0.8 < came_out.mean() <= 1 and np.linalg.norm(left[came_out, :3], axis=-1).min() > 0.97
