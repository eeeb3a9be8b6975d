# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps for what media emit: where they are, and how much they have in all."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from addon.photon.scene import BLACK, TRANSPARENT, Lobe, Material, Medium, Scene
from addon.photon.stage import insides
from addon.photon.stage.glow import MOST_LAMPS, lit_by_media
from tests.scenes import Builder, camera

GLOW = (3.0, 1.0, 0.5)
EYE = camera((0, -5, 1), (0, 0, 1), 40)
GLOWING = Material("glow", BLACK, (Lobe(TRANSPARENT, (1.0,) * 3),), medium=Medium(emission=GLOW))


def lamps_of(built: Builder) -> tuple[np.ndarray, np.ndarray]:
    """Where they are (n, 3), and their flux (n, 3)."""
    lit = lit_by_media(built.scene(EYE, (), (GLOWING,)))
    places = np.reshape([x.position for x in lit.lights], (-1, 3))
    return places, np.reshape([x.power for x in lit.lights], (-1, 3))


def flux_of(volume: float) -> Any:
    return pytest.approx(4.0 * math.pi * volume * np.array(GLOW), rel=1e-3)


def one_mesh(*parts: Builder) -> Builder:
    """Several as one surface."""
    whole = Builder()
    vertices, triangles, first = [], [], 0
    for part in parts:
        scene = part.scene(EYE, (), (GLOWING,))
        vertices.append(scene.vertices)
        triangles.append(scene.triangles + first)
        first += len(scene.vertices)
    return whole.add(np.concatenate(vertices), np.concatenate(triangles))


def box(low: Any, size: Any) -> Builder:
    return Builder().box(tuple(low), tuple(np.add(low, size)), 0)


def test_a_ball() -> None:
    """As large as its triangles are; its lamps are all through it."""
    places, flux = lamps_of(Builder().sphere((1, 2, 3), 0.5, 0, subdivisions=3))
    corners = Builder().sphere((1, 2, 3), 0.5, 0, subdivisions=3).scene(EYE, (), (GLOWING,))
    volume = insides.volume_of(corners.vertices[corners.triangles])
    assert 0.97 < volume / (math.pi / 6.0) < 1.0
    assert flux.sum(axis=0) == flux_of(volume) and 500 < len(places) <= MOST_LAMPS
    far = np.linalg.norm(places - (1, 2, 3), axis=1)
    assert far.max() < 0.52 and far.mean() == pytest.approx(0.375, abs=0.02)


def test_small_parts_of_a_large_mesh() -> None:
    """Each has its own, by its size."""
    low = [(0, 0, 0), (10, 10, 10), (-7, 3, 5)]
    built = one_mesh(
        *(box(x, (size,) * 3) for x, size in zip(low, (0.01, 0.01, 0.02), strict=True))
    )
    places, flux = lamps_of(built)
    assert flux.sum(axis=0) == flux_of(10e-6)
    for corner, volume in zip(low, (1e-6, 1e-6, 8e-6), strict=True):
        there = (np.abs(places - corner) < 0.03).all(axis=1)
        assert flux[there].sum(axis=0) == flux_of(volume)


def test_many_parts() -> None:
    """Of more than are compared each has one."""
    random = np.random.default_rng(1).random((insides.MOST_PARTS + 50, 3)) * 100.0
    _, flux = lamps_of(one_mesh(*(box(x, (0.1,) * 3) for x in random)))
    assert flux.sum(axis=0) == flux_of(1e-3 * len(random))


def test_what_is_thin() -> None:
    """A slanted bar, of a section of 4 mm and a metre long."""
    bar = box((-0.002, -0.002, 0.0), (0.004, 0.004, 1.0)).scene(EYE, (), (GLOWING,))
    turn = np.array([[0.6, 0.0, 0.8], [0.48, 0.8, -0.36], [-0.64, 0.6, 0.48]])
    built = Builder().add(bar.vertices @ turn.T, bar.triangles)
    _, flux = lamps_of(built)
    assert flux.sum(axis=0) == flux_of(16e-6)


def test_what_is_hollow() -> None:
    """A ball within another, whose faces look inwards."""
    outer = Builder().sphere((0, 0, 0), 1.0, 0, subdivisions=3)
    inner = Builder().sphere((0, 0, 0), 0.6, 0, subdivisions=3).scene(EYE, (), (GLOWING,))
    turned = Builder().add(inner.vertices, inner.triangles[:, ::-1])
    places, flux = lamps_of(one_mesh(outer, turned))
    expected = 4.0 * math.pi * 4.0 / 3.0 * math.pi * (1.0 - 0.6**3) * np.array(GLOW)
    assert flux.sum(axis=0) == pytest.approx(expected, rel=0.03)
    assert np.linalg.norm(places, axis=1).min() > 0.5


def test_what_is_open() -> None:
    """A tube without ends has what is in it; a sheet has nothing."""
    turns = np.linspace(0.0, 2.0 * np.pi, 32, endpoint=False)
    ring = np.stack([np.cos(turns), np.sin(turns)], axis=-1)
    ends = np.concatenate([np.column_stack([ring, np.full(32, z)]) for z in (0.0, 3.0)])
    step = np.arange(32)
    after = (step + 1) % 32
    sides = [np.stack([step, after, after + 32], -1), np.stack([step, after + 32, step + 32], -1)]
    _, flux = lamps_of(Builder().add(ends, np.concatenate(sides)))
    assert flux.sum(axis=0) == pytest.approx(
        4.0 * math.pi * 3.0 * math.pi * np.array(GLOW), rel=0.03
    )
    sheet = [[0, 0, 0], [1, 0, 1], [1, 1, 1], [0, 1, 0]]
    places, _ = lamps_of(Builder().add(sheet, [[0, 1, 2], [0, 2, 3]]))
    assert not len(places)


def test_pairs_go_in_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of triangles and columns, and give the same."""
    built = Builder().sphere((0, 0, 0), 1.0, 0, subdivisions=3)
    whole = lamps_of(built)
    monkeypatch.setattr(insides, "AT_ONCE", 1000)
    for one, other in zip(whole, lamps_of(built), strict=True):
        np.testing.assert_array_equal(one, other)


def test_what_does_not_glow_has_no_lamps() -> None:
    scene: Scene = Builder().sphere((0, 0, 0), 1.0, 0).scene(EYE, (), (Material("bare"),))
    assert lit_by_media(scene) is scene
