# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangles of displaced surfaces cut into smaller ones, as small as they ask for, where vertices
are too few for what moves them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..scene import Camera, Scene
from .normals import longest_one, mean_about, mixed, unit

MOST_TRIANGLES = 1 << 20  # that all such surfaces have together
MOST_LEVELS = 12
SAME = 1e-3  # of the length of the mean of normals about a vertex that has one alone


def diced(scene: Scene, width: int) -> Scene:
    """The scene whose displaced surfaces have triangles as small as Scene.dicing says, in a picture
    so many pixels wide. All of a surface are cut alike, so that there are no gaps."""
    moved = np.array([material.displacement is not None for material in scene.materials], bool)
    if not len(scene.dicing) or not moved.any():
        return scene
    lengths = _lengths(scene)
    pixels = lengths / _pixel_at(scene.camera, scene.vertices[scene.triangles].mean(axis=1), width)
    moves = np.zeros(len(scene.triangles), bool)
    for one in scene.moving:  # whose movement is told of each of its vertices
        moves |= one.owns(scene.triangles)
    wanted = np.zeros(len(scene.triangles))
    for found, most in ((pixels, scene.dicing[:, 0]), (lengths, scene.dicing[:, 1])):
        limit = most[scene.surface]
        asks = (limit > 0.0) & moved[scene.material] & ~moves & np.isfinite(found)
        np.divide(found, limit, out=wanted, where=asks)
    levels = np.zeros(len(scene.surfaces), np.intp)
    np.maximum.at(levels, scene.surface, np.ceil(np.log2(np.maximum(wanted, 1.0))).astype(np.intp))
    levels = _affordable(np.minimum(levels, MOST_LEVELS), np.bincount(scene.surface))
    for level in range(int(levels.max(initial=0))):
        scene = _quartered(scene, levels[scene.surface] > level)
    return scene


def _affordable(levels: NDArray[np.intp], counts: NDArray[np.intp]) -> NDArray[np.intp]:
    """As many levels of surfaces of so many triangles as there may be triangles."""
    while (counts * 4**levels)[levels > 0].sum() > MOST_TRIANGLES:
        levels = np.where(levels == levels.max(), levels - 1, levels)
    return levels


def _lengths(scene: Scene) -> NDArray[np.float64]:
    """(T,) longest sides [m]."""
    corners = scene.vertices[scene.triangles]
    sides = corners - np.roll(corners, 1, axis=1)
    found: NDArray[np.float64] = np.linalg.norm(sides, axis=2).max(axis=1)
    return found


def _pixel_at(camera: Camera, places: NDArray[np.float64], width: int) -> NDArray[np.float64]:
    """(n,) how wide a pixel is at places [m]; infinitely behind the camera."""
    left, right, _, _ = camera.window
    way = places - camera.matrix[:3, 3]
    if camera.kind == "ORTHO":
        return np.full(len(places), (right - left) / width)
    distance: NDArray[np.float64] = np.linalg.norm(way, axis=1)
    if camera.is_panorama:
        return np.asarray(2.0 * np.pi / width * distance)
    ahead = -way @ camera.matrix[:3, 2] > 0.0
    found: NDArray[np.float64] = np.where(ahead, (right - left) / width * distance, np.inf)
    return found


def _quartered(scene: Scene, which: NDArray[np.bool_]) -> Scene:
    """The scene with four triangles for each of some (T,), on the smooth surface that these stand
    for: new vertices are where a cubic passes that is square to the normals at the ends of a side.
    """
    triangles, count = scene.triangles[which], len(scene.vertices)
    sides = np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2), axis=2)
    ends, number = np.unique(sides.reshape(-1, 2), axis=0, return_inverse=True)
    middle = (count + number.reshape(-1, 3)).astype(np.int32)
    a, b, c = triangles.T
    ab, bc, ca = middle.T
    cut = np.stack([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]).transpose(2, 0, 1)
    first, last = (scene.vertices[end] for end in ends.T)
    normals = _vertex_normals(scene, which)
    of_first, of_last = (normals[end] for end in ends.T)
    way = last - first
    rise = (way * of_last).sum(axis=1, keepdims=True) * of_last
    rise -= (way * of_first).sum(axis=1, keepdims=True) * of_first
    added = 0.5 * (first + last) + 0.125 * rise
    there = {"triangles": cut.reshape(-1, 3)}
    there["corner_normals"] = longest_one(mixed(scene.corner_normals[which], _cut))
    there |= {name: np.repeat(getattr(scene, name)[which], 4) for name in ("material", "surface")}
    if len(scene.flat):
        there["flat"] = np.repeat(scene.flat[which], 4)
    for name in ("corner_tangents", "corner_attributes"):
        if len(values := getattr(scene, name)):
            there[name] = _cut(values[which])
    joined = {
        name: np.concatenate([getattr(scene, name)[~which], values]).astype(
            getattr(scene, name).dtype
        )
        for name, values in there.items()
    }
    return replace(scene, vertices=np.concatenate([scene.vertices, added]), **joined)


def _cut(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """What corners have, (T, 3, n) or (T, A, 3, n), of four triangles each instead."""
    axis = values.ndim - 2
    a, b, c = np.moveaxis(values, axis, 0)
    ab, bc, ca = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)
    parts = [np.stack(x, axis) for x in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
    four = np.stack(parts, axis=1)
    found: NDArray[np.float32] = four.reshape(-1, *four.shape[2:]).astype(values.dtype)
    return found


def _vertex_normals(scene: Scene, which: NDArray[np.bool_]) -> NDArray[np.float64]:
    """(V, 3) unit, of vertices of some triangles that have one normal; else 0: sides there are
    straight."""
    corners = scene.triangles[which], unit(scene.corner_normals[which])
    mean = mean_about(*corners, len(scene.vertices))
    length = np.linalg.norm(mean, axis=1, keepdims=True)
    return np.where(length > 1.0 - SAME, mean / np.maximum(length, SAME), 0.0)
