# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line renders, and fails without leaving a picture."""

from __future__ import annotations

import os
import pty
import re
import select
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path
from typing import Any

import bpy
import pytest

import addon
from addon.blender import command
from addon.blender.export.camera import frame_size
from addon.photon.scene import Scene

from .build import add_light, add_mesh, unknown_lens

pytestmark = pytest.mark.blender

COMMAND = Path(command.__file__)
QUICK = ("--width", "16", "--height", "8", "--passes", "1", "--photons", "256")


@pytest.fixture
def blend(scene, tmp_path) -> Path:
    """A saved scene; after the test the add-on, which the command takes away, is back."""
    add_mesh("Floor")
    add_light("Spot", "SPOT", location=(0, 0, 5))
    path = tmp_path / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    yield path
    if not hasattr(bpy.types.Scene, "photon_stream"):
        addon.register()


def leftovers(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()} - {"scene.blend"}


@pytest.mark.parametrize(
    ("suffix", "size"), [("png", (16, 8)), ("exr", (16, 8)), ("png", (1, 1)), ("png", (401, 3))]
)
def test_writes_a_picture(blend, tmp_path, capsys, suffix, size) -> None:
    output = tmp_path / f"out.{suffix}"
    sides = ["--width", str(size[0]), "--height", str(size[1])]
    assert command.main([str(blend), "-o", str(output), *QUICK, *sides]) == 0
    assert leftovers(tmp_path) == {output.name}
    image = bpy.data.images.load(str(output))
    if suffix == "png":
        assert tuple(image.size) == size
    said = capsys.readouterr().out
    assert f"Wrote {output}" in said and "Opening" in said and "Saving" in said


@pytest.mark.parametrize("suffix", ["png", "exr"])
def test_pixels_that_are_not_square(blend, scene, tmp_path, suffix) -> None:
    """bpy 5.0 fails to write an EXR of them by itself."""
    scene.render.pixel_aspect_y = 1.2
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    output = tmp_path / f"out.{suffix}"
    assert command.main([str(blend), "-o", str(output), *QUICK]) == 0
    assert output.exists()
    assert bpy.context.scene.render.pixel_aspect_y == pytest.approx(1.2)


def test_writes_a_snapshot(blend, tmp_path) -> None:
    output = tmp_path / "scene.npz"
    assert command.main([str(blend), "-o", str(output)]) == 0
    assert Scene.load(output).surfaces == ("Floor",)
    assert leftovers(tmp_path) == {"scene.npz"}


def test_writes_a_report(blend, tmp_path) -> None:
    report = tmp_path / "report.json"
    options = [str(blend), "-o", str(tmp_path / "out.png"), "--report", str(report), *QUICK]
    assert command.main(options) == 0
    assert '"entries"' in report.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["-o", "missing/out.png"], "cannot be written"),
        (["-o", "out.jpg"], "must end in"),
        (["-o", "out.png", "--report", "missing/report.json"], "cannot be written"),
        (["-o", "out.png", "--passes", "0"], "Passes = 0 is outside"),
        (["-o", "out.png", "--width", "0", "--height", "5"], "width = 0 is outside [1, 16384]"),
        (["-o", "out.png", "--width", "65536"], "width = 65536 is outside [1, 16384]"),
        (["-o", "out.png", "--height", "16384"], "width = 32768 is outside [1, 16384]"),
        (["-o", "out.png", "--radius", "-1"], "Radius = -1.0 is outside"),
        (["-o", "out.png", "--frame", "99999999"], "Current Frame = 99999999 is outside"),
        (["-o", "out.png", "--engine", "NONE"], "no such render engine"),
    ],
)
def test_bad_options_are_said_at_once(blend, tmp_path, monkeypatch, capsys, options, said) -> None:
    monkeypatch.chdir(tmp_path)
    assert command.main([str(blend), *options]) == 1
    assert said in capsys.readouterr().err
    assert leftovers(tmp_path) == set()


@pytest.mark.parametrize(
    ("content", "said"), [(b"no blend", "not a .blend file"), (None, "No such file")]
)
def test_bad_files_are_named(scene, blend, tmp_path, capsys, content, said) -> None:
    path = tmp_path / "scene.blend"
    path.unlink()
    if content:
        path.write_bytes(content)
    assert command.main([str(path), "-o", str(tmp_path / "out.png")]) == 1
    error = capsys.readouterr().err
    assert said in error and str(path) in error
    assert leftovers(tmp_path) == set()


def test_truncated_file_is_an_error(blend, tmp_path, capsys) -> None:
    blend.write_bytes(b"BLENDER-v500")
    assert command.main([str(blend), "-o", str(tmp_path / "out.png")]) == 1
    assert str(blend) in capsys.readouterr().err


@pytest.mark.stability(38)
@pytest.mark.parametrize("sequencer", [False, True])
def test_scene_without_camera(blend, scene, tmp_path, capfd, sequencer: bool) -> None:
    scene.camera = None
    if sequencer:
        scene.sequence_editor_create()  # an empty one shows no other scene
    assert failing(blend, tmp_path, capfd) == "Error: Scene 'Scene' has no camera"


def failing(blend: Path, tmp_path: Path, capfd) -> str:
    """The one line, on either stream, of a render of the open scene that fails."""
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    capfd.readouterr()
    assert command.main([str(blend), "-o", str(tmp_path / "out.png"), *QUICK]) == 1
    assert leftovers(tmp_path) <= {"scene.blend1"}
    lines = "".join(capfd.readouterr()).splitlines()
    (line,) = (line for line in lines if "Read blend" not in line and "approximated" not in line)
    return line


def test_errors_are_one_line(blend, scene, tmp_path, capfd, monkeypatch) -> None:
    """Blender's own error reporting would say each once more, or twice."""
    unknown_lens(scene.camera.data)
    assert failing(blend, tmp_path, capfd).startswith("Error: Camera 'Camera' is of type FISHEYE")
    bpy.context.scene.camera.data.type = "PERSP"  # of the file that was opened
    monkeypatch.setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/nonexistent")
    assert failing(blend, tmp_path, capfd).startswith("Error: no OpenGL 3.3 context")


def test_size_keeps_proportions(scene) -> None:
    scene.render.resolution_x, scene.render.resolution_y = 200, 100
    command.resize(scene.render, 50, None)
    assert (scene.render.resolution_x, scene.render.resolution_y) == (50, 25)
    command.resize(scene.render, None, 10)
    assert (scene.render.resolution_x, scene.render.resolution_y) == (20, 10)


@pytest.mark.parametrize(("width", "height"), [(1, 1), (4001, 3), (16384, 1), (4, 16384)])
def test_every_size_that_there_is(scene, width: int, height: int) -> None:
    """Blender's own least is four pixels."""
    command.resize(scene.render, width, height)
    assert frame_size(scene.render) == (width, height)


def test_default_output_is_named_after_the_file() -> None:
    assert command.parse(["folder/scene.blend"]).output == Path("scene.png")


def renderer_of(process: subprocess.Popen[Any]) -> tuple[int, Path]:
    """The process number of a command's renderer and the folder that they share."""
    children = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
    (pid,) = (int(child) for child in children)
    found = re.search(r"main\('(.*?)'", Path(f"/proc/{pid}/cmdline").read_text())
    assert found
    return pid, Path(found[1])


@pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")
@pytest.mark.parametrize(
    ("how", "code"), [("Ctrl-C", 130), ("hang-up", 129), ("closed terminal", 129)]
)
def test_interrupt_leaves_nothing(blend, tmp_path, how, code) -> None:
    """No picture, no renderer, no shared memory."""
    output = tmp_path / "out.png"
    arguments = [str(blend), "-o", str(output), "--passes", "1000000", "--width", "32"]
    terminal, end = pty.openpty()  # on a terminal there is a progress bar to wait for
    process = subprocess.Popen(
        [sys.executable, str(COMMAND), *arguments], preexec_fn=partial(os.login_tty, end)
    )
    os.close(end)
    try:
        said = b""
        deadline = time.monotonic() + 60.0
        while b"Pass " not in said:
            assert time.monotonic() < deadline and process.poll() is None, said
            if select.select([terminal], [], [], 1.0)[0]:
                said += os.read(terminal, 4096)
        assert b"[" in said and b"photons" in said
        renderer, shared = renderer_of(process)
        assert shared.exists()
        start = time.monotonic()
        if how == "closed terminal":
            os.close(terminal)
        else:
            process.send_signal(signal.SIGINT if how == "Ctrl-C" else signal.SIGHUP)
        assert process.wait(10) == code
        assert time.monotonic() - start < 2.0
    finally:
        process.kill()
        process.wait()
        if how != "closed terminal":
            os.close(terminal)
    assert leftovers(tmp_path) == set()
    while shared.exists() or Path(f"/proc/{renderer}").exists():
        assert time.monotonic() - start < 4.0
        time.sleep(0.02)
