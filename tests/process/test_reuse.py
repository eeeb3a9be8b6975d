# SPDX-License-Identifier: GPL-3.0-or-later
"""RendererProcess: a frame takes from the one before what has not changed, and shows none of it."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from addon.photon.errors import RenderError, SceneError
from addon.photon.jobs.blobs import BLOBS, MAPPED, BlobWriter, Layout
from addon.photon.jobs.process import Progress, RendererProcess
from addon.photon.scene import Scene
from addon.photon.settings import Settings
from tests.scenes import cornell

SETTINGS = Settings(width=24, height=16, photons=100_000, passes=3)


def finish(
    process: RendererProcess,
    scene: Scene,
    settings: Settings = SETTINGS,
    layer: str = "",
    layers: int = 1,
) -> Progress:
    """Render to the end; the last event."""
    *_, last = process.render(scene, settings, previews=False, layer=layer, layers=layers)
    assert last.done and last.images is not None
    return last


def finish_alone(scene: Scene, frame: Progress) -> Progress:
    """The same in a process of its own, which has the frame's bytes."""
    process = RendererProcess()
    alone = finish(process, scene)
    process.close()
    assert frame.images and alone.images
    for name, image in alone.images.items():
        assert image.tobytes() == frame.images[name].tobytes(), name
    return alone


def test_camera_moves_then_light(process: RendererProcess) -> None:
    """Bytes of fresh processes; photons are traced in the first frame and under the new light."""
    scene = cornell(mirror=True)
    scenes = []
    for x in (4.0, 5.0, 6.0):
        matrix = scene.camera.matrix.copy()
        matrix[0, 3] = x
        scenes.append(replace(scene, camera=replace(scene.camera, matrix=matrix)))
    (light,) = scene.lights
    sphere = replace(light, parameters={**light.parameters, "radius": 0.5})
    scenes.append(replace(scenes[-1], lights=(sphere,)))
    seconds = []
    for view in scenes:
        frame = finish(process, view)
        fresh = finish_alone(view, frame)
        assert {**frame.info, "seconds": 0} == {**fresh.info, "seconds": 0}
        seconds.append((frame.info["seconds"]["photons"], fresh.info["seconds"]["photons"]))
    print("photons took, of each frame and of the same rendered alone: ", seconds)
    first, *still, lit = seconds
    assert all(frame < 0.1 * fresh for frame, fresh in still)
    assert all(frame > 0.1 * fresh for frame, fresh in (first, lit))


def test_deforming_animation(process: RendererProcess) -> None:
    """Bytes of fresh processes, whose trees are built for their frame."""
    scene = cornell(mirror=True)
    for frame in range(4):
        vertices = scene.vertices.copy()
        vertices[20:] += 0.2 * frame * np.sin(vertices[20:, ::-1])  # the walls stay
        moved = replace(scene, vertices=vertices)
        last = finish(process, moved)
        fresh = finish_alone(moved, last)
        assert {**last.info, "seconds": 0} == {**fresh.info, "seconds": 0}


def test_view_layers_keep_photons_each(process: RendererProcess) -> None:
    """Of two frames with two view layers that show different things; bytes of fresh processes."""
    views = {"with": cornell(mirror=True), "without": cornell()}
    seconds: dict[str, list[float]] = {layer: [] for layer in views}
    for _ in range(2):
        for layer, scene in views.items():
            frame = finish(process, scene, layer=layer, layers=2)
            fresh = finish_alone(scene, frame)
            seconds[layer].append(
                frame.info["seconds"]["photons"] / fresh.info["seconds"]["photons"]
            )
    print("photons took, over those of the same rendered alone: ", seconds)
    assert all(first > 0.1 > second for first, second in seconds.values())


def test_device_lost_between_frames(process: RendererProcess) -> None:
    """After an error nothing is taken from before: the renderer opens its device anew."""
    first = finish(process, cornell())
    scene = cornell()
    triangles = scene.triangles.copy()
    triangles[0, 0] = -1
    with pytest.raises(SceneError, match="is outside"):
        finish(process, replace(scene, triangles=triangles))
    pid = process.pid
    again = finish(process, cornell())
    assert process.pid == pid and again.info["seconds"]["photons"] > 0.01
    assert first.images and again.images
    assert np.array_equal(first.images["Combined"], again.images["Combined"])


def test_cancelled_render_leaves_its_passes(process: RendererProcess) -> None:
    """They are whole: the next render takes them and traces the rest."""
    events = process.render(cornell(), replace(SETTINGS, passes=1 << 20))
    for event in events:
        if event.passes_done >= 2:
            break
    events.close()
    finish_alone(cornell(), finish(process, cornell()))


# What goes to the renderer.

QUICK = replace(SETTINGS, photons=1000, passes=1)


def files(process: RendererProcess) -> dict[str, tuple[int, int]]:
    """What it was sent: of each blob, which file it is and its size [bytes]."""
    assert process._folder
    found = [(file.name, file.stat()) for file in (process._folder / BLOBS).iterdir()]
    return {name: (stat.st_ino, stat.st_size) for name, stat in found}


def pushed(by: float, times: int = 1) -> Scene:
    """A room elsewhere; with vertices so many times, of which no triangle uses the rest."""
    scene = cornell()
    return replace(scene, vertices=np.tile(scene.vertices + by, (times, 1)))


def test_only_what_changed_is_sent(process: RendererProcess) -> None:
    finish(process, cornell(), QUICK)
    first = files(process)
    assert len(first) == 6  # the header, and each array
    finish(process, cornell(), QUICK)
    assert files(process) == first
    finish(process, pushed(0.1), QUICK)
    moved = files(process)
    new = [size for name, (_, size) in moved.items() if name not in first]
    assert new == [cornell().vertices.nbytes] and len(moved) == len(first)


@pytest.mark.parametrize("between", [True, False], ids=["between renders", "mid-render"])
def test_a_restarted_renderer_gets_all(process: RendererProcess, between: bool) -> None:
    finish(process, cornell(), QUICK)
    first, folder = files(process), process._folder
    assert process.pid and folder
    if between:
        os.kill(process.pid, signal.SIGKILL)
        assert process._child
        process._child.wait()
    else:
        with pytest.raises(RenderError, match="ended by signal 9"):
            for event in process.render(cornell(), replace(QUICK, passes=1 << 20)):
                if event.passes_done and process.pid:
                    os.kill(process.pid, signal.SIGKILL)
    frame = finish(process, cornell(), QUICK)
    assert not folder.exists() and process._folder != folder
    assert files(process).keys() == first.keys()
    other = RendererProcess()
    alone = finish(other, cornell(), QUICK)
    other.close()
    assert frame.images and alone.images
    assert frame.images["Combined"].tobytes() == alone.images["Combined"].tobytes()


def cut(path: Path) -> None:
    with open(path, "r+b") as file:
        file.truncate(100)


@pytest.mark.parametrize("spoil", [Path.unlink, cut], ids=["gone", "cut"])
@pytest.mark.parametrize("place", [0, 1], ids=["header", "array"])
def test_damage_on_the_way(
    process: RendererProcess,
    monkeypatch: pytest.MonkeyPatch,
    spoil: Callable[[Path], None],
    place: int,
) -> None:
    """One clear error, and the next render sends what was spoilt again."""
    write = BlobWriter.write

    def spoilt(self: BlobWriter, *arguments: Any) -> Layout:
        layout = write(self, *arguments)
        spoil(self._folder / layout[place][0])
        return layout

    finish(process, cornell(), QUICK)
    pid = process.pid
    with monkeypatch.context() as patch:
        patch.setattr(BlobWriter, "write", spoilt)
        with pytest.raises(RenderError, match="^the scene came damaged: "):
            finish(process, pushed(0.1), QUICK)
    finish(process, pushed(0.1), QUICK)
    assert process.pid == pid


def test_no_room_for_the_scene(process: RendererProcess, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: Any) -> Iterable[Any]:
        raise OSError(28, "No space left on device")

    finish(process, cornell(), QUICK)
    pid, before = process.pid, files(process)
    with monkeypatch.context() as patch:
        patch.setattr(os, "replace", full)
        with pytest.raises(RenderError, match="cannot hand the scene to the renderer: .*No space"):
            finish(process, pushed(0.1), QUICK)
    assert files(process).keys() < before.keys()  # nothing new, nothing half
    finish(process, pushed(0.1), QUICK)
    assert process.pid == pid


def test_a_damaged_message(process: RendererProcess) -> None:
    finish(process, cornell(), QUICK)
    assert process._child and process._child.stdin
    process._child.stdin.write((5).to_bytes(8, "little") + b"{bad}")
    with pytest.raises(RenderError, match="ended with code 1: a message came damaged: "):
        finish(process, cornell(), QUICK)
    assert process.pid is None and process._folder is None
    finish(process, cornell(), QUICK)


@pytest.mark.skipif(not Path("/proc/self/fd").is_dir(), reason="looks into /proc")
def test_moving_vertices_leave_nothing(process: RendererProcess) -> None:
    """Files, maps and descriptors of the renderer after many renders are those of a few."""

    def held() -> tuple[int, ...]:
        assert process._folder and process.pid
        maps = Path(f"/proc/{process.pid}/maps").read_text().count(str(process._folder))
        return len(files(process)), maps, len(os.listdir(f"/proc/{process.pid}/fd"))

    counts, times = [], 1 + MAPPED // cornell().vertices.nbytes
    for frame in range(12):
        finish(process, pushed(0.01 * frame, times), QUICK)
        counts.append(held())
    print(f"(files, maps, descriptors): {counts}")
    assert counts[2:] == [counts[2]] * 10 and counts[2][1] > 0
