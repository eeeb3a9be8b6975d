# SPDX-License-Identifier: GPL-3.0-or-later
"""Textures of a scene: what is refused, what is kept and sent, and what memory they take."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from addon.photon import memory
from addon.photon.backends.backend import backend_of
from addon.photon.errors import SceneError
from addon.photon.memory import Budget
from addon.photon.photons.kept import Kept, same_but_view
from addon.photon.prepare import prepare
from addon.photon.scene import Instruction, Result, Scene, Texture
from addon.photon.scene.snapshot import INLINE, pack, unpack
from addon.photon.settings import Settings
from addon.photon.stage.find_needs import find_needs
from addon.photon.stage.textures import bytes_of
from addon.streams import Device
from tests.scenes import cornell

SOME = np.random.default_rng(1).integers(0, 255, (40, 32, 4), np.uint8)
HALF = SOME[..., :1].astype(np.float16)


def with_textures(*textures: Texture) -> Scene:
    return replace(cornell(), textures=textures)


@pytest.mark.parametrize(
    ("pixels", "message"),
    [
        (SOME.astype(np.int8), r"'odd': expected one of uint8.*got int8\[40, 32, 4\]"),
        (SOME[..., :3], r"'odd': expected \(height, width, 1 or 4\), got uint8\[40, 32, 3\]"),
        (SOME[0], r"'odd': expected .*got uint8\[32, 4\]"),
        (SOME[:0], r"'odd': expected .*got uint8\[0, 32, 4\]"),
        (np.zeros((1, 65536, 1), np.uint8), "at most 65535 texels a side"),
        (np.array([[[0.5], [np.nan]]], np.float16), "is not finite"),
        (np.full((2, 2, 1), -np.inf, np.float32), "is not finite"),
    ],
)
def test_textures_that_are_refused(pixels: Any, message: str) -> None:
    with pytest.raises(SceneError, match=message):
        with_textures(Texture("odd", pixels)).check()


def test_largest_numbers_are_finite() -> None:
    for dtype in (np.float16, np.float32):
        ends = np.array([np.finfo(dtype).max, np.finfo(dtype).min, -0.0], dtype)
        with_textures(Texture("ends", ends.reshape(3, 1, 1))).check()


def test_files_and_messages_hold_textures(tmp_path: Path) -> None:
    """Arrays go by their content, so an image is sent once."""
    assert min(SOME.nbytes, HALF.nbytes) > INLINE // 2
    scene = with_textures(Texture("one", SOME, is_srgb=True), Texture("two", HALF, tile=1012))
    scene.save(tmp_path / "scene.npz")
    for again in (Scene.load(tmp_path / "scene.npz"), unpack(pack(scene))):
        assert same_but_view(scene, again)
    assert any(array is SOME for array in pack(scene))
    changed = SOME.copy()
    changed[3, 4, 1] ^= 1
    one = replace(scene.textures[0], pixels=changed)
    assert not same_but_view(scene, replace(scene, textures=(one, scene.textures[1])))


def test_memory_is_told(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """Bytes stay bytes; where they do not fit, the error names the largest texture."""
    large = Texture("leaf", np.zeros((1024, 1024, 4), np.uint8))
    scene = with_textures(Texture("one", SOME), large)
    settings = Settings(8, 8, backend="fragment")
    budget = Budget(scene, settings, backend_of(settings, device))
    part = next(part for part in budget.parts() if part.name == "bytes of textures")
    assert part.count == part.size.device == bytes_of(scene.textures)
    exact = SOME.nbytes + large.pixels.nbytes
    assert exact <= part.count <= exact + 3 * 4 * 4096
    assert not any(
        p.name == part.name
        for p in Budget(cornell(), settings, backend_of(settings, device)).parts()
    )
    monkeypatch.setattr(memory, "free_host_memory", lambda: budget.needed() - part.count)
    if device.is_software:
        with pytest.raises(SceneError, match="texture limit .* 'leaf' with 1024x1024 texels"):
            Budget(scene, settings, backend_of(settings, device)).check()


def test_textures_stay_while_materials_change(device: Device) -> None:
    """On the device, whatever else does; other ones take their place."""
    settings = Settings(8, 8, backend="fragment")
    backend, kept = backend_of(settings, device), Kept(device)
    scene = with_textures(Texture("one", SOME))
    array = kept.device_scene(scene, backend).tables.textures["texels"]
    darker = tuple(replace(m, diffuse=(0.1, 0.1, 0.1)) for m in scene.materials)
    again = replace(scene, materials=darker, textures=(Texture("one", SOME.copy()),))
    assert kept.device_scene(again, backend).tables.textures["texels"] is array
    other = kept.device_scene(with_textures(Texture("one", SOME[::-1])), backend).tables.textures[
        "texels"
    ]
    assert other is not array
    data = np.frombuffer(other.read(), np.uint8)
    assert SOME[::-1].tobytes() in data.tobytes()
    assert "texels" not in kept.device_scene(cornell(), backend).tables.textures
    kept.release()


def reading(number: float, tiles: float = 0.0) -> Scene:
    """A scene of one texture, whose first material reads one of a number."""
    constants = [(0.0,) * 4, (0.0,) * 4, (number, tiles, 1.0, 0.0), (0.0,) * 4]
    program = (Instruction("image", tuple(constants)),)
    scene = with_textures(Texture("one", SOME))
    first, *rest = scene.materials
    own = replace(first, program=program, varying={"diffuse": Result(0)})
    return replace(scene, materials=(own, *rest))


@pytest.mark.parametrize(("number", "tiles"), [(1, 0), (-1, 0), (0, 2)])
def test_programs_read_what_is_there(device: Device, number: float, tiles: float) -> None:
    with pytest.raises(SceneError, match="instruction 0, image: texture -?1 is none of 1"):
        prepare(reading(number, tiles), Settings(8, 8), device)


def test_what_reads_no_texture_is_compiled_without(device: Device) -> None:
    settings = Settings(8, 8, backend="fragment")
    for scene, expected in ((reading(0), True), (with_textures(Texture("one", SOME)), False)):
        kept = Kept(device)
        device_scene = kept.device_scene(scene, backend_of(settings, device))
        tables = device_scene.tables
        needs = find_needs(scene, settings, device_scene.mesh, tables.emitters, tables.asked)
        assert ("TEXTURES" in needs.eye_defines) is expected
        kept.release()
