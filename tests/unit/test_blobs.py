# SPDX-License-Identifier: GPL-3.0-or-later
"""Blobs: only what changed is written, nothing is left behind, and damage is found out."""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from addon.photon.errors import RenderError
from addon.photon.jobs import blobs
from addon.photon.jobs.blobs import BlobReader, BlobWriter, names_of
from addon.photon.scene import Scene
from addon.photon.scene.snapshot import pack, same, unpack
from tests.scenes import cornell

COUNT = 2000  # triangles; each of their arrays is a blob


def big(shift: float = 0.0, red: float = 0.5) -> Scene:
    """A fresh scene with arrays that do not fit into a header."""
    scene = cornell()
    rng = np.random.default_rng(1)
    return replace(
        scene,
        vertices=rng.random((COUNT, 3)) + shift,
        triangles=rng.integers(0, COUNT, (COUNT, 3), np.int32),
        corner_normals=rng.random((COUNT, 3, 3), np.float32),
        material=np.zeros(COUNT, np.int32),
        surface=np.ones(COUNT, np.int32),
        materials=(replace(scene.materials[0], diffuse=(red, 0.5, 0.5)), *scene.materials[1:]),
    )


class Pair:
    """A writer and a reader."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.writer, self.reader = BlobWriter(folder), BlobReader(folder)
        self._there: dict[str, int] = {}

    def send(self, scene: Scene, layer: str = "", layers: int = 1) -> list[int]:
        """Bring a scene over; the sizes [bytes] of the files that were written for it."""
        layout = self.writer.write(pack(scene), layer, layers)
        self.last = unpack(self.reader.read(layout))
        assert same(self.last, scene)
        before, self._there = self._there, {f.name: f.stat().st_ino for f in self.folder.iterdir()}
        new = [name for name, inode in self._there.items() if before.get(name) != inode]
        return sorted((self.folder / name).stat().st_size for name in new)


@pytest.fixture
def pair(tmp_path: Path) -> Pair:
    return Pair(tmp_path / "blobs")


def sizes(scene: Scene, *names: str) -> list[int]:
    """[bytes] of the header and of arrays of a scene."""
    header = pack(scene)[0].nbytes
    return sorted([header, *(getattr(scene, name).nbytes for name in names)])


ARRAYS = ("vertices", "triangles", "corner_normals", "material", "surface")


# What is sent.


def test_the_same_scene_is_sent_once(pair: Pair) -> None:
    assert pair.send(big()) == sizes(big(), *ARRAYS)
    assert pair.send(big()) == []


def test_moved_vertices_are_sent_alone(pair: Pair) -> None:
    pair.send(big())
    assert pair.send(big(shift=1.0)) == [big().vertices.nbytes]
    assert len(list(pair.folder.iterdir())) == 1 + len(ARRAYS)  # the old ones are gone


def test_a_changed_material_sends_no_array(pair: Pair) -> None:
    pair.send(big())
    again = big(red=0.25)
    assert pair.send(again) == sizes(again) and sizes(again)[0] < 10_000


def test_a_moved_camera_sends_no_array(pair: Pair) -> None:
    pair.send(big())
    scene = big()
    matrix = scene.camera.matrix.copy()
    matrix[0, 3] += 1.0
    moved = replace(scene, camera=replace(scene.camera, matrix=matrix))
    assert pair.send(moved) == sizes(moved)


def test_equal_arrays_are_sent_once(pair: Pair) -> None:
    scene = replace(big(), surface=big().material)
    assert pair.send(scene) == sizes(scene, *ARRAYS[:4])


def test_what_is_sent_twice_is_one_array(pair: Pair) -> None:
    """Nobody has to compare it."""
    pair.send(big())
    first = pair.last
    pair.send(big(shift=1.0))
    assert pair.last.corner_normals is first.corner_normals
    assert pair.last.vertices is not first.vertices


def test_layers_have_their_blobs_each(pair: Pair) -> None:
    """In the order in which a frame's view layers take turns."""
    for layer, scene in (("a", big()), ("b", big(shift=1.0))):
        assert pair.send(scene, layer, 2)
    for layer, scene in (("a", big()), ("b", big(shift=1.0))):
        assert pair.send(scene, layer, 2) == []
    pair.send(big(shift=2.0), "c", 2)  # a third: the layers are others
    assert len(list(pair.folder.iterdir())) == 1 + len(ARRAYS)


def test_a_new_folder_gets_all(pair: Pair, tmp_path: Path) -> None:
    pair.send(big())
    assert Pair(tmp_path / "other").send(big()) == sizes(big(), *ARRAYS)


# Names.


@pytest.mark.parametrize("place", [0, 1 << 18, (1 << 19) - 1])
def test_each_element_counts(place: int) -> None:
    array = np.zeros(1 << 19, np.float32)  # of two parts
    other = array.copy()
    other[place] = -0.0
    assert array.nbytes == 2 * blobs.PART
    one, two, three = names_of([array, other, array.copy()])
    assert one == three != two


def test_type_and_shape_count() -> None:
    array = np.zeros((30, 40), np.float32)
    names = names_of(
        [
            array,
            array.T,
            array.ravel(),
            array.view(np.int32),
            array.view(">f4"),
            array[:29],
            array[:0],
            array[:0].T,
        ]
    )
    assert len(set(names)) == len(names)


def test_order_in_memory_does_not_count() -> None:
    array = np.random.default_rng(2).random((30, 40))
    one, two, three = names_of([array, np.asfortranarray(array), array[:, ::-1][:, ::-1]])
    assert one == two == three


# Arrays that are read.


@pytest.mark.parametrize("mapped", [1, 1 << 40], ids=["mapped", "read"])
def test_arrays_outlive_their_files(
    pair: Pair, monkeypatch: pytest.MonkeyPatch, mapped: int
) -> None:
    monkeypatch.setattr(blobs, "MAPPED", mapped)
    pair.send(big())
    first = pair.last
    assert type(first.vertices) is np.ndarray and not first.vertices.flags.writeable
    maps = Path("/proc/self/maps")
    if maps.exists():
        assert (str(pair.folder) in maps.read_text()) == (mapped == 1)
    for _ in range(2):
        pair.send(big(shift=1.0))
    assert same(first, big())


@pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")
def test_many_scenes_leave_nothing(
    pair: Pair, monkeypatch: pytest.MonkeyPatch, thorough: bool
) -> None:
    """Neither files nor maps, descriptors or names."""
    monkeypatch.setattr(blobs, "MAPPED", 1)

    def held() -> tuple[int, ...]:
        gc.collect()
        maps = Path("/proc/self/maps").read_text().count(str(pair.folder))
        return len(os.listdir("/proc/self/fd")), maps, len(os.listdir(pair.folder))

    pair.send(big(), "b")
    first = held()
    for number in range(1000 if thorough else 150):
        pair.send(big(shift=number), "ab"[number % 2])
    assert held() == first and first[1:] == (len(ARRAYS), 1 + len(ARRAYS))  # the header is let go
    assert len(pair.writer._needed) == 1 and len(pair.reader._read) == len(ARRAYS)


# Damage.


def layout_of(pair: Pair, scene: Scene) -> Any:
    return pair.writer.write(pack(scene))


def refused(pair: Pair, layout: Sequence[Any]) -> None:
    with pytest.raises(RenderError, match="the scene came damaged: ") as raised:
        unpack(BlobReader(pair.folder).read(layout))
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("place", range(1 + len(ARRAYS)))
@pytest.mark.parametrize("size", [None, 0, 100])
def test_a_blob_that_is_gone_or_short(pair: Pair, place: int, size: int | None) -> None:
    """One error, and the next scene mends it."""
    layout = layout_of(pair, big())
    blob = pair.folder / layout[place][0]
    data = blob.read_bytes()
    blob.unlink()
    if size is not None:
        blob.write_bytes(data[:size])
    refused(pair, layout)
    assert len(pair.send(big())) == 1 + len(ARRAYS)
    assert blob.read_bytes() == data


@pytest.mark.parametrize(
    "entry",
    [
        [],
        ["name"],
        ["none", "<f8", [3]],
        ["none", "nonsense", [3]],
        ["none", "<f8", 3],
        [3, "<f8", [3]],
        None,
    ],
    ids=str,
)
def test_damaged_layout(pair: Pair, entry: Any) -> None:
    header, *rest = layout_of(pair, big())
    refused(pair, [header, entry, *rest[1:]])
    refused(pair, [])


def test_no_room(pair: Pair, monkeypatch: pytest.MonkeyPatch) -> None:
    """Half a file is none; afterwards only what is not there is written."""
    replace_file, replaced = os.replace, []

    def full(part: Any, path: Any) -> None:
        if len(replaced) == 3:
            raise OSError(28, "No space left on device")
        replaced.append(path)
        replace_file(part, path)

    with monkeypatch.context() as patch:
        patch.setattr(os, "replace", full)
        with pytest.raises(OSError, match="No space left"):
            layout_of(pair, big())
    assert sorted(pair.folder.iterdir()) == sorted(replaced)
    kept = {file: file.stat().st_ino for file in replaced}
    pair.send(big())
    assert {file: file.stat().st_ino for file in replaced} == kept
    assert len(list(pair.folder.iterdir())) == 1 + len(ARRAYS)


def test_a_part_that_a_crash_left_is_swept(pair: Pair) -> None:
    layout = layout_of(pair, big())
    left = pair.folder / (layout[1][0] + blobs.UNFINISHED)
    left.write_bytes(b"half")
    pair.send(big())
    assert not left.exists()
