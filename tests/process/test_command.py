# SPDX-License-Identifier: GPL-3.0-or-later
"""`python -m addon.photon.jobs.command`: exit codes, and no picture but a finished one."""

from __future__ import annotations

import os
import pty
import re
import signal
import struct
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest

from addon.photon.film.error import DARK, relative_squares
from addon.photon.jobs.command import main
from addon.photon.jobs.stops import Stops
from addon.photon.scene import Scene
from tests.children import STOPS_WITHIN, child
from tests.scenes import Builder, cornell

ROOT = Path(__file__).parents[2]
QUICK = ("--width", "16", "--height", "12", "--photons", "500", "--passes", "2")


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    cornell().save(tmp_path / "scene.npz")
    return tmp_path / "scene.npz"


def command(*arguments: Any) -> list[str]:
    return [sys.executable, "-m", "addon.photon.jobs.command", *map(str, arguments)]


def call(*arguments: Any, **kwargs: Any) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        command(*arguments), cwd=ROOT, capture_output=True, text=True, timeout=60, **kwargs
    )


def png_size(path: Path) -> tuple[int, int]:
    return struct.unpack(">II", path.read_bytes()[16:24])  # type: ignore[return-value]


def read_exr(path: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """Pixels by channel, and the header."""
    with OpenEXR.File(str(path), separate_channels=True) as file:
        channels = {name: channel.pixels.copy() for name, channel in file.channels().items()}
        return channels, dict(file.header())


def files(folder: Path) -> list[str]:
    return sorted(file.name for file in folder.iterdir())


def test_png(scene: Path) -> None:
    picture = scene.with_name("out put.png")
    result = call(scene, "-o", picture, *QUICK)
    assert (result.returncode, result.stderr) == (0, "")
    assert f"wrote {picture} in " in result.stdout
    for phase in ("load", "device", "bvh", "programs", "photons", "eye", "save"):
        assert re.search(rf"{phase} \d+\.", result.stdout)
    assert png_size(picture) == (16, 12)
    assert files(scene.parent) == ["out put.png", "scene.npz"]


def test_exr(scene: Path) -> None:
    picture = scene.with_name("out.exr")
    assert call(scene, "-o", picture, "--seed", 3, *QUICK).returncode == 0
    channels, header = read_exr(picture)
    assert header["photon_stream.seed"] == "3" and header["photon_stream.passes"] == "2"
    combined, direct, indirect = (
        channels[f"ViewLayer.{name}.G"] for name in ("Combined", "Direct", "Indirect")
    )
    assert np.allclose(combined, direct + indirect) and indirect.mean() > 0


def test_noise_threshold(scene: Path) -> None:
    """The file, the console and the Error pass say the same."""
    picture = scene.with_name("out.exr")
    result = call(scene, "-o", picture, *QUICK, "--passes", 500, "--noise-threshold", 0.2)
    assert result.returncode == 0, result.stderr
    channels, header = read_exr(picture)
    names = ("passes", "photons", "error", "noise", "bias", "radius")
    found = {name: float(header[f"photon_stream.{name}"]) for name in names}
    assert 8 <= found["passes"] < 500 and found["photons"] == 500 * found["passes"]
    assert found["error"] == pytest.approx(np.hypot(found["noise"], found["bias"]))
    assert found["error"] <= 0.2 and found["radius"] > 0
    assert header["photon_stream.version"] and header["photon_stream.device"]
    assert f"{found['passes']:.0f} passes, Error {100 * found['error']:.2g} % (" in result.stdout
    combined = np.mean([channels[f"ViewLayer.Combined.{c}"] for c in "RGB"], axis=0)
    squares = relative_squares(channels["ViewLayer.Error.X"], combined, DARK * combined.mean())
    assert np.sqrt(np.mean(squares)) == pytest.approx(found["error"], rel=1e-3)


def test_picture_is_named_after_the_scene(scene: Path) -> None:
    environment = {"PYTHONPATH": str(ROOT)}
    result = subprocess.run(
        command("scene.npz", *QUICK), cwd=scene.parent, capture_output=True, env=environment
    )
    assert result.returncode == 0 and files(scene.parent) == ["scene.npz", "scene.png"]


@pytest.mark.stability(55)
@pytest.mark.parametrize(("width", "height"), [(1, 1), (4001, 3)])
def test_odd_sizes(scene: Path, width: int, height: int) -> None:
    picture = scene.with_name("out.exr")
    size = ("--width", width, "--height", height)
    assert call(scene, "-o", picture, *QUICK, *size).returncode == 0
    channels, _ = read_exr(picture)
    for name, pixels in channels.items():
        assert pixels.shape == (height, width)
        # Two passes cannot tell their error.
        assert np.isinf(pixels).all() if "Error" in name else np.isfinite(pixels).all()
    assert channels["ViewLayer.Direct.G"].mean() > 0


def bad(case: str, scene: Path) -> tuple[list[Any], str]:
    """Arguments, and what the error says."""
    picture = scene.with_name("out.png")
    match case:
        case "no scene":
            return [scene.with_name("none.npz"), "-o", picture], "none.npz: no such file"
        case "no snapshot":
            scene.write_text("something else")
            return [scene, "-o", picture], "scene.npz: not a Photon Stream scene snapshot"
        case "width":
            return [scene, "-o", picture, "--width", 0], "width = 0 is outside [1, 16384]"
        case "radius":
            return [scene, "-o", picture, "--radius", "nan"], "radius = nan is outside"
        case "suffix":
            return [scene, "-o", picture.with_suffix(".jpg")], "must end in .png or .exr"
        case "folder":
            return [scene, "-o", scene.parent / "none" / "a.png"], "no folder"
        case _:
            return [scene, "-o", "/proc/self/a.png"], "cannot be written"


@pytest.mark.parametrize(
    "case", ["no scene", "no snapshot", "width", "radius", "suffix", "folder", "unwritable"]
)
def test_one_clear_error(scene: Path, case: str) -> None:
    if case == "unwritable" and not Path("/proc/self").is_dir():
        pytest.skip("no /proc")
    arguments, text = bad(case, scene)
    result = call(*arguments)
    assert result.returncode == 1
    assert result.stderr.startswith("error: ") and result.stderr.count("\n") == 1
    assert text in result.stderr and result.stdout == ""
    assert files(scene.parent) == ["scene.npz"]


def test_the_last_picture_stays_when_a_render_fails(scene: Path) -> None:
    """A failed call touches nothing."""
    picture = scene.with_name("out.png")
    picture.write_text("the last picture")
    assert call(scene, "-o", picture, "--photons", -1).returncode == 1
    assert picture.read_text() == "the last picture"


def test_unknown_option(scene: Path) -> None:
    assert call(scene, "--estimator", "magic").returncode == 2
    assert files(scene.parent) == ["scene.npz"]


@pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")
def test_no_opengl(scene: Path) -> None:
    environment = {"__EGL_VENDOR_LIBRARY_FILENAMES": "/nonexistent"}
    result = call(scene, "-o", scene.with_name("out.png"), env=environment)
    assert result.returncode == 1 and result.stderr.startswith("error: no OpenGL")
    assert files(scene.parent) == ["scene.npz"]


@pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")
@pytest.mark.parametrize("moment", [0.0, 0.3, 1.0])
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGHUP, 129)])
def test_interrupted(scene: Path, number: int, code: int, moment: float) -> None:
    """By Ctrl-C, or by a terminal that is closed, of which shell and system both tell."""
    picture = scene.with_name("out.png")
    arguments = command(scene, "-o", picture, "--passes", 100000, "--photons", 30000)
    with child(arguments, cwd=ROOT, stderr=subprocess.PIPE, text=True) as render:
        wait_for_opengl(render)
        time.sleep(moment)
        render.send_signal(number)
        if number == signal.SIGHUP:
            render.send_signal(number)
        begun = time.monotonic()
        _, error = render.communicate(timeout=STOPS_WITHIN)
        print(f"stopped in {time.monotonic() - begun:.2f} s")
    assert render.returncode == code
    assert error == "interrupted: no picture written\n"
    assert files(scene.parent) == ["scene.npz"]


@pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")
@pytest.mark.parametrize("moment", [0.0, 0.5])
def test_closed_terminal(scene: Path, moment: float) -> None:
    """Nobody can be told, and that is no error."""
    terminal, end = pty.openpty()
    arguments = command(scene, "-o", scene.with_name("out.png"), "--passes", 100000)
    with child(arguments, cwd=ROOT, preexec_fn=partial(os.login_tty, end)) as render:
        os.close(end)
        wait_for_opengl(render)
        time.sleep(moment)
        os.close(terminal)
        assert render.wait(STOPS_WITHIN) == 129
    assert files(scene.parent) == ["scene.npz"]


@pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")
def test_nohup_renders_on(scene: Path) -> None:
    picture = scene.with_name("out.png")
    arguments = ["nohup", *command(scene, "-o", picture, *QUICK, "--passes", 300)]
    with child(
        arguments, cwd=ROOT, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True
    ) as render:
        wait_for_opengl(render)
        render.send_signal(signal.SIGHUP)
        said, _ = render.communicate(timeout=STOPS_WITHIN)
    assert render.returncode == 0 and "300 passes" in said
    assert png_size(picture) == (16, 12)


def wait_for_opengl(render: subprocess.Popen[Any]) -> None:
    begun = time.monotonic()
    while "EGL" not in Path(f"/proc/{render.pid}/maps").read_text():
        assert render.poll() is None and time.monotonic() - begun < STOPS_WITHIN
        time.sleep(0.01)


@pytest.fixture
def hangups_as_before() -> Iterator[None]:
    """What has heard of one ignores the next, and so would what this process starts."""
    before = signal.getsignal(signal.SIGHUP)
    yield
    signal.signal(signal.SIGHUP, before)


@pytest.mark.usefixtures("hangups_as_before")
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("after", [2, 4])
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGHUP, 129)])
def test_interrupted_where_python_drops_what_is_raised(
    scene: Path, monkeypatch: pytest.MonkeyPatch, number: signal.Signals, code: int, after: int
) -> None:
    """Between passes, or after the last one of four."""

    class Interrupting:
        def __del__(self) -> None:
            signal.raise_signal(number)

    asked = 0

    def reached(*_: Any) -> str:
        nonlocal asked
        asked += 1
        if asked == after:
            Interrupting()
        return "passes" if asked == 4 else ""

    monkeypatch.setattr(Stops, "reached", reached)
    output = scene.with_name("out.png")
    assert main([str(scene), "-o", str(output), *QUICK]) == code
    assert asked == after and not output.exists()


def test_warnings(tmp_path: Path) -> None:
    """Nothing turns black without a word."""
    empty: Scene = Builder().scene(cornell().camera)
    lamp = replace(cornell().lights[0], name="lamp", power=(0.0, 0.0, 0.0))
    replace(empty, lights=(lamp,)).save(tmp_path / "empty.npz")
    result = call(tmp_path / "empty.npz", "-o", tmp_path / "out.png", *QUICK)
    assert result.returncode == 0 and (tmp_path / "out.png").exists()
    assert result.stderr.splitlines() == [
        "warning: the scene has no triangles to render",
        "warning: light 'lamp' has no power",
    ]
