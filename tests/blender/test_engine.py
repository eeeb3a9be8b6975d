# SPDX-License-Identifier: GPL-3.0-or-later
"""The render engine in Blender, with the real renderer behind it."""

from __future__ import annotations

import math
import os
import signal
import sys
import time
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np
import pytest

from addon.blender import engine
from addon.blender.export import Report, SpecularModel, snapshot
from addon.blender.session import SESSION
from addon.photon.jobs import console
from addon.photon.jobs.process import Progress, RendererProcess
from addon.photon.scene import Scene
from addon.photon.settings import Settings

from .build import CUBE, add_light, add_mesh, new_material, unknown_lens
from .render_passes import render_exr

pytestmark = pytest.mark.blender

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("model", SpecularModel)
def test_specular_model_reaches_the_renderer(room, monkeypatch, model) -> None:
    """What the scene chooses is what its rough Glossy BSDF becomes."""
    mirror = bpy.data.materials["Mirror"].node_tree.nodes["Glossy BSDF"]
    mirror.inputs["Roughness"].default_value = 0.5
    found = []

    def spy(*args: object) -> tuple[Scene, Report]:
        found.append(snapshot(*args))
        return found[-1]

    monkeypatch.setattr(engine, "snapshot", spy)
    room.photon_stream.specular_model = model.name
    bpy.ops.render.render()
    ((scene, _),) = found
    kinds = {lobe.kind for material in scene.materials for lobe in material.lobes}
    assert kinds == {"ggx" if model is SpecularModel.GGX else "phong"}
    assert SESSION.error == ""


def test_noise_threshold_ends_the_render(room, tmp_path) -> None:
    room.photon_stream.passes = 1000
    room.photon_stream.use_noise_threshold = True
    room.photon_stream.noise_threshold = 0.2
    error = render_exr(room, tmp_path / "a.exr")["Error"]
    assert 8 <= SESSION.info["passes"] < 1000 and 0 < SESSION.info["error"] <= 0.2
    assert error.shape == (32, 32, 1) and np.isfinite(error).all() and error.max() > 0
    passes = SESSION.info["passes"]
    bpy.ops.render.render()
    assert SESSION.info["passes"] == passes


def test_awkward_borders_fit(room) -> None:
    room.photon_stream.passes, room.photon_stream.photons = 1, 0
    room.photon_stream.use_photons = True
    random = np.random.default_rng(1)
    for _ in range(8):
        room.render.use_border = True
        room.render.resolution_x, room.render.resolution_y = random.integers(40, 90, 2).tolist()
        (x0, x1), (y0, y1) = np.sort(random.random((2, 2)) * 0.8, axis=1)
        room.render.border_min_x, room.render.border_max_x = x0, x1 + 0.2
        room.render.border_min_y, room.render.border_max_y = y0, y1 + 0.2
        bpy.ops.render.render()  # raises if a picture does not fit into Blender's
        assert SESSION.error == ""


def test_animation_keeps_the_renderer_warm(room, tmp_path) -> None:
    room.render.filepath = str(tmp_path / "frame_")
    room.frame_start, room.frame_end = 1, 2
    bpy.ops.render.render()
    pid = SESSION.renderer.pid
    bpy.ops.render.render(animation=True)
    assert SESSION.renderer.pid == pid
    assert len(list(tmp_path.iterdir())) == 2


def test_animation_traces_photons_for_what_changed(room, tmp_path) -> None:
    """The camera moves in all frames, in the last one the floor, too. In a hall with one lamp: else
    where photons start may depend on the view."""
    room.world = None
    hall = add_mesh("Hall", CUBE, location=(0, 0, 3), scale=(3.2,) * 3)
    hall.data.materials.append(bpy.data.materials["Grey"])
    room.photon_stream.photons = 100_000
    floor = bpy.data.objects["Floor"]
    room.camera.keyframe_insert("location", frame=1)
    room.camera.location.x = 1.0
    room.camera.keyframe_insert("location", frame=4)
    floor.keyframe_insert("location", frame=3)
    floor.location.z = -0.1
    floor.keyframe_insert("location", frame=4)
    seconds = []
    for frame in range(1, 5):
        room.frame_set(frame)
        warm = render_exr(room, tmp_path / "warm.exr")
        seconds.append(SESSION.info["seconds"]["photons"])
    first, *still, last = seconds
    print(f"photons took {seconds} s")
    assert max(still) < 0.1 * min(first, last)
    SESSION.close()
    fresh = render_exr(room, tmp_path / "fresh.exr")
    for name in fresh:
        np.testing.assert_array_equal(warm[name], fresh[name])


def test_cancel(room, monkeypatch) -> None:
    room.photon_stream.passes = 100000
    cancelled_at = []

    def cancel(progress: Progress) -> None:
        if progress.passes_done:
            cancelled_at.append(time.monotonic())
            SESSION.cancel.set()

    monkeypatch.setattr(SESSION, "listener", cancel)
    try:
        bpy.ops.render.render()
    finally:
        SESSION.cancel.clear()
    assert SESSION.cancelled and SESSION.error == ""
    assert time.monotonic() - cancelled_at[0] < 0.4  # 0.2 s, and what Blender does afterwards


def test_killed_renderer_is_an_error_and_the_next_render_works(room, monkeypatch, tmp_path) -> None:
    room.photon_stream.passes = 100000
    room.render.filepath = str(tmp_path / "picture.png")

    def kill(progress: Progress) -> None:
        if progress.passes_done and SESSION.renderer.pid:
            os.kill(SESSION.renderer.pid, signal.SIGKILL)

    monkeypatch.setattr(SESSION, "listener", kill)
    with pytest.raises(RuntimeError, match="renderer process ended"):
        bpy.ops.render.render(write_still=True)
    assert not list(tmp_path.iterdir())
    monkeypatch.setattr(SESSION, "listener", None)
    room.photon_stream.passes = 1
    bpy.ops.render.render(write_still=True)
    assert len(list(tmp_path.iterdir())) == 1


@pytest.mark.parametrize("where", ["snapshot", "settings_from", "write_images"])
def test_a_bug_is_an_error_and_no_picture(room, monkeypatch, tmp_path, where, caplog) -> None:
    def broken(*_: object) -> None:
        raise ValueError("seven")

    monkeypatch.setattr(engine, where, broken)
    room.render.filepath = str(tmp_path / "picture.png")
    with pytest.raises(RuntimeError, match="seven"):
        bpy.ops.render.render(write_still=True)
    assert not list(tmp_path.iterdir())
    assert "Traceback" in caplog.text


SHORT_OF_MEMORY = f"""#!/bin/sh
export PYTHONPATH={ROOT}
exec {sys.executable} -c "from addon.photon import memory
memory.free_host_memory = lambda: 1_000_000_000
$2"
"""


@pytest.mark.parametrize(
    ("size", "said"), [(4096, "1 GB are free.*lower the resolution"), (20000, "width = 20000 is")]
)
def test_blender_makes_no_room_for_what_is_refused(room, monkeypatch, tmp_path, size, said) -> None:
    """It would be killed where there is no memory for its own passes."""
    python = tmp_path / "python"
    python.write_text(SHORT_OF_MEMORY)
    python.chmod(0o755)
    began = []
    monkeypatch.setattr(engine.PhotonStreamEngine, "_begin", lambda *job: began.append(job))
    monkeypatch.setattr(SESSION, "_renderer", RendererProcess(str(python)))
    room.render.resolution_x = room.render.resolution_y = size
    try:
        with pytest.raises(RuntimeError, match=said):
            bpy.ops.render.render()
    finally:
        SESSION.close()
    assert not began


def test_memory_that_blender_takes(room) -> None:
    """Its passes, twice while they are rendered, of the border alone."""
    passes = engine.passes_of(room.view_layers[0])
    assert sum(len(entry.channels) for entry in passes) == 24
    settings = Settings(width=100, height=80)
    assert engine.blender_bytes(passes, settings) == 192 * 8000
    border = replace(settings, region=(10, 10, 20, 40))
    assert engine.blender_bytes(passes, border) == 192 * 300


def test_bad_scene_is_an_error(room) -> None:
    unknown_lens(room.camera.data)
    with pytest.raises(RuntimeError, match="POLYNOMIAL"):
        bpy.ops.render.render()


def test_persistent_data_forgets_the_last_frame(room) -> None:
    """Blender then keeps the engine: neither error nor report may outlive their frame."""
    room.render.use_persistent_data = True
    unknown_lens(room.camera.data)
    with pytest.raises(RuntimeError, match="POLYNOMIAL"):
        bpy.ops.render.render()
    room.camera.data.type = "PERSP"
    sun = add_light("Sun", "SUN")
    bpy.ops.render.render()
    assert SESSION.error == "" and SESSION.info["passes"] == 2
    assert any(entry.object == "Light 'Sun'" for entry in SESSION.reports["Scene"].entries)
    bpy.data.objects.remove(sun)
    bpy.ops.render.render()
    assert not any(entry.object == "Light 'Sun'" for entry in SESSION.reports["Scene"].entries)


def test_error_of_one_scene_among_several(monkeypatch) -> None:
    """Who looks at it afterwards finds it, whatever was rendered after it."""
    monkeypatch.setattr(SESSION, "quiet", True)
    monkeypatch.setattr(SESSION, "error", "seven")
    SESSION.begin()
    assert SESSION.error == "seven"


def test_one_error_is_one_line(room, capfd) -> None:
    """In the background; and the view layers that come after are spared."""
    room.view_layers.new("Second")
    unknown_lens(room.camera.data)
    with pytest.raises(RuntimeError) as raised:
        bpy.ops.render.render()
    assert str(raised.value).count("POLYNOMIAL") == 1
    said = capfd.readouterr()
    assert (said.out + said.err).count("POLYNOMIAL") == 1


def test_stereoscopy_is_refused(room) -> None:
    room.render.use_multiview = True
    with pytest.raises(RuntimeError, match="Stereoscopy"):
        bpy.ops.render.render()


def test_report_reaches_panel_and_file(room, tmp_path) -> None:
    sun = add_light("Sun", "SUN")
    sun.light_linking.blocker_collection = bpy.data.collections.new("Shadowing")
    path = tmp_path / "report.json"
    room.photon_stream.report_path = str(path)
    bpy.ops.render.render()
    report = SESSION.reports["Scene"]
    assert isinstance(report, Report)
    assert path.read_text(encoding="utf-8") == report.as_json()
    assert any(entry.object == "Light 'Sun'" for entry in report.of("ignored"))


def test_unwritable_report_is_an_error(room, tmp_path) -> None:
    room.photon_stream.report_path = str(tmp_path / "missing" / "report.json")
    with pytest.raises(RuntimeError, match="Report File"):
        bpy.ops.render.render()


@pytest.mark.parametrize(
    ("what", "said"), [("LIGHT", "the scene has no light"), ("MESH", "no triangles")]
)
def test_missing_things_are_a_word_not_an_error(room, what, said) -> None:
    for obj in list(room.objects):
        if obj.type == what:
            bpy.data.objects.remove(obj)
    if what == "LIGHT":  # the world is one
        room.world = None
    bpy.ops.render.render()
    report = SESSION.reports["Scene"]
    assert sum(said in warning for warning in report.warnings) == 1
    assert not any(entry.object == "Scene 'Scene'" for entry in report.entries)


def test_noisy_material_names_do_not_matter(room) -> None:
    new_material("Ünïcödé 'quoted'\n")
    bpy.ops.render.render()


def test_status_line() -> None:
    progress = Progress("Rendering", 3, 16, 786432, 1.0, 75.5)
    assert console.status_text(progress) == "Pass 3/16 | 786 k photons | Remaining 01:15.50"
    known = {"error": 0.0131, "noise": 0.0115, "bias": 0.00621}
    told = console.status_text(replace(progress, info=known))
    assert " photons | Error 1.3 % (noise 1.1 %, bias 0.62 %) | Remaining " in told
    unknown = dict.fromkeys(known, math.inf)
    assert console.status_text(replace(progress, info=unknown)) == console.status_text(progress)
    assert console.status_text(Progress("Starting", 0, 16, 0, 0.0, math.inf)) == "Starting"
    assert console.count_text(999) == "999"
    assert console.clock_text(3661.234) == "01:01:01.23"
