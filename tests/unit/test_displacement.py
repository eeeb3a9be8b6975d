# SPDX-License-Identifier: GPL-3.0-or-later
"""Programs move surfaces as formulae do, whatever the device runs them with."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from addon.photon.backends.backend import backend_of
from addon.photon.errors import SceneError
from addon.photon.photons import kept
from addon.photon.photons.kept import Kept
from addon.photon.prepare import prepare
from addon.photon.scene import Displacement, Instruction, Material, Moving, Result, Scene
from addon.photon.settings import Settings
from addon.photon.stage.displacement import displaced
from addon.streams import Device
from tests.measure import render
from tests.scenes import camera, hills

WAYS = ["native", "fragment", "compute"]
SIZE: dict[str, Any] = {"width": 24, "height": 24, "photons": 4000}
POSITION, NORMAL = ((number, number, number, number) for number in (0.0, 2.0))
NOWHERE = (0.0, 0.0, 0.0, 0.0)
MULTIPLIED = (2.0, 2.0, 2.0, 1.0)


def by_normal() -> tuple[Instruction, ...]:
    """The normal times the place's x."""
    place, normal = (Instruction("geometry", (which, NOWHERE)) for which in (POSITION, NORMAL))
    product = Instruction("arithmetic", (Result(1), Result(0, "x"), NOWHERE, MULTIPLIED))
    return place, normal, product


def ground(move: Displacement | None, **others: Any) -> Scene:
    """Level smooth ground of which one material moves all, and a wall that stays."""
    scene = hills(8)
    vertices = scene.vertices.copy()
    level = scene.triangles[scene.surface == 0]
    vertices[np.unique(level), 2] = 0.0
    materials = (Material("moves", displacement=move), Material("stays"))
    number = scene.surface.copy()
    return replace(scene, vertices=vertices, materials=materials, material=number, **others)


def moved(scene: Scene, device: Device, way: str = "auto") -> Scene:
    return Kept(device, budget=0).worked_out(scene, 24, backend_of(Settings(backend=way), device))


@pytest.mark.parametrize("way", WAYS)
def test_by_a_formula(device: Device, way: str) -> None:
    scene = ground(Displacement(Result(2), by_normal()))
    found, level = moved(scene, device, way), np.unique(scene.triangles[scene.surface == 0])
    expected = scene.vertices.copy()
    expected[level, 2] += expected[level, 0]
    assert np.allclose(found.vertices, expected, atol=1e-5)
    assert not any(material.displacement for material in found.materials)
    # A plane of 45 degrees, smooth, and a wall as it was.
    slope = np.array((-1.0, 0.0, 1.0)) / np.sqrt(2.0)
    assert np.allclose(found.corner_normals[scene.surface == 0], slope, atol=1e-5)
    wall = scene.surface == 1
    assert np.array_equal(found.corner_normals[wall], scene.corner_normals[wall])


def test_normals_stay_where_bumps_bend_them(device: Device) -> None:
    scene = ground(Displacement(Result(2), by_normal(), turns_normals=False))
    found = moved(scene, device)
    assert not np.array_equal(found.vertices, scene.vertices)
    assert np.array_equal(found.corner_normals, scene.corner_normals)


def test_flat_triangles_have_their_own_normals(device: Device) -> None:
    place, normal, product = by_normal()
    squared = Instruction("arithmetic", (Result(0, "x"), Result(0, "x"), NOWHERE, MULTIPLIED))
    product = replace(product, operands=(Result(1), Result(2), *product.operands[2:]))
    scene = ground(Displacement(Result(3), (place, normal, squared, product)))
    flat = replace(scene, flat=np.full(len(scene.triangles), True))
    found = moved(flat, device)
    a, b, c = np.moveaxis(found.vertices[found.triangles], 1, 0)
    own = np.cross(b - a, c - a)
    own /= np.linalg.norm(own, axis=1, keepdims=True)
    assert np.allclose(found.corner_normals, own[:, None], atol=1e-5)
    assert not np.allclose(moved(scene, device).corner_normals, own[:, None], atol=1e-3)


def test_by_a_constant_and_of_no_area(device: Device) -> None:
    """A triangle without any area says nothing, nor does what is not finite."""
    scene = ground(Displacement((0.5, 0.0, 1.0)))
    vertices, triangles = scene.vertices.copy(), scene.triangles.copy()
    vertices[triangles[0]] = np.nan
    triangles[1] = triangles[1][0]
    scene = replace(scene, vertices=vertices, triangles=triangles)
    found = moved(scene, device)
    change = found.vertices - scene.vertices
    finite = np.isfinite(change).all(axis=1)
    assert {tuple(row) for row in change[finite]} == {(0.0, 0.0, 0.0), (0.5, 0.0, 1.0)}


def test_nothing_moves(device: Device) -> None:
    scene = ground(None)
    assert moved(scene, device) is scene
    unworn = replace(
        scene,
        materials=(
            *scene.materials,
            Material("unworn", displacement=Displacement((1.0, 0.0, 0.0))),
        ),
    )
    assert np.array_equal(moved(unworn, device).vertices, scene.vertices)


@pytest.mark.parametrize("way", WAYS)
def test_the_picture_is_that_of_the_moved_mesh(device: Device, way: str) -> None:
    scene = ground(Displacement(Result(2), by_normal()))
    itself, there = (render(device, x, backend=way, **SIZE) for x in (scene, moved(scene, device)))
    assert np.array_equal(itself["Combined"], there["Combined"])


def test_what_bends_is_displaced_at_each_step(device: Device) -> None:
    scene = ground(Displacement(Result(2), by_normal()))
    own = scene.surface == 0
    run = int(scene.triangles[own].min()), int(scene.triangles[own].max()) + 1
    bent = np.zeros((2, run[1] - run[0], 3), np.float32)
    bent[1, :, 2] = scene.vertices[slice(*run), 1]  # up to one side
    normals = np.tile(scene.corner_normals[own].reshape(1, -1, 3), (2, 1, 1))
    corners = np.arange(normals.shape[1], dtype=np.int32).reshape(-1, 3)
    moving = Moving(run, offsets=bent, normals=normals, corners=corners)
    found = moved(replace(scene, moving=(moving,), shutter=(1.0,)), device).moving[0]
    of_steps = found.normals[:, found.corners]
    for step, slope in enumerate(((-1.0, 0.0, 1.0), (-1.0, -1.0, 1.0))):
        assert np.allclose(of_steps[step], slope / np.linalg.norm(slope), atol=1e-5)


def test_flat_ones_that_become_smooth_do_so_at_each_step(device: Device) -> None:
    """As Blender before 5.2 has what is displaced and bent, whether it moves or not."""
    rough = ground(Displacement(Result(2), by_normal(), turns_normals=False, smooths=True))
    vertices = rough.vertices.copy()
    own = rough.surface == 0
    level = np.unique(rough.triangles[own])
    vertices[level, 2] = 0.2 * np.sin(3.0 * vertices[level, 0])
    scene = replace(rough, vertices=vertices, flat=own)
    run = int(scene.triangles[own].min()), int(scene.triangles[own].max()) + 1
    bent = np.zeros((2, run[1] - run[0], 3), np.float32)
    moving = Moving(run, offsets=bent, normals=np.zeros((2, 0, 3), np.float32))
    still = moved(scene, device)
    found = moved(replace(scene, moving=(moving,), shutter=(1.0,)), device).moving[0]
    assert not np.allclose(still.corner_normals[own][:, 0], still.corner_normals[own][:, 1])
    for normals in found.normals:
        assert np.allclose(normals[found.corners], still.corner_normals[own], atol=1e-5)


def test_zero_normals_are_flat(device: Device) -> None:
    scene = ground(Displacement(Result(2), by_normal()))
    found = moved(replace(scene, corner_normals=np.zeros_like(scene.corner_normals)), device)
    slope = np.array((-1.0, 0.0, 1.0)) / np.sqrt(2.0)
    assert np.allclose(found.corner_normals[scene.surface == 0], slope, atol=1e-5)


def test_while_the_camera_moves_it_is_done_once(device: Device, monkeypatch: Any) -> None:
    keeps, runs = Kept(device), []
    monkeypatch.setattr(kept, "displaced", lambda *given: runs.append(1) or displaced(*given))
    scene = ground(Displacement(Result(2), by_normal()))
    backend = backend_of(Settings(), device)
    first = keeps.worked_out(scene, 24, backend)
    seen = replace(scene, camera=camera((0, -4, 4), (0, 0, 0)))
    second = keeps.worked_out(seen, 24, backend)
    assert runs == [1] and second.vertices is first.vertices and second.camera is seen.camera
    # Sizes in pixels depend on it.
    sizes = np.array([(40.0, 0.0), (0.0, 0.0)], np.float32)
    near = replace(scene, camera=camera((0, -1, 1), (0, 0, 0)), dicing=sizes)
    counts = [
        len(keeps.worked_out(x, 512, backend).triangles)
        for x in (replace(seen, dicing=sizes), near)
    ]
    assert runs == [1, 1, 1] and counts[0] < counts[1]
    keeps.release()


def test_files_keep_it(tmp_path: Path) -> None:
    flat = np.zeros(len(hills(8).triangles), bool)
    flat[3] = True
    for move in (
        Displacement(Result(2, "xyzw"), by_normal(), False, True),
        Displacement((0.0, 1.0, 2.0)),
    ):
        scene = ground(move, flat=flat)
        scene.save(tmp_path / "scene.npz")
        read = Scene.load(tmp_path / "scene.npz")
        assert read.materials == scene.materials and np.array_equal(read.flat, flat)


def test_what_is_wrong_is_named(device: Device) -> None:
    for move, what in (
        (Displacement(Result(7), by_normal()), "way"),
        (Displacement((0.0, float("nan"), 0.0)), "way"),
    ):
        with pytest.raises(SceneError, match=f"material 'moves': displacement: {what}"):
            ground(move).check()
    unknown = Displacement(Result(0), (Instruction("unheard of"),))
    with pytest.raises(SceneError, match="material 'moves'.*unheard of"):
        prepare(ground(unknown), Settings(**SIZE), device)
