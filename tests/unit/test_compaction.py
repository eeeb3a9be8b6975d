# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays that are alive move to smaller streams, and no bit of a picture changes."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from addon.photon.errors import DeviceError
from addon.photon.eye import compaction
from addon.photon.eye.compaction import Compaction
from addon.photon.eye.eye import Eye
from addon.photon.eye.path import Path
from addon.photon.photons.paths import halved
from addon.photon.prepare import prepare
from addon.photon.renderer import Renderer
from addon.photon.scene import Lobe, Material, Scene, phong, point_light
from addon.photon.settings import Settings
from addon.streams import Device, StreamError
from tests.measure import assert_same
from tests.scenes import Builder, camera, cornell

SETTINGS = Settings(
    40,
    24,
    photons=3000,
    passes=3,
    mirror_depth=6,
    illuminance=True,
    caustics=True,
    denoising_data=True,
    mist=(0.2, 3.0, 1.0),
)


def shiny() -> Scene:
    """A room in which few rays are sent on, in front of a sheet through which some go straight."""
    scene = cornell(True)
    walls = [
        replace(m, lobes=(*m.lobes, phong((0.05,) * 3), phong((0.1,) * 3, 9.0)))
        for m in scene.materials
    ]
    return replace(scene, materials=tuple(walls))


def veiled() -> Scene:
    """A room that shines a little, its lamp above three sheets."""
    colour = (0.4, 0.3, 0.2)
    sheet = Material("sheet", (0.2,) * 3, (Lobe("transparent", colour), phong((0.05,) * 3)))
    wall = Material("wall", (0.6,) * 3, (phong((0.05,) * 3), phong((0.1,) * 3, 9.0)))
    built = Builder().box((-1, -1, 0), (1, 1, 2), 0, "room")
    for z in (0.6, 0.9, 1.2):
        built.quad((-0.5, -0.5, z), (0.5, -0.5, z), (0.5, 0.5, z), (-0.5, 0.5, z), 1)
    lamp = point_light("lamp", (0.1, 0.2, 1.8), (20.0,) * 3, radius=0.1)
    return built.scene(camera((-0.9, -0.9, 1.5), (0.3, 0.3, 0.5), 70), (lamp,), (wall, sheet))


def hanging() -> Scene:
    """Sheets, and a mirror, through and in which a floor is seen, and beside it the background."""
    sheet = Material("sheet", (0.1,) * 3, (Lobe("transparent", (0.5, 0.4, 0.3)),))
    mirror = Material("mirror", (0.0,) * 3, (phong((0.9,) * 3),))
    floor = Material("floor", (0.6, 0.5, 0.4), (phong((0.05,) * 3, 9.0),))
    built = Builder().quad((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), 2, "floor")
    for y in (-0.2, 0.0, 0.2):
        built.quad((-0.6, y, 0.2), (0.1, y, 0.2), (0.1, y, 1.4), (-0.6, y, 1.4), 0)
    built.quad((0.3, 0.3, 0.1), (0.8, 0.0, 0.1), (0.8, 0.2, 0.8), (0.3, 0.5, 0.8), 1)
    lamp = point_light("lamp", (0.5, -1.0, 2.5), (20.0,) * 3, radius=0.1)
    return built.scene(
        camera((0.2, -3.0, 1.2), (0.1, 0.0, 0.5), 50), (lamp,), (sheet, mirror, floor)
    )


def pictures(renderer: Renderer) -> dict[str, Any]:
    for _ in range(renderer.settings.passes):
        renderer.render_pass()
    images = renderer.images()
    renderer.release()
    return images


# Each scene, and each backend.
@pytest.mark.thorough(
    *("shiny-False-compute", "shiny-False-fragment", "veiled-False-compute"),
    *("veiled-False-native", "hanging-True-native", "hanging-True-fragment"),
)
@pytest.mark.parametrize("backend", ["native", "fragment", "compute"])
@pytest.mark.parametrize(
    ("scene", "transparent"), [(shiny, False), (veiled, False), (hanging, True)]
)
def test_no_bit_changes(
    device: Device, monkeypatch: pytest.MonkeyPatch, scene: Any, transparent: bool, backend: Any
) -> None:
    if not device.is_software:
        pytest.skip("streams are not in the host's memory")
    monkeypatch.setattr(compaction, "NARROWEST", 8)
    settings = replace(SETTINGS, backend=backend, transparent=transparent)
    sizes: list[tuple[int, int]] = []
    compact = Compaction.compact

    def noted(self: Compaction, path: Path, alive: int) -> None:
        compact(self, path, alive)
        sizes.append(path.at.size)

    monkeypatch.setattr(Compaction, "compact", noted)
    moved = pictures(prepare(scene(), settings, device))
    assert any(width == 40 and rows < 24 for width, rows in sizes)
    assert (10, 3) in sizes
    monkeypatch.setattr(Compaction, "compact", lambda *_: None)
    stayed = pictures(prepare(scene(), settings, device))
    assert moved["Mirror"].max() > 0.0
    assert_same(moved, stayed)


def test_a_pass_that_failed_is_forgotten(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    if not device.is_software:
        pytest.skip("streams are not in the host's memory")
    scatter = Eye.scatter

    def failing(self: Eye, path: Path) -> Path | None:
        if path.pixels is not None:
            raise StreamError("after rays have moved, and are seen")
        return scatter(self, path)

    renderer = prepare(veiled(), SETTINGS, device)
    with monkeypatch.context() as patched:
        patched.setattr(Eye, "scatter", failing)
        with pytest.raises(DeviceError, match="after rays have moved"):
            renderer.render_pass()
    after, expected = pictures(renderer), pictures(prepare(veiled(), SETTINGS, device))
    assert_same(after, expected)


@pytest.mark.parametrize(
    ("size", "alive", "smaller"),
    [
        ((1024, 192), 98305, (1024, 192)),
        ((1024, 192), 98304, (1024, 96)),
        ((1024, 192), 1025, (1024, 3)),
        ((1024, 192), 3, (64, 3)),
        ((1024, 3), 769, (1024, 3)),
        ((1024, 3), 768, (256, 3)),
        ((1024, 33), 9216, (1024, 9)),  # by 17
        ((1024, 33), 5121, (1024, 9)),
        ((1024, 33), 5120, (1024, 5)),
        ((1024, 128), 1024, (1024, 1)),
        ((1024, 128), 257, (1024, 1)),
        ((1024, 128), 256, (256, 1)),
        ((1024, 2), 3, (64, 1)),
        ((40, 1), 1, (40, 1)),
        ((24, 8), 1, (24, 1)),
    ],
)
def test_halves(size: tuple[int, int], alive: int, smaller: tuple[int, int]) -> None:
    assert halved(size, alive, 32) == smaller
    assert halved(size, alive, size[0])[0] == size[0]
