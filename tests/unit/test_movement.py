# SPDX-License-Identifier: GPL-3.0-or-later
"""What moves while the shutter is open: an instant a pass, the same for photons and the eye."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from addon.photon.errors import SceneError
from addon.photon.eye.instants import instant
from addon.photon.film.film import merged
from addon.photon.film.picture import picture_of
from addon.photon.photons.kept import Kept
from addon.photon.prepare import prepare
from addon.photon.scene import Moving, Scene
from addon.photon.scene.snapshot import pack, same, unpack
from addon.photon.settings import Settings
from addon.photon.stage.movement import Movement, affine_between
from addon.streams import Device
from tests.measure import render
from tests.scenes import cornell, plain_material

WAYS = ["native", "fragment", "compute"]
CHOICES: dict[str, Any] = {"width": 24, "height": 24, "photons": 4000, "photon_bounces": 3}
SHUTTER = (0.2, 1.0, 0.6)


def turned(angle: float, *scale: float) -> Any:
    """About z, of what is scaled first."""
    c, s = np.cos(angle), np.sin(angle)
    matrix = np.eye(4)
    matrix[:3, :3] = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.diag(scale or (1, 1, 1))
    return matrix


def moved(matrix: Any, *by: float) -> Any:
    matrix = matrix.copy()
    matrix[:3, 3] = by
    return matrix


def run_of(scene: Scene, name: str) -> tuple[int, int]:
    """The vertices of a surface."""
    used = scene.triangles[scene.surface == scene.surfaces.index(name)]
    return int(used.min()), int(used.max()) + 1


def with_moving(scene: Scene) -> Scene:
    """The box turns and goes, the sphere, which is emissive, bends."""
    box, sphere = run_of(scene, "box"), run_of(scene, "sphere")
    middle = moved(turned(0.3), 3.0, 6.7, 0.0)
    ends = [moved(turned(-0.5), 1.5, 5.0, 2.0), middle, moved(turned(1.2), 5.0, 7.0, 0.2)]
    rows = scene.surface == scene.surfaces.index("sphere")
    normals = scene.corner_normals[rows].reshape(-1, 3)
    shape = scene.vertices[slice(*sphere)]
    offsets = [shape * s - shape + by for s, by in ((0.97, -1.0), (1.0, 0.0), (1.05, 1.0))]
    emissive = replace(plain_material("emissive"), emission=(1.0, 2.0, 3.0))
    material = np.where(rows, len(scene.materials), scene.material).astype(np.int32)
    return replace(
        scene,
        materials=(*scene.materials, emissive),
        material=material,
        moving=(
            Moving(box, np.array(ends), middle),
            Moving(
                sphere,
                offsets=np.array(offsets, np.float32),
                normals=np.array([normals] * 3),
                corners=np.arange(len(normals), dtype=np.int32).reshape(-1, 3),
            ),
        ),
        shutter=SHUTTER,
    )


SCENE = with_moving(cornell())


class TestBetween:
    def test_steps_are_kept(self) -> None:
        steps = np.array([turned(0.1, 1, 2, 3), moved(turned(1.0, 2, -1, 1), 1, 2, 3), turned(2.0)])
        for number, step in enumerate(steps):
            np.testing.assert_allclose(affine_between(steps, number / 2), step, atol=1e-12)

    @pytest.mark.parametrize("angle", [1e-7, 0.5, 3.0])
    def test_turns_evenly_and_goes_straight(self, angle: float) -> None:
        found = affine_between(
            np.array([turned(0.0), moved(turned(angle, 3, 3, 3), 4, 0, 0)]), 0.25
        )
        np.testing.assert_allclose(found, moved(turned(angle / 4, 1.5, 1.5, 1.5), 1, 0, 0))

    def test_what_is_flat_at_a_step_keeps_its_turn(self) -> None:
        found = affine_between(np.array([turned(0.7, 0, 0, 0), turned(0.7, 2, 2, 2)]), 0.5)
        np.testing.assert_allclose(found, turned(0.7, 1, 1, 1))

    def test_mirrored(self) -> None:
        found = affine_between(np.array([turned(0.0, -1, 1, 1), turned(1.0, -1, 1, 1)]), 0.5)
        np.testing.assert_allclose(found, turned(0.5, -1, 1, 1), atol=1e-12)


def test_box_holds_all_that_moves() -> None:
    movement = Movement(SCENE)
    low, high = movement.box()
    for time in np.linspace(0, 1, 31):
        vertices = movement.at(time).vertices
        for one in SCENE.moving:
            own = vertices[slice(*one.vertices)]
            assert (own >= low).all() and (own <= high).all()
    assert (high - low < 14).all()


def test_survives_files_and_pipes(tmp_path: Any) -> None:
    SCENE.save(tmp_path / "scene.npz")
    for other in (Scene.load(tmp_path / "scene.npz"), unpack(pack(SCENE))):
        assert same(SCENE.moving, other.moving) and same(SCENE.shutter, other.shutter)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"vertices": (0, 1 << 20)}, "the scene has"),
        ({"matrices": np.full((2, 4, 4), np.nan)}, "matrices"),
        ({"placed": np.zeros((4, 4))}, "no volume"),
        ({"offsets": np.zeros((2, 1, 3), np.float32)}, "offsets"),
    ],
)
def test_what_does_not_fit_is_refused(changes: dict[str, Any], text: str) -> None:
    moving = replace(SCENE.moving[0], **changes)
    with pytest.raises(SceneError, match=text):
        replace(SCENE, moving=(moving,)).check()
    with pytest.raises(SceneError, match="two ways"):
        replace(SCENE, moving=SCENE.moving[:1] * 2).check()


def alike(found: Any, wanted: Any, name: str) -> float:
    """The share of pixels that differ by rounding alone, which may draw another light."""
    return float(np.isclose(found[name], wanted[name], rtol=0.02, atol=0.02).mean())


@pytest.mark.thorough("compute")
@pytest.mark.parametrize("way", WAYS)
def test_a_pass_is_of_an_instant(device: Device, way: Any) -> None:
    """It is a picture of what stands still then, but for rounding of other scene units."""
    settings = {**CHOICES, "backend": way, "first_pass": 1, "radius": 0.5}
    time = instant(Settings(**settings), 1, SHUTTER)
    still, middle = Movement(SCENE).at(time), replace(SCENE, moving=())
    found, wanted, other = (render(device, x, **settings) for x in (SCENE, still, middle))
    for name in ("Direct", "Indirect", "Emission"):
        assert alike(found, wanted, name) > 0.95, name
        assert alike(found, other, name) < 0.945, name


@pytest.mark.thorough("fragment")
@pytest.mark.parametrize("way", WAYS)
def test_ranges_of_passes_are_merged_to_the_same(device: Device, way: Any) -> None:
    """With what pass 0 learns, and a renderer that has just rendered something else."""
    settings = Settings(**CHOICES, backend=way, passes=4)
    kept = Kept(device)
    parts = []
    for first, passes in ((0, 4), (0, 1), (1, 3)):
        renderer = prepare(SCENE, replace(settings, first_pass=first, passes=passes), device, kept)
        for _ in range(passes):
            renderer.render_pass()
        parts += [next(iter(renderer.film.strip_statistics()))]
        renderer.release()
    kept.release()
    whole, both = parts[0], merged(parts[1:])
    for name, image in picture_of(whole.means).items():
        np.testing.assert_allclose(picture_of(both.means)[name], image, rtol=1e-5, atol=1e-6)


def test_what_stands_still_takes_no_part(device: Device) -> None:
    """Of a scene in which what could move does not, but for rounding. By that a photon may just
    count, or not, as one does of seeds 0 and 1."""
    first, last = run_of(SCENE, "box")
    still = Moving((first, last), np.array([np.eye(4)] * 3))
    for seed in (2, 3):
        found, wanted = (
            render(device, replace(cornell(), moving=moving), **CHOICES, seed=seed)["Combined"]
            for moving in ((), (still,))
        )
        np.testing.assert_allclose(found, wanted, rtol=1e-4, atol=1e-4)
