# SPDX-License-Identifier: GPL-3.0-or-later
"""RendererProcess: a frame takes from the one before what has not changed, and shows none of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.photon.errors import SceneError
from addon.photon.process import Progress, RendererProcess
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
    scenes.append(replace(scenes[-1], lights=(replace(scene.lights[0], radius=0.5),)))
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
