# SPDX-License-Identifier: GPL-3.0-or-later
"""RendererProcess: progress, cancelling, and what happens when the child dies."""

from __future__ import annotations

import math
import os
import queue
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from addon.photon.errors import DeviceError, RenderError, SceneError, SettingsError
from addon.photon.jobs import worker
from addon.photon.jobs.console import status_text
from addon.photon.jobs.process import Progress, RendererProcess, _shared_bytes, last_error
from addon.photon.scene.snapshot import pack
from addon.photon.settings import Settings
from tests.scenes import cornell

ROOT = Path(__file__).parents[2]
SMALL = Settings(width=24, height=16, photons=1000, passes=3)
LONG = replace(SMALL, passes=1 << 20)
HUGE = replace(LONG, photons=1 << 22)  # one pass takes seconds
linux = pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")


def finish(process: RendererProcess, settings: Settings = SMALL) -> Progress:
    """Render to the end; the last event."""
    *_, last = process.render(cornell(), settings)
    assert last.done and last.images is not None
    assert np.isfinite(last.images["Combined"]).all() and last.images["Direct"].mean() > 0
    return last


def alive(pid: int) -> bool:
    """Whether a process runs; one that only waits for its parent's word doesn't."""
    try:
        stat = Path(f"/proc/{pid}/stat").read_text()
    except (FileNotFoundError, ProcessLookupError):
        return False
    return stat.rpartition(")")[2].split()[0] not in "ZX"


def wait_for(condition: Callable[[], bool], seconds: float) -> float:
    """Seconds until the condition held; fails if it did not in time."""
    start = time.monotonic()
    while not condition():
        assert time.monotonic() - start < seconds, f"not within {seconds} s"
        time.sleep(0.02)
    return time.monotonic() - start


def start(process: RendererProcess, settings: Settings) -> Any:
    """A render under way: the child has made its programs."""
    events = process.render(cornell(), settings)
    for event in events:
        if event.phase != "Starting":
            return events
    raise AssertionError("the render is over")


def test_progress(process: RendererProcess) -> None:
    events = list(process.render(cornell(), SMALL))
    first, last = events[0], events[-1]
    assert (first.phase, first.passes_done, first.passes, first.photons) == ("Starting", 0, 3, 0)
    assert last.done and not any(event.done for event in events[:-1])
    assert last.passes_done == 3 and last.photons == 3000 and last.remaining == 0.0
    assert last.info["passes"] == 3 and last.info["photons_a_pass"] == 1000
    assert last.images is not None
    shapes = {name: image.shape for name, image in last.images.items()}
    assert shapes == {
        "Combined": (16, 24, 4),
        **dict.fromkeys(
            ("Direct", "Indirect", "Mirror", "Emission", "Background", "Normal"), (16, 24, 3)
        ),
        **dict.fromkeys(("Depth", "Error"), (16, 24, 1)),
    }
    assert all(image.dtype == np.float32 for image in last.images.values())
    for name in ("passes_done", "photons", "elapsed"):
        values = [getattr(event, name) for event in events]
        assert values == sorted(values), name


def test_denoising_is_a_phase(process: RendererProcess) -> None:
    """After the passes; what the last event tells is the denoised picture's."""
    *events, last = process.render(cornell(), replace(SMALL, denoise=True))
    phases = list(dict.fromkeys(event.phase for event in events))
    assert phases[-2:] == ["Rendering", "Denoising"] and status_text(events[-1]) == "Denoising"
    assert last.info["denoiser"].startswith("OpenImageDenoise 2.") and last.warnings == ()
    plain = finish(process).images
    assert last.images is not None and plain is not None
    assert not np.array_equal(last.images["Combined"], plain["Combined"])
    assert np.array_equal(last.images["Mirror"], plain["Mirror"])


def test_same_picture_as_in_process(process: RendererProcess) -> None:
    """Another process, the same bits; and again when it is warm."""
    first, second = finish(process), finish(process)
    assert first.images is not None and second.images is not None
    code = (
        "import sys, numpy as np\n"
        "from tests.scenes import cornell; from tests.measure import render\n"
        "from addon.streams import Device\n"
        f"np.savez(sys.argv[1], **render(Device(), cornell(), width={SMALL.width}, "
        f"height={SMALL.height}, photons={SMALL.photons}, passes={SMALL.passes}, "
        f"radius_decay={SMALL.radius_decay}))"
    )
    assert process._folder
    file = process._folder / "direct.npz"
    subprocess.run([sys.executable, "-c", code, str(file)], cwd=ROOT, check=True)
    with np.load(file) as images:
        for name, image in images.items():
            assert image.tobytes() == first.images[name].tobytes() == second.images[name].tobytes()


def test_events_come_often(process: RendererProcess) -> None:
    """While passes take seconds, too: Blender asks between events whether to stop."""
    finish(process)
    gaps = []
    for _ in range(3):  # others may have had the processor
        last, worst, begun = time.monotonic(), 0.0, time.monotonic()
        events = process.render(cornell(), HUGE)
        for _ in events:
            now = time.monotonic()
            last, worst = now, max(worst, now - last)
            if now - begun > 1.0:
                break
        events.close()
        gaps.append(worst)
        if worst <= 0.2:
            break
    print(f"longest time between events: {gaps} s")
    assert min(gaps) <= 0.2


def test_warm_child_is_kept(process: RendererProcess) -> None:
    assert process.pid is None
    finish(process)
    pid = process.pid
    assert pid is not None
    finish(process)
    assert process.pid == pid


def test_previews(process: RendererProcess) -> None:
    settings = replace(SMALL, passes=1 << 20, time_limit=1.6)
    pictures = [e.images for e in process.render(cornell(), settings) if e.images]
    assert len(pictures) >= 2
    assert all(picture["Direct"].mean() > 0 for picture in pictures)
    settings = replace(settings, time_limit=0.8)
    events = list(process.render(cornell(), settings, previews=False))
    assert [event.images is not None for event in events] == [False] * (len(events) - 1) + [True]


def test_pictures_stay(process: RendererProcess) -> None:
    """They are the files that the child wrote, not copies: a later one changes none, nor does the
    process's end; and they may be written to."""
    events = process.render(cornell(), replace(SMALL, passes=1 << 20, time_limit=1.6))
    held = [(e.images, {n: i.copy() for n, i in e.images.items()}) for e in events if e.images]
    assert len(held) >= 2
    process.close()
    for images, copies in held:
        for name, image in images.items():
            assert not image.flags.owndata
            np.testing.assert_array_equal(image, copies[name])
            image[:] = 1.0


def test_border_region_shares_its_own_pixels(process: RendererProcess) -> None:
    whole = replace(SMALL, width=4096, height=4096)
    border = replace(whole, region=(100, 100, 124, 116))
    bytes_of = partial(_shared_bytes, pack(cornell()))
    assert bytes_of(border) == bytes_of(SMALL) < 1e6 < bytes_of(whole)
    last = finish(process, border)
    assert last.images is not None and last.images["Combined"].shape == (16, 24, 4)


def test_time_limit(process: RendererProcess) -> None:
    last = finish(process, replace(LONG, time_limit=0.3))
    assert 0 < last.passes_done < LONG.passes and last.remaining == 0.0
    assert last.info["passes"] == last.passes_done


def test_noise_threshold(process: RendererProcess) -> None:
    """The number of passes is the picture's, however the time went."""
    settings = replace(LONG, noise_threshold=0.06)
    *_, first = process.render(cornell(), settings)
    events = list(process.render(cornell(), settings, previews=False))
    last = events[-1]
    assert 8 < last.passes_done == first.passes_done < 1000
    assert last.info["error"] <= 0.06 and last_error(last.info) == last_error(first.info)
    assert first.images and last.images
    for name, image in first.images.items():
        assert image.tobytes() == last.images[name].tobytes()
    known = [event.info["error"] for event in events if event.info]
    assert known[0] == math.inf and known[-1] == last.info["error"]
    assert all(event.remaining < 1000 for event in events[-3:])  # not of all passes


def test_warnings_come_once(process: RendererProcess) -> None:
    scene = replace(cornell(), lights=())
    events = list(process.render(scene, SMALL))
    warned = [event.warnings for event in events if event.warnings]
    assert warned == [("the scene has no light",)]


# Cancelling.


def test_cancel_at_random_moments(process: RendererProcess) -> None:
    """Closing returns at once, and the next render works."""
    rng = np.random.default_rng(12)
    times = []
    for number in range(10):
        events = process.render(cornell(), HUGE if number % 2 else LONG)
        moment = time.monotonic() + rng.uniform(0.0, 1.2)
        for _ in events:
            if time.monotonic() >= moment:
                break
        begun = time.monotonic()
        events.close()
        times.append(time.monotonic() - begun)
    print("cancelled in", " ".join(f"{t:.3f}" for t in times), "s")
    assert sorted(times)[-2] <= 0.25 and max(times) <= 0.5  # 0.2 s, and what others take
    finish(process)


def test_cancel_small_passes_keeps_the_child(process: RendererProcess) -> None:
    events = start(process, LONG)
    pid = process.pid
    for _ in range(3):
        next(events)
    events.close()
    assert process.pid == pid
    finish(process)
    assert process.pid == pid


def test_cancel_before_anything_began(process: RendererProcess) -> None:
    events = process.render(cornell(), SMALL)
    next(events)
    events.close()
    process.render(cornell(), SMALL).close()
    assert process.pid is None
    finish(process)


def test_leaving_after_the_last_event_is_no_cancel(process: RendererProcess) -> None:
    finish(process)
    pid = process.pid
    for _ in range(3):
        for event in process.render(cornell(), SMALL):
            if event.done:
                break
        assert process.pid == pid
    finish(process)
    assert process.pid == pid


def test_forgotten_iterator_cancels(process: RendererProcess) -> None:
    events = start(process, LONG)
    del events
    finish(process)


def test_ctrl_c_cancels(process: RendererProcess) -> None:
    events = start(process, LONG)
    with pytest.raises(KeyboardInterrupt):
        events.throw(KeyboardInterrupt)
    finish(process)


# Deaths.


@pytest.mark.parametrize("settings", [LONG, HUGE], ids=["small passes", "huge passes"])
def test_killed_mid_render(process: RendererProcess, settings: Settings) -> None:
    events = start(process, settings)
    assert process.pid
    os.kill(process.pid, signal.SIGKILL)
    begun = time.monotonic()
    with pytest.raises(RenderError, match="the renderer process ended by signal 9"):
        for _ in events:
            assert time.monotonic() - begun < 2
    assert process.pid is None and process._folder is None
    finish(process)


def test_killed_between_renders(process: RendererProcess) -> None:
    """Found out before the next render: nobody sees it."""
    finish(process)
    pid = process.pid
    assert pid
    os.kill(pid, signal.SIGKILL)
    wait_for(lambda: process.pid is None, 2)
    finish(process)
    assert process.pid != pid


def test_crash_says_what_the_child_said(tmp_path: Path) -> None:
    """The last line of its log is in the message."""
    fake = tmp_path / "python"
    fake.write_text("#!/bin/sh\necho driver said no >&2\nexit 3\n")
    fake.chmod(0o755)
    process = RendererProcess(str(fake))
    with pytest.raises(RenderError, match="ended with code 3: driver said no"):
        list(process.render(cornell(), SMALL))
    assert process.pid is None and process._folder is None


@linux
@pytest.mark.parametrize("name", ["INT", "HUP"])
def test_child_never_hears_of_ctrl_c_or_hang_up(tmp_path: Path, name: str) -> None:
    """Nor before its first line: it would end with a traceback."""
    fake = tmp_path / "python"
    fake.write_text(f"#!/bin/sh\nkill -{name} $$\necho still here >&2\nexit 3\n")
    fake.chmod(0o755)
    with pytest.raises(RenderError, match="ended with code 3: still here"):
        list(RendererProcess(str(fake)).render(cornell(), SMALL))
    assert not {signal.SIGINT, signal.SIGHUP} & signal.pthread_sigmask(signal.SIG_BLOCK, ())


def test_child_that_cannot_start() -> None:
    process = RendererProcess("/nonexistent/python")
    for _ in range(2):
        with pytest.raises(RenderError, match="cannot start the renderer with /nonexistent/python"):
            list(process.render(cornell(), SMALL))
        assert process.pid is None and process._folder is None


# Errors of the renderer.


def test_no_such_device(process: RendererProcess) -> None:
    finish(process)
    pid = process.pid
    with pytest.raises(DeviceError, match=r"no OpenGL 3\.3 context on device 200"):
        list(process.render(cornell(), replace(SMALL, device_index=200)))
    finish(process)  # the first device again
    assert process.pid == pid


@linux
@pytest.mark.parametrize(
    "broken",
    [
        {"__EGL_VENDOR_LIBRARY_FILENAMES": "/nonexistent"},
        {"__EGL_VENDOR_LIBRARY_FILENAMES": "/dev/null"},
    ],
    ids=str,
)
def test_no_opengl(
    process: RendererProcess, monkeypatch: pytest.MonkeyPatch, broken: dict[str, str]
) -> None:
    with monkeypatch.context() as patch:
        for name, value in broken.items():
            patch.setenv(name, value)
        with pytest.raises(DeviceError, match=r"no OpenGL.*Install a graphics driver.*libegl1"):
            list(process.render(cornell(), SMALL))
    process.close()
    finish(process)


def test_scene_error(process: RendererProcess) -> None:
    scene = cornell()
    triangles = scene.triangles.copy()
    triangles[4, 1] = -7
    with pytest.raises(SceneError, match=r"scene\.triangles\[4, 1\] = -7 is outside"):
        list(process.render(replace(scene, triangles=triangles), SMALL))
    pid = process.pid
    finish(process)
    assert process.pid == pid is not None  # an error is no death


def test_settings_error_comes_before_anything_starts(process: RendererProcess) -> None:
    with pytest.raises(SettingsError, match="width = 0"):
        next(process.render(cornell(), replace(SMALL, width=0)))
    assert process.pid is None and process._folder is None


# What is left behind.


@linux
def test_close_leaves_nothing(process: RendererProcess) -> None:
    finish(process)
    folder, pid = process._folder, process.pid
    assert folder and folder.is_dir() and pid
    process.close()
    assert not folder.exists()
    assert not Path(f"/proc/{pid}").exists()  # not even a zombie
    assert process.pid is None
    process.close()  # again: nothing to do
    finish(process)


@linux
def test_close_mid_render_leaves_nothing(process: RendererProcess) -> None:
    events = start(process, HUGE)
    folder, pid = process._folder, process.pid
    begun = time.monotonic()
    events.close()
    process.close()
    assert time.monotonic() - begun < 1
    assert folder and not folder.exists() and not Path(f"/proc/{pid}").exists()


PARENT = """
import sys, time
from addon.photon.jobs.process import RendererProcess
from addon.photon.settings import Settings
from tests.scenes import cornell
process = RendererProcess()
settings = Settings(width=24, height=16, photons=int(sys.argv[1]), passes=1 << 20)
events = process.render(cornell(), settings)
for event in events:
    if event.phase != "Starting":
        print(process.pid, process._folder, flush=True)
        break
time.sleep(60)
"""


ENDS = [(1000, "kill"), (1 << 20, "kill"), (1000, "group"), (1000, "renderer first")]


@pytest.fixture(params=ENDS, ids=str)
def orphan(request: pytest.FixtureRequest) -> Any:
    """(pid, folder) of a renderer whose parent was killed mid-render, or with it their group, as
    build.py passes a termination on."""
    photons, how = request.param
    command = [sys.executable, "-c", PARENT, str(photons)]
    with subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.PIPE, text=True, process_group=0
    ) as parent:
        assert parent.stdout
        pid, folder = parent.stdout.readline().split()
        assert alive(int(pid))
        if how == "group":
            os.killpg(parent.pid, signal.SIGTERM)
        if how == "renderer first":
            os.kill(int(pid), signal.SIGTERM)
            time.sleep(0.7)
        parent.kill()
    yield int(pid), Path(folder)
    # The watch that the renderer left behind may be clearing it up at this very moment.
    shutil.rmtree(folder, ignore_errors=True)


@linux
def test_child_ends_with_its_parent(orphan: tuple[int, Path]) -> None:
    pid, _ = orphan
    print(f"outlived its parent by {wait_for(lambda: not alive(pid), 3):.2f} s")


@linux
def test_orphan_leaves_no_shared_memory(orphan: tuple[int, Path]) -> None:
    _, folder = orphan
    wait_for(lambda: not folder.exists(), 3)


def test_a_renderer_that_waits_gives_back_what_it_does_not_need(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Only once no request has come for a while."""
    inbox: Any = queue.Queue()
    rests = []

    class Resting:
        def rest(self) -> None:
            rests.append(len(rests))
            inbox.put({"type": "late"})

    monkeypatch.setattr(worker, "IDLE", 0.01)
    inbox.put({"type": "soon"})
    waiting: Any = Resting()
    assert worker._next(inbox, waiting) == {"type": "soon"} and rests == []
    assert worker._next(inbox, waiting) == {"type": "late"} and rests == [0]
