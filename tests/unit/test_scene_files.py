# SPDX-License-Identifier: GPL-3.0-or-later
"""Scene: what is saved is loaded, and other files are refused."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from addon.photon.errors import SceneError
from addon.photon.scene import (
    LIT,
    MIRROR,
    SNAPSHOT_VERSION,
    Camera,
    Lens,
    Lobe,
    Material,
    Motion,
    Scene,
    world_light,
)
from addon.photon.scene.snapshot import same
from addon.photon.stage.kinds import check_kinds
from tests.scenes import cornell, plain_light, plain_material
from tests.unit.test_scene import ARRAYS


def awkward() -> Scene:
    """A scene with the values that text formats lose."""
    scene = cornell(True, lobe=True)
    third = 1.0 / 3.0
    vertices = scene.vertices.copy()
    vertices[0] = (np.nan, -0.0, 5e-324)
    return replace(
        scene,
        camera=Camera(
            "ORTHO",
            np.eye(4) * third,
            (-third, third, -0.1, 1e-300),
            1e-30,
            np.inf,
            lens=Lens(third, 1e300, 3, -third, 1e-300),
            motion=Motion(np.eye(4)[None] * third, (third, 1.0, 3.0), (0.0, third)),
        ),
        lights=(
            plain_light(
                'Lämpchen "1"\n', "SPOT", (third, -0.0, 1e300), (0.1, 0.2, 0.3), spot_blend=third
            ),
            plain_light("", "POINT", (0.0, 0.0, 0.0), (1e-9, 0.0, 0.0), radius=third),
            world_light("sky", (third, 0.0, 1e-20), ("camera",)),
        ),
        materials=(
            *scene.materials,
            plain_material("mirror", (0.0, 0.0, 0.0), (third, third, third), MIRROR),
            plain_material("lobe", specular=(third, 0.0, 0.0), exponent=12.345678901234567),
        ),
        vertices=vertices,
        surfaces=(*scene.surfaces, "床 \u0000 floor"),
    )


def test_what_is_saved_is_loaded_to_the_bit(tmp_path: Path) -> None:
    scene = awkward()
    scene.save(tmp_path / "scene.npz")
    again = Scene.load(tmp_path / "scene.npz")
    for field in fields(Scene):
        before, after = getattr(scene, field.name), getattr(again, field.name)
        if isinstance(before, np.ndarray):
            assert (before.dtype, before.shape) == (after.dtype, after.shape), field.name
            assert before.tobytes() == after.tobytes(), field.name
        elif field.name == "camera":
            assert before.matrix.tobytes() == after.matrix.tobytes()
            assert same(before, after)
        else:
            assert before == after, field.name
    assert again.camera.clip_end == np.inf and again.materials[-2].lobes[0].kind == "mirror"
    assert np.signbit(again.lights[0].position[1])
    again.save(tmp_path / "again.npz")
    third = Scene.load(tmp_path / "again.npz")
    assert third.vertices.tobytes() == scene.vertices.tobytes()


def as_version_1(header: dict[str, Any]) -> None:
    """What Photon Stream 0.1 wrote of a spotlight, a sphere and materials."""
    header.update(version=1)
    header["lights"] = [
        {
            "name": "spot",
            "kind": "SPOT",
            "position": [1.0, 2.0, 3.0],
            "power": [4.0, 5.0, 6.0],
            "direction": [0.0, 1.0, 0.0],
            "radius": 0.25,
            "spot_size": 1.2,
            "spot_blend": 0.3,
        },
        {
            "name": "bulb",
            "kind": "POINT",
            "position": [7.0, 8.0, 9.0],
            "power": [1.0, 1.0, 1.0],
            "direction": [0.0, 0.0, -1.0],
            "radius": 0.5,
            "spot_size": 0.8,
            "spot_blend": 0.15,
        },
    ]
    colours = {
        "white": ((0.7, 0.7, 0.7), (0.0, 0.0, 0.0), math.inf),
        "chrome": ((0.0, 0.0, 0.0), (0.9, 0.8, 0.7), math.inf),
        "gloss": ((0.2, 0.2, 0.2), (0.1, 0.2, 0.3), 12.5),
        "none": ((0.2, 0.2, 0.2), (0.0, 0.0, 0.0), 12.5),
    }
    header["materials"] = [
        {"name": name, "diffuse": diffuse, "specular": specular, "exponent": exponent}
        for name, (diffuse, specular, exponent) in colours.items()
    ]


def test_version_1_is_read_as_the_last(file: Path) -> None:
    edit(file, lambda _, header: as_version_1(header))
    scene = Scene.load(file)
    check_kinds(scene)
    lights = (
        plain_light(
            "spot", "SPOT", (1.0, 2.0, 3.0), (4.0, 5.0, 6.0), (0.0, 1.0, 0.0), 0.25, 1.2, 0.3
        ),
        plain_light("bulb", "POINT", (7.0, 8.0, 9.0), (1.0, 1.0, 1.0), radius=0.5),
    )
    unseen = tuple(replace(light, found_by=LIT) for light in lights)
    assert scene.lights == unseen
    assert scene.lights[0].parameters["outer"] == pytest.approx(1 - math.cos(0.6))
    assert scene.lights[0].parameters["inner"] == pytest.approx(0.7 * (1 - math.cos(0.6)))
    assert scene.materials == (
        Material("white", (0.7, 0.7, 0.7)),
        Material("chrome", (0.0, 0.0, 0.0), (Lobe("mirror", (0.9, 0.8, 0.7)),)),
        Material("gloss", (0.2, 0.2, 0.2), (Lobe("phong", (0.1, 0.2, 0.3), {"exponent": 12.5}),)),
        Material("none", (0.2, 0.2, 0.2)),
    )
    scene.save(file)
    again = Scene.load(file)
    assert again.lights == scene.lights and again.materials == scene.materials
    with np.load(file) as data:
        assert json.loads(str(data["header"]))["version"] == SNAPSHOT_VERSION


def test_a_background_becomes_a_world(file: Path) -> None:
    """Before version 3 a scene had one radiance behind all."""
    edit(file, lambda _, header: header.update(version=2, background=[0.5, 0.25, 0.0]))
    assert Scene.load(file).lights[-1] == world_light("World", (0.5, 0.25, 0.0))
    edit(file, lambda _, header: header.update(version=2, background=[0.0, 0.0, 0.0]))
    assert "world" not in {light.kind for light in Scene.load(file).lights}


@pytest.mark.parametrize("found", [["diffuse"], ["glossy", "chains"], ["camera", "passing"]])
def test_before_media_were_told_apart(file: Path, found: list[str]) -> None:
    """Until version 6 they found what some surface finds that reflects."""

    def change(_: dict[str, Any], header: dict[str, Any]) -> None:
        header.update(version=6)
        header["lights"][0]["found_by"] = found

    edit(file, change)
    more = {"media"} if found[0] != "camera" else set()
    assert {*Scene.load(file).lights[0].found_by} == {*found} | more


@pytest.mark.parametrize("version", [3, 5])
def test_before_what_lets_through_was_told_apart(file: Path, version: int) -> None:
    """Until version 5 rays through glass found what reflected ones did."""

    def change(_: dict[str, Any], header: dict[str, Any]) -> None:
        header.update(version=version)
        header["lights"][0]["found_by"] = ["glossy", "chains"]

    edit(file, change)
    found = {"glossy", "transmission", "media", "chains", "passing"}
    assert {*Scene.load(file).lights[0].found_by} == found


def test_a_bad_value_of_version_1(file: Path) -> None:
    def change(_: Any, header: dict[str, Any]) -> None:
        as_version_1(header)
        header["lights"][0]["spot_blend"] = 5.0

    edit(file, change)
    refused(file, "light 'spot': spot blend 5.0 is outside")


def test_emission_is_saved(file: Path) -> None:
    """Materials that older files hold emit nothing."""
    scene = cornell()
    first, *others = scene.materials
    replace(scene, materials=(replace(first, emission=(1.0, 2.0, 0.1)), *others)).save(file)
    assert Scene.load(file).materials[0].emission == (1.0, 2.0, 0.1)
    edit(file, lambda _, header: [material.pop("emission") for material in header["materials"]])
    assert Scene.load(file).materials == scene.materials


def test_lobes_are_saved(file: Path) -> None:
    """All that one has."""
    lobe = Lobe("phong", (0.1, 0.2, 0.3), {"exponent": 3.0}, 0.5, (0.4, 0.3, 0.2))
    scene = Scene.load(file)
    material = Material("layered", (0.1, 0.0, 0.0), (lobe, Lobe("mirror", (1.0, 1.0, 1.0))))
    replace(scene, materials=(material, *scene.materials[1:])).save(file)
    assert Scene.load(file).materials[0] == material


def test_a_name_without_npz_is_kept(tmp_path: Path) -> None:
    cornell().save(tmp_path / "scene")
    assert [file.name for file in tmp_path.iterdir()] == ["scene"]
    Scene.load(str(tmp_path / "scene")).check()


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """A good snapshot."""
    cornell().save(tmp_path / "scene.npz")
    return tmp_path / "scene.npz"


def refused(file: Path, why: str = "") -> None:
    """Loading names the file."""
    with pytest.raises(SceneError, match=rf"{file.name}: .*{why}"):
        Scene.load(file)


@pytest.mark.filterwarnings("ignore::ResourceWarning")
def test_a_refused_file_is_closed(file: Path) -> None:
    """Else Windows would not let the user replace it."""
    if not Path("/proc/self/fd").is_dir():
        pytest.skip("no /proc")
    file.write_bytes(file.read_bytes()[:5000])
    with pytest.raises(SceneError) as raised:
        Scene.load(file)
    links = [os.readlink(link) for link in Path("/proc/self/fd").iterdir() if link.exists()]
    assert raised.value and str(file) not in links


def test_missing_file(tmp_path: Path) -> None:
    refused(tmp_path / "none.npz", "no such file")


def test_folder(tmp_path: Path) -> None:
    refused(tmp_path, "not a Photon Stream scene snapshot")


LEFT_OPEN = pytest.mark.filterwarnings("ignore::ResourceWarning")  # test_a_refused_file_is_closed


@LEFT_OPEN
@pytest.mark.parametrize("text", ["hello\n", "PK\x03\x04", "{}", "\x93NUMPY"])
def test_other_files(file: Path, text: str) -> None:
    file.write_text(text, encoding="latin-1")
    refused(file, "not a Photon Stream scene snapshot")


@LEFT_OPEN
def test_empty_file(file: Path) -> None:
    file.write_bytes(b"")
    refused(file, "not a Photon Stream scene snapshot")


@LEFT_OPEN
@pytest.mark.parametrize("share", [0.0001, 0.1, 0.5, 0.9, 0.999])
def test_truncated(file: Path, share: float) -> None:
    data = file.read_bytes()
    file.write_bytes(data[: max(1, int(len(data) * share))])
    refused(file, "not a Photon Stream scene snapshot")


def test_flipped_bit(file: Path) -> None:
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 1
    file.write_bytes(bytes(data))
    refused(file, "not a Photon Stream scene snapshot")


def edit(file: Path, change: Callable[[dict[str, Any], dict[str, Any]], None]) -> None:
    """Rewrite a snapshot with its arrays and header changed."""
    with np.load(file) as data:
        arrays = dict(data)
    header = json.loads(str(arrays.pop("header")))
    change(arrays, header)
    np.savez(file, header=np.array(json.dumps(header)), **arrays)


@pytest.mark.parametrize("version", [0, SNAPSHOT_VERSION + 1, "1", None])
def test_other_version(file: Path, version: Any) -> None:
    edit(file, lambda _, header: header.update(version=version))
    refused(file, rf"snapshot version {version}, this Photon Stream reads 1, 2, 3, 4")


@pytest.mark.parametrize("name", [*ARRAYS, "header"])
def test_missing_array(file: Path, name: str) -> None:
    with np.load(file) as data:
        arrays = {key: value for key, value in data.items() if key != name}
    np.savez(file, **arrays)
    refused(file, name)


@pytest.mark.parametrize("name", ["version", "camera", "lights", "materials", "surfaces"])
def test_missing_entry(file: Path, name: str) -> None:
    edit(file, lambda _, header: header.pop(name))
    refused(file, name)


def test_unknown_entry(file: Path) -> None:
    edit(file, lambda _, header: header["lights"][0].update(colour=(1, 1, 1)))
    refused(file, "colour")


def test_pickled_array(file: Path) -> None:
    """Nobody's code runs when a snapshot is loaded."""
    edit(file, lambda arrays, _: arrays.update(vertices=np.array([{}], object)))
    refused(file, "allow_pickle")


@pytest.mark.parametrize(
    "change",
    [
        pytest.param(lambda a, h: a.update(vertices=np.array(3.0)), id="number for an array"),
        pytest.param(lambda a, h: h.update(lights=[5]), id="number for a light"),
        pytest.param(lambda a, h: h["camera"].update(window=[0, 1, 2]), id="three edges"),
        pytest.param(lambda a, h: h["camera"].update(window=["a"] * 4), id="text for edges"),
        pytest.param(lambda a, h: h["camera"].update(matrix=[["a"] * 4] * 4), id="text matrix"),
    ],
)
def test_malformed_inside(file: Path, change: Callable[..., None]) -> None:
    edit(file, change)
    refused(file)


def test_bad_index_names_the_file(file: Path) -> None:
    edit(file, lambda arrays, _: arrays["triangles"].__setitem__((0, 0), -1))
    refused(file, r"triangles\[0, 0\] = -1")
