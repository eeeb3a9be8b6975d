# SPDX-License-Identifier: GPL-3.0-or-later
"""Displaced surfaces are cut as small as asked, without gaps, and keep what corners have."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from addon.photon.scene import Displacement, Material, Moving, Scene
from addon.photon.stage import dicing
from addon.photon.stage.dicing import diced
from tests.scenes import Builder, camera

MOVES = Material("moves", displacement=Displacement((0.0, 0.0, 0.0)))
STAYS = Material("stays")


def spheres(asked: Any, **others: Any) -> Scene:
    """Two alike, of which a material moves the first one."""
    built = Builder().sphere((0, 0, 0), 1.0, 0, subdivisions=1)
    built.sphere((3, 0, 0), 1.0, 1, subdivisions=1)
    sizes = np.array([asked, asked], np.float32)
    return built.scene(camera((0, -5, 0), (0, 0, 0)), (), (MOVES, STAYS), dicing=sizes, **others)


def sides_of(scene: Scene, surface: int) -> Any:
    corners = scene.vertices[scene.triangles[scene.surface == surface]]
    return np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)


def test_as_small_as_asked() -> None:
    scene = spheres((0.0, 0.05))
    found = diced(scene, 100)
    found.check()
    before, after = (sides_of(x, 0).max() for x in (scene, found))
    assert before > 0.5 and 0.024 < after < 0.055  # a little longer, for it is round
    assert np.array_equal(sides_of(found, 1), sides_of(scene, 1))
    as_they_are = diced(replace(scene, dicing=np.zeros((2, 2), np.float32)), 100)
    assert np.array_equal(as_they_are.triangles, scene.triangles)
    assert diced(replace(scene, dicing=scene.dicing[:0]), 100).triangles is scene.triangles


def test_by_pixels() -> None:
    """Twice as many pixels, half as long."""
    few, many = (diced(spheres((2.0, 0.0)), width) for width in (128, 256))
    assert len(many.triangles) - 80 == 4 * (len(few.triangles) - 80)


def test_round_and_closed() -> None:
    found = diced(spheres((0.0, 0.05)), 100)
    own = found.triangles[found.surface == 0]
    radius = np.linalg.norm(found.vertices[np.unique(own)], axis=1)
    assert radius.min() > 0.98 and radius.max() < 1.01  # its corners alone were at 1, sides at 0.95
    sides = np.sort(np.stack([own, np.roll(own, 1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    _, counts = np.unique(sides, axis=0, return_counts=True)
    assert set(counts) == {2}
    normals = found.corner_normals[found.surface == 0]
    outward = found.vertices[own]
    outward /= np.linalg.norm(outward, axis=2, keepdims=True)
    assert np.allclose(normals, outward, atol=0.05)


def test_what_corners_have_is_interpolated() -> None:
    """A place as an attribute stays the place, on what is flat."""
    built = Builder().quad((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), 0)
    scene = built.scene(camera((0, -5, 5), (0, 0, 0)), (), (MOVES,))
    places = scene.vertices[scene.triangles]
    attributes = np.concatenate([places, np.ones_like(places[..., :1])], axis=2)[:, None]
    scene = replace(
        scene,
        corner_attributes=attributes.astype(np.float32),
        corner_tangents=places.astype(np.float32),
        flat=np.full(2, True),
        dicing=np.array([(0.0, 0.2)], np.float32),
    )
    found = diced(scene, 100)
    found.check()
    assert len(found.triangles) == 2 * 4**4 and found.flat.all()
    corners = found.vertices[found.triangles]
    assert np.allclose(found.corner_attributes[:, 0, :, :3], corners, atol=1e-6)
    assert np.allclose(found.corner_tangents, corners, atol=1e-6)
    a, b, c = np.moveaxis(corners, 1, 0)
    assert np.cross(b - a, c - a)[:, 2].sum() / 2.0 == pytest.approx(4.0)
    assert (np.cross(b - a, c - a)[:, 2] > 0.0).all()


def test_no_more_than_there_is_room_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dicing, "MOST_TRIANGLES", 6000)
    assert len(diced(spheres((0.0, 1e-6)), 100).triangles) == 80 * 4**3 + 80


def test_what_moves_stays_as_it_is() -> None:
    scene = spheres((0.0, 0.05))
    run = 0, int(scene.triangles[scene.surface == 0].max()) + 1
    moving = Moving(run, matrices=np.tile(np.eye(4), (2, 1, 1)))
    found = diced(replace(scene, moving=(moving,), shutter=(1.0,)), 100)
    assert np.array_equal(found.triangles, scene.triangles)


def test_behind_the_camera_is_as_it_was() -> None:
    away = replace(spheres((1.0, 0.0)), camera=camera((0, -5, 0), (0, -9, 0)))
    assert len(diced(away, 512).triangles) == len(away.triangles)
