# SPDX-License-Identifier: GPL-3.0-or-later
"""Media on the host: their numbers, what a place is in, files, and what is refused."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from addon.photon.errors import SceneError
from addon.photon.scene import (
    ALL_RAYS,
    NO_MEDIUM,
    RAY_BITS,
    Lobe,
    Material,
    Medium,
    Scene,
    sun_light,
)
from addon.photon.scene.media import MOST_ANISOTROPY
from addon.photon.stage import media as stage_media
from addon.photon.stage.far import WITHIN
from addon.photon.stage.geometry import Frame, Mesh, frame_of
from addon.photon.stage.insides import below_backs
from addon.photon.stage.media import MOST_MEDIA, NUMBERS, Media, from_afar
from addon.streams.source import glsl_root
from tests.scenes import Builder, camera, plain_light, plain_material

WATER, MILK, SMOKE = (
    Medium((0.1, 0.2, 0.3)),
    Medium((0.0,) * 3, (2.0,) * 3, 0.5),
    Medium((1.0,) * 3),
)
VIEW = camera((0, 0, 9), (0, 0, 0))
UNIT = Frame(np.zeros(3), 1.0)


def holding(medium: Medium) -> Material:
    return Material("medium", (0.0,) * 3, (Lobe("transparent", (1.0,) * 3),), medium=medium)


def nested() -> Scene:
    """A box of water, a ball of milk that reaches out of it, and a tilted plate of the same water
    between -5 and -3."""
    built = Builder().box((-2, -2, -2), (2, 2, 2), 0).sphere((2, 0, 0), 1.0, 1)
    built.quad((-5, -5, -5), (5, -5, -5), (5, 5, -3), (-5, 5, -3), 2)
    return built.scene(VIEW, (), (holding(WATER), holding(MILK), holding(WATER)), air=SMOKE)


def around(scene: Scene, *places: tuple[float, ...], ray: str = "camera") -> list[set[int]]:
    """The numbers of what places are in."""
    frame = frame_of(scene)
    media = Media(scene, frame)
    found = media.around(frame.points(np.array(places)), Mesh.build(scene, frame), ray)
    numbers = np.stack([*(found.astype(int) % NUMBERS).T, *(found.astype(int) // NUMBERS).T], 1)
    return [{number for number in of_one if number} for of_one in numbers.tolist()]


def test_numbers_are_those_of_the_glsl() -> None:
    text = (glsl_root() / "lib" / "media.glsl").read_text()
    assert int(re.findall(r"const int MOST_MEDIA = (\d+);", text)[0]) == MOST_MEDIA
    assert float(re.findall(r"const float NUMBERS = ([\d.]+);", text)[0]) == NUMBERS
    voxels = (glsl_root() / "lib" / "voxels.glsl").read_text()
    assert float(re.findall(r"const float WITHIN = ([\d.]+);", voxels)[0]) == WITHIN
    assert NUMBERS**2 <= 1 << 24  # both of a float are exact


def test_what_places_are_in() -> None:
    """Air everywhere, what is open below its back alone and in its box, and what overlaps
    together."""
    places = (-1, 0, 0), (1.5, 0, 0), (2.5, 0, 0), (4, 0, 0)
    assert around(nested(), *places) == [{1, 2}, {1, 2, 3}, {1, 3}, {1}]
    assert around(nested(), (0, 0, -3.5), (0, 0, -4.5), (0, 0, -5.5)) == [{1}, {1, 4}, {1}]
    hidden = np.array([ALL_RAYS - RAY_BITS["camera"], ALL_RAYS, ALL_RAYS], np.uint8)
    hiding = replace(nested(), visible=hidden)
    assert around(hiding, (1.5, 0, 0)) == [{1, 3}]
    assert around(hiding, (1.5, 0, 0), ray="shadow") == [{1, 2, 3}]


def test_below_backs() -> None:
    """Of a closed ball its inside; of a box without a bottom what is under its top."""
    random = np.random.default_rng(3)
    ball = Builder().sphere((0.2, -0.1, 0.3), 1.0, 0).scene(VIEW, (), (holding(WATER),))
    places = random.uniform(-1.5, 1.5, (2000, 3))
    away = np.linalg.norm(places - (0.2, -0.1, 0.3), axis=1)
    clear = np.abs(away - 1.0) > 0.05  # it has faces
    found = below_backs(places, ball.vertices[ball.triangles])
    assert (found == (away < 1.0))[clear].all() and 0.1 < found.mean() < 0.3
    whole = Builder().box((-10, -10, 0), (10, 10, 10), 0).scene(VIEW, (), (holding(WATER),))
    corners = whole.vertices[whole.triangles]
    open_below = corners[~(corners[..., 2] == 0.0).all(axis=1)]
    assert len(open_below) == len(corners) - 2
    assert below_backs(
        np.array([[0, 0, 1.7], [0, 0, -1.0], [0, 0, 11], [11, 0, 1]]), open_below
    ).tolist() == [True, True, False, False]
    assert below_backs(np.array([[0, 0, 1.7], [0, 0, -1.0]]), corners).tolist() == [True, False]
    assert not below_backs(np.zeros((2, 3)), np.zeros((0, 3, 3))).any()


def test_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each surface's medium has its own; equal ones have one where there are too many, and where
    one surface has both."""
    media = Media(nested(), replace(UNIT, scale=2.0))
    assert media.count == 4 and media.air == 1 and media.of_materials.tolist() == [2, 3, 4]
    assert media.table["extinction"].tolist()[0] == pytest.approx([2.0] * 3)
    one = replace(nested(), surface=np.zeros_like(nested().surface))
    assert Media(one, UNIT).of_materials.tolist() == [2, 3, 2]
    monkeypatch.setattr(stage_media, "NUMBERS", 4)
    media = Media(nested(), UNIT)
    assert media.count == 3 and media.air == 1 and media.of_materials.tolist() == [2, 3, 2]


def test_light_from_afar() -> None:
    """Of what comes through air without end colours are left that air does not touch."""
    lamp, sun = (
        plain_light("lamp", "POINT", (0, 0, 1), (1.0,) * 3),
        sun_light("sun", (1.0,) * 3, (0.0, 0.0, -1.0)),
    )
    assert from_afar((lamp, sun), NO_MEDIUM) == (lamp, sun)
    assert from_afar((lamp, sun), SMOKE) == (lamp,)
    dyed = from_afar((lamp, sun), Medium((0.0, 0.1, 0.0), (0.0, 0.0, 0.1)))
    assert dyed == (lamp, replace(sun, power=(1.0, 0.0, 0.0)))


def test_files(tmp_path: Path) -> None:
    """They hold media; older ones held what absorbs alone."""
    scene, path = nested(), tmp_path / "scene.npz"
    glow = (1.0, 2.0, 0.5)
    glowing = [replace(x, medium=replace(x.medium, emission=glow)) for x in scene.materials]
    replace(scene, materials=tuple(glowing)).save(path)
    assert [x.medium.emission for x in Scene.load(path).materials] == [glow] * len(glowing)
    scene.save(path)
    loaded = Scene.load(path)
    assert (loaded.materials, loaded.air) == (scene.materials, scene.air)
    with np.load(path) as data:
        arrays = dict(data)
    header = json.loads(str(arrays["header"]))
    del header["air"]
    for material in header["materials"]:
        material["absorption"] = material.pop("medium")["absorption"]
    arrays["header"] = np.array(json.dumps(header))
    np.savez(path, **arrays)
    older = Scene.load(path)
    assert older.air == NO_MEDIUM
    assert [x.medium for x in older.materials] == [WATER, Medium((0.0,) * 3), WATER]


@pytest.mark.parametrize(
    ("medium", "match"),
    [
        (Medium((-0.1, 0.0, 0.0)), "absorption"),
        (Medium((0.0,) * 3, (0.0, np.nan, 0.0)), "scattering"),
        (Medium((0.0,) * 3, (1.0,) * 3, 1.0), f"anisotropy = 1.0 is outside .-{MOST_ANISOTROPY}"),
        (Medium((0.0,) * 3, (1.0,) * 3, np.nan), "anisotropy = nan"),
        (Medium(emission=(0.0, -1.0, 0.0)), "emission"),
    ],
)
def test_values_out_of_range(medium: Medium, match: str) -> None:
    grey = plain_material("grey", (0.5,) * 3)
    for scene, who in (
        (Scene(VIEW, materials=(replace(grey, medium=medium),)), "material 'grey': "),
        (Scene(VIEW, air=medium), "scene.air: "),
    ):
        with pytest.raises(SceneError, match=who + match):
            scene.check()


def test_too_many() -> None:
    materials = tuple(holding(Medium((1.0 + 0.01 * n,) * 3)) for n in range(NUMBERS))
    assert Media(Scene(VIEW, materials=materials[1:]), UNIT).count == NUMBERS - 1
    with pytest.raises(SceneError, match=f"{NUMBERS} different media, {NUMBERS - 1} are possible"):
        Media(Scene(VIEW, materials=materials), UNIT)
