# SPDX-License-Identifier: GPL-3.0-or-later
"""RendererProcess: progress, pictures and errors."""

from __future__ import annotations

import math
import queue
import subprocess
import sys
import time
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from addon.photon.errors import DeviceError, SceneError, SettingsError
from addon.photon.jobs import worker
from addon.photon.jobs.console import status_text
from addon.photon.jobs.process import IMAGE_BYTES, RendererProcess, _shared_bytes, last_error
from addon.photon.scene.snapshot import pack
from tests.process.renders import HUGE, LONG, SMALL, finish, linux
from tests.scenes import cornell

ROOT = Path(__file__).parents[2]


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


def test_every_image_has_room(process: RendererProcess) -> None:
    """Of those that are asked for besides, too."""
    asked = replace(SMALL, illuminance=True, caustics=True, denoising_data=True)
    images = finish(process, replace(asked, mist=(0.0, 9.0, 1.0))).images
    assert images and {"Mist", "Illuminance", "Caustics", "Denoising Albedo"} <= images.keys()
    assert sum(image.nbytes for image in images.values()) <= IMAGE_BYTES * 24 * 16


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
