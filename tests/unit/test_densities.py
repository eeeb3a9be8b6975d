# SPDX-License-Identifier: GPL-3.0-or-later
"""Media that programs tell, on grids."""

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
from addon.photon.scene import BLACK, NO_MEDIUM, Instruction, Medium, Result, Scene
from addon.photon.scene.programs import Constant
from addon.photon.settings import Settings
from addon.photon.stage import densities
from addon.photon.stage.densities import filled
from addon.streams import Device
from tests.scenes import Builder, camera
from tests.unit.test_media import holding

VIEW = camera((0, 0, 9), (0, 0, 0))
NONE: Constant = (0.0, 0.0, 0.0, 0.0)


def told_by(*rows: Constant) -> Medium:
    """What it absorbs, by rows of a transform of places [m]."""
    program = Instruction("geometry", (NONE, NONE)), Instruction("matrix", (Result(0), *rows))
    return Medium(Result(1), BLACK, program=program)


HIGH = told_by(*[(0.0, 0.0, 1.0, 0.0)] * 3)
BOTH = Builder().box((0, 0, 0), (1, 2, 4), 0).box((9, 9, 0), (10, 10, 1), 0)


def boxes(medium: Medium) -> Scene:
    """Two objects of one material."""
    return BOTH.scene(VIEW, (), (holding(medium), holding(medium)))


def by(device: Device, scene: Scene) -> Scene:
    return filled(scene, backend_of(Settings(backend="fragment"), device), None)


def test_each_surface_has_its_own(device: Device) -> None:
    """A grid about each object, as fine as it must be."""
    made = by(device, boxes(HIGH))
    assert [x.medium.varies for x in made.materials] == [True, False, True]
    assert sorted(set(made.material.tolist())) == [0, 2]
    first, second = (made.materials[x].medium for x in (0, 2))
    assert first.grid and first.grid.extinction.shape == (2, 2, 2, 3)
    assert first.grid.high.tolist() == pytest.approx([1.0, 2.0, 4.0])
    assert first.grid.extinction[:, 0, 0, 0].tolist() == pytest.approx([0.0, 4.0])
    assert first.absorption == pytest.approx((2.0,) * 3)
    assert second.absorption == pytest.approx((0.5,) * 3)


def test_what_bends_takes_more_places(device: Device) -> None:
    """Along the axis on which it does: here in a corner, where it begins."""
    bent = replace(
        HIGH,
        absorption=Result(2),
        program=(
            *HIGH.program,
            Instruction("arithmetic", (Result(1), (0.9,) * 4, NONE, (1.0, 0.0, 0.0, 0.0))),
        ),
    )
    medium = by(device, boxes(bent)).materials[0].medium
    assert medium.grid
    z, y, x, _ = medium.grid.extinction.shape
    assert (y, x) == (2, 2) and 8 < z <= densities.MOST_CELLS + 1


def test_what_is_no_number_is_nothing(device: Device) -> None:
    """Nor is less than nothing."""
    below = told_by((0.0, 0.0, -1.0, 0.0), NONE, NONE)
    assert by(device, boxes(below)).materials[0].medium.grid is None
    assert not by(device, boxes(below)).materials[0].medium.is_there


def test_what_nothing_wears(device: Device) -> None:
    scene = BOTH.scene(VIEW, (), (holding(NO_MEDIUM), holding(HIGH)))
    assert by(device, scene).materials[1].medium == NO_MEDIUM


def test_many_are_coarse(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """All together have so many places at most: the largest less than before."""
    monkeypatch.setattr(densities, "MOST_VOXELS", 3 * 500)
    monkeypatch.setattr(densities, "SAME", 0.0)
    grids = [x.medium.grid for x in by(device, boxes(HIGH)).materials]
    counts = [grid.extinction.size // 3 for grid in grids if grid]
    assert len(counts) == 2 and 100 < sum(counts) <= 500


def test_one_alone_is_fine(device: Device) -> None:
    """A cube has as many places along its sides as there are."""
    made = by(device, boxes(HIGH)).materials[0].medium.grid
    whole = (densities.MOST_CELLS + 1,) * 3
    alone = densities._Box(HIGH, 0, np.zeros(3), np.ones(3), np.zeros((1, 4), np.float32))
    assert made and densities._affordable({0: alone})[0].counts == whole


def test_what_is_everywhere(device: Device) -> None:
    """About all that is there, with the camera."""
    made = by(device, replace(BOTH.scene(VIEW, (), (holding(NO_MEDIUM),)), air=HIGH))
    assert made.air.grid and made.air.grid.high[2] > 9.0 and made.air.grid.low[0] < 0.0
    beyond = made.air.grid.beyond
    assert beyond and beyond.extinction[-1, 24, 24, 0] == pytest.approx(1e4, rel=0.03)


def test_what_is_far_has_the_mean(device: Device) -> None:
    """Of what differs more finely than places are apart."""
    waves = replace(
        HIGH,
        absorption=Result(2),
        program=(
            HIGH.program[0],
            Instruction("matrix", (Result(0), *[(0.7, 0.3, 0.5, 0.0)] * 3)),
            Instruction("functions", (Result(1), NONE, (5.0, 0.0, 0.0, 0.0))),
        ),
    )
    made = by(device, replace(BOTH.scene(VIEW, (), (holding(NO_MEDIUM),)), air=waves))
    assert made.air.grid and made.air.grid.beyond
    far = made.air.grid.beyond.extinction[..., 0]
    assert far.mean() == pytest.approx(1.0 / np.pi, rel=0.1)  # of what is above 0 of a sine
    assert far[:5].std() < 0.15


@pytest.mark.parametrize("places", [0.0, np.nan])
def test_what_has_no_size(device: Device, places: float) -> None:
    """It has no medium; where there is nothing at all what is everywhere is."""
    both = boxes(HIGH)
    scene = replace(both, vertices=np.full_like(both.vertices, places))
    made = by(device, replace(scene, air=told_by(*[(0.0, 0.0, 0.0, 0.5)] * 3)))
    assert not any(x.medium.is_there for x in made.materials)
    assert made.air.absorption == pytest.approx((0.5,) * 3)


def test_what_is_flat(device: Device) -> None:
    """It has no inside, however it is turned."""
    tilted = Builder().quad((0, 0, 0), (1, 0, 1), (1, 1, 2), (0, 1, 1), 0)
    made = by(device, tilted.scene(VIEW, (), (holding(HIGH),)))
    assert made.materials[0].medium == NO_MEDIUM


def test_too_many_share_the_mean(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the first; such as are the same all through stay one."""
    monkeypatch.setattr(densities, "MOST_OWN", 1)
    made = by(device, boxes(HIGH))
    first, _, second = (x.medium for x in made.materials)
    assert first.grid and not second.grid and second.absorption == first.absorption
    flat = Builder().quad((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), 0)
    both = flat.box((0, 0, 0), (1, 2, 4), 0).scene(VIEW, (), (holding(HIGH),))
    monkeypatch.setattr(densities, "MOST_OWN", 2)
    three = replace(
        both,
        vertices=np.concatenate([both.vertices, both.vertices + 9.0]),
        triangles=np.concatenate([both.triangles, both.triangles + len(both.vertices)]),
        corner_normals=np.concatenate([both.corner_normals] * 2),
        material=np.concatenate([both.material] * 2),
        surface=np.concatenate([both.surface, both.surface + len(both.surfaces)]),
        surfaces=both.surfaces * 2,
    )
    assert [x.medium.is_there for x in by(device, three).materials] == [False, True, True]
    monkeypatch.setattr(densities, "MOST_OWN", 1)
    even = boxes(Medium((1.0,) * 3))
    assert by(device, even).material.tolist() == even.material.tolist()


def test_each_thing_has_a_material(device: Device) -> None:
    """That has a medium, so that rays tell things apart."""
    made = by(device, boxes(Medium((1.0,) * 3)))
    assert sorted(set(made.material.tolist())) == [0, 2]
    assert made.materials[2] == made.materials[0]


def test_they_are_kept(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of one scene, whatever the camera does, but leave where it was asked what is everywhere."""
    runs: list[int] = []
    monkeypatch.setattr(kept, "filled", lambda *given: runs.append(1) or filled(*given))
    keeps, backend = Kept(device, budget=0), backend_of(Settings(backend="fragment"), device)
    moved, away = camera((0, 1, 9), (0, 0, 0)), camera((0, 1, 30), (0, 0, 0))
    foggy = replace(BOTH.scene(VIEW, (), (holding(NO_MEDIUM),)), air=HIGH)
    for scene, expected in ((boxes(HIGH), [1, 1, 1, 1]), (foggy, [1, 1, 1, 2])):
        runs.clear()
        counts = []
        for one in (scene, scene, *(replace(scene, camera=x) for x in (moved, away))):
            keeps.worked_out(one, 24, backend)
            counts.append(len(runs))
        assert counts == expected
    keeps.release()


def test_files(tmp_path: Path) -> None:
    scene = replace(boxes(HIGH), air=HIGH)
    scene.save(tmp_path / "scene.npz")
    loaded = Scene.load(tmp_path / "scene.npz")
    assert (loaded.materials, loaded.air) == (scene.materials, scene.air)


@pytest.mark.parametrize(
    ("medium", "match"),
    [
        (replace(HIGH, absorption=Result(7)), "absorption: xyzw of instruction 7"),
        (replace(HIGH, program=(Instruction("geometry", (NONE, (np.nan,) * 4)),)), "geometry"),
    ],
)
def test_programs_that_are_wrong(medium: Any, match: str) -> None:
    for scene, who in (
        (boxes(medium), "material 'medium': "),
        (replace(boxes(NO_MEDIUM), air=medium), "scene.air: "),
    ):
        with pytest.raises(SceneError, match=who + ".*" + match):
            scene.check()
