# SPDX-License-Identifier: GPL-3.0-or-later
"""Light of several of a pass's paths is looked for together, and no bit of a picture changes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from addon.photon import memory
from addon.photon.backends.backend import backend_of
from addon.photon.eye import path as path_module
from addon.photon.eye.eye import Eye
from addon.photon.eye.path import Path, PathStreams, paths_together
from addon.photon.memory import Budget
from addon.photon.prepare import prepare
from addon.photon.scene import Medium, Scene
from addon.photon.settings import Settings
from addon.streams import Device, Stream, StreamError
from tests.measure import assert_same
from tests.physics.test_subsurface import scattering
from tests.scenes import cornell
from tests.unit.test_compaction import SETTINGS, hanging, pictures, shiny, veiled

OURS = replace(SETTINGS, backend="compute")


pytestmark = pytest.mark.usefixtures("resident")


def misty() -> Scene:
    """A room of fog with a mirror in it."""
    return replace(cornell(True), air=Medium((0.05,) * 3, (0.1,) * 3))


def waxen() -> Scene:
    """A room of what scatters light below its surface, with a mirror in it."""
    scene = cornell(True)
    return replace(scene, materials=(scattering(0.05), *scene.materials[1:]))


@pytest.mark.parametrize("scene", [shiny, veiled, hanging, misty, waxen])
@pytest.mark.thorough("hanging")
def test_no_bit_changes(
    device: Device, monkeypatch: pytest.MonkeyPatch, scene: Callable[[], Scene]
) -> None:
    follow, lengths = Eye.follow, []

    def noted(self: Eye, path: Path) -> list[Path]:
        paths = follow(self, path)
        lengths.append(len(paths))
        return paths

    monkeypatch.setattr(Eye, "follow", noted)
    found = {}
    for most in (1, 2, 4):
        monkeypatch.setattr(path_module, "MOST_TOGETHER", most)
        lengths.clear()
        found[most] = pictures(prepare(scene(), OURS, device))
        assert min(most, 2) <= max(lengths) <= most
    assert found[1]["Mirror"].max() > 0.0
    for most in (2, 4):
        assert_same(found[most], found[1])


def test_a_pass_that_failed_is_forgotten(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    look = Eye.look

    def failing(self: Eye, paths: list[Path], photons: Any) -> None:
        look(self, paths, photons)
        raise StreamError("in the middle of a pass")

    renderer = prepare(veiled(), OURS, device)
    with monkeypatch.context() as patched:
        patched.setattr(Eye, "look", failing)
        with pytest.raises(Exception, match="in the middle of a pass"):
            renderer.render_pass()
    after, expected = pictures(renderer), pictures(prepare(veiled(), OURS, device))
    assert_same(after, expected)


@pytest.mark.parametrize(
    ("scene", "settings"),
    [
        (veiled, {}),
        (shiny, {"photons": 0}),
        (shiny, {"boundary_correction": False}),
        (misty, {"caustics": False}),
    ],
)
def test_streams_that_hold_anything(
    device: Device,
    monkeypatch: pytest.MonkeyPatch,
    scene: Callable[[], Scene],
    settings: dict[str, Any],
) -> None:
    """As those that a GPU takes back, which were another render's: nothing of it is seen."""
    given = replace(OURS, **settings)
    expected = pictures(prepare(scene(), given, device))
    made = Stream.__init__

    def spoiled(stream: Stream, *arguments: Any) -> None:
        made(stream, *arguments)
        width, height = stream.size
        stream.upload(np.full((height, width, 4), np.nan, np.float32))

    monkeypatch.setattr(Stream, "__init__", spoiled)
    found = pictures(prepare(scene(), given, device))
    assert_same(found, expected)


def test_a_driver_without_room(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """For more places: there are fewer, and the picture is the same."""
    expected, of_size = pictures(prepare(shiny(), OURS, device)), PathStreams.of_size
    made: list[PathStreams] = []

    def refuse(streams: PathStreams, size: tuple[int, int]) -> PathStreams:
        if made:
            raise StreamError("no room")
        made.append(of_size(streams, size))
        return made[0]

    monkeypatch.setattr(PathStreams, "of_size", refuse)
    found = pictures(prepare(shiny(), OURS, device))
    assert made
    assert_same(found, expected)


def test_as_many_as_there_are_points_for() -> None:
    assert paths_together((512, 8 * 512)) == 2
    assert paths_together((1024, 1024)) == 4
    assert paths_together((1920, 1080)) == 2
    assert paths_together((4096, 4096)) == 1


@pytest.mark.parametrize("settings", [{}, {"photons": 0}, {"caustics": False}], ids=str)
@pytest.mark.parametrize("scene", [shiny, veiled, misty, waxen])
def test_textures_are_counted(
    device: Device, scene: Callable[[], Scene], settings: dict[str, Any]
) -> None:
    renderer = prepare(scene(), replace(OURS, **settings), device)
    budget = Budget(renderer.scene, renderer.settings, renderer.backend)
    places = renderer.eye._places.all
    counts = {len(at.ones) + 2 * len(at.pairs) + 2 for at in places}
    renderer.release()
    assert len(places) == budget.together
    assert counts == {budget.path_textures}


def test_where_memory_is_short(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """Fewer, and no render is refused for them."""
    monkeypatch.setattr(device, "is_software", False)
    monkeypatch.setattr(memory, "MOST_PARTS", 1)  # passes together would take of it, too
    settings = Settings(512, 512, photons=4096, backend="compute")
    backend = backend_of(settings, device)
    free: int | None = 1 << 40
    monkeypatch.setattr(device, "free_memory", lambda: free, raising=False)
    monkeypatch.setattr(memory, "free_host_memory", lambda: None)
    whole = Budget(shiny(), settings, backend)
    assert whole.together == 4
    alone = whole.needed() - 3 * 16 * whole.path_textures * 512 * 512
    counts = []
    for share in (1.05, 1.5, 2.0, 4.0, 8.0):
        free = int(share * alone)
        counts.append(Budget(shiny(), settings, backend).together)
    assert counts[0] == 1 and counts == sorted(counts) and counts[-1] == 4
    free = None
    assert 1 <= Budget(shiny(), settings, backend).together < 4
    assert Budget(cornell(), settings, backend).together == 1
