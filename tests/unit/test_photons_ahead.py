# SPDX-License-Identifier: GPL-3.0-or-later
"""Photons of the next pass fly while the host waits: in no picture is a bit of them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from addon.photon.backends import backend as backend_module
from addon.photon.errors import DeviceError
from addon.photon.eye.eye import Eye
from addon.photon.kernels.eye_rays import EyeRays
from addon.photon.photons.deposits import DeviceDeposits
from addon.photon.photons.device_photon_mapper import DevicePhotonMapper
from addon.photon.photons.kept import Kept
from addon.photon.photons.mapper import PhotonBatch
from addon.photon.photons.photon_pass import Photons
from addon.photon.prepare import prepare
from addon.photon.settings import Region, Settings
from addon.streams import Device, Reading, StreamError
from tests.scenes import cornell
from tests.unit.kept_frames import SETTINGS, moved, render

# What few photons tell of where others shall start is asked for each view anew.
pytestmark = pytest.mark.usefixtures("not_aimed")


@pytest.fixture
def on_device(resident: None) -> Settings:
    """Settings of a render whose lists stay on the device, as on GPUs."""
    return replace(SETTINGS, backend="compute", passes=3)


def test_the_next_photons_fly_while_the_host_waits(
    device: Device, on_device: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    """For the rays of mirrors, in each pass but the last, behind which there is none; in the first
    at each bounce, before anything else is launched."""
    events: list[str] = []
    start, sent_last = DevicePhotonMapper.start, Eye._sent_last

    def watched_start(mapper: DevicePhotonMapper, batch: PhotonBatch) -> None:
        events.append(f"photons {batch.index}")
        start(mapper, batch)

    def watched_wait(eye: Eye, region: Region, reading: Reading) -> int:
        events.append("wait")
        return sent_last(eye, region, reading)

    monkeypatch.setattr(DevicePhotonMapper, "start", watched_start)
    monkeypatch.setattr(Eye, "_sent_last", watched_wait)
    renderer = prepare(cornell(mirror=True), on_device, device)
    for index in range(on_device.passes):
        renderer.render_pass()
        events.append(f"pass {index}")
    renderer.release()
    in_passes = " ".join(events).split(" pass ")
    assert in_passes[0].startswith("photons 0 wait wait photons 1")
    assert in_passes[1].startswith("0 photons 2 wait")
    assert in_passes[2].startswith("1 wait") and "photons" not in in_passes[2]


@pytest.mark.thorough("splat")
@pytest.mark.parametrize("estimator", ["gather", "splat"])
def test_early_photons_change_nothing(
    device: Device, on_device: Settings, monkeypatch: pytest.MonkeyPatch, estimator: Any
) -> None:
    """Strips go on reading this pass's."""
    settings = replace(on_device, estimator=estimator, first_pass=2)
    pictures = []
    for is_early, pixels in ((False, 1 << 20), (True, 1 << 20), (True, 5 * SETTINGS.width)):
        with monkeypatch.context() as patch:
            if not is_early:
                patch.setattr(Photons, "prefetch", lambda *_: None)
            for name in ("STRIP_PIXELS", "GPU_STRIP_PIXELS"):
                patch.setattr(backend_module, name, pixels)
            pictures.append(render(device, cornell(mirror=True), settings).images)
    assert pictures[0] == pictures[1] == pictures[2]


def test_eye_rays_go_before_the_host_waits(
    device: Device, on_device: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    """For the photons that tell the radii; the first pass sends no others."""
    events: list[str] = []
    for kind, name in ((EyeRays, "run"), (DevicePhotonMapper, "finish")):
        monkeypatch.setattr(kind, name, watched(getattr(kind, name), events))
    renderer = prepare(cornell(), on_device, device)
    assert events == ["run", "finish"]
    renderer.render_pass()
    assert events == ["run", "finish"]
    renderer.render_pass()
    assert events[2:] == ["run", "finish"]
    renderer.release()


def watched(function: Any, events: list[str]) -> Any:
    """Lists its calls."""

    def run(*arguments: Any, **named: Any) -> Any:
        events.append(function.__name__)
        return function(*arguments, **named)

    return run


def test_a_pass_that_failed_is_begun_anew(
    device: Device, on_device: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    """There was no room for its photons, and then there was."""
    fresh = render(device, cornell(), on_device)

    def refuse(*_: Any) -> None:
        raise StreamError("no room")

    renderer = prepare(cornell(), on_device, device)
    renderer.render_pass()
    with monkeypatch.context() as patch:
        patch.setattr(DeviceDeposits, "make_room", refuse)
        with pytest.raises(DeviceError, match="no room"):
            renderer.render_pass()
    while renderer.film.passes < on_device.passes:
        renderer.render_pass()
    images = {name: image.tobytes() for name, image in renderer.images().items()}
    renderer.release()
    assert images == fresh.images


@pytest.mark.thorough("2")
@pytest.mark.parametrize("passes", [1, 2])
def test_a_render_that_was_stopped(
    device: Device, kept: Kept, on_device: Settings, passes: int
) -> None:
    """Its next photons were on their way: nothing of them is in what is told and in the next."""
    scene = cornell(mirror=True)
    fresh = render(device, scene, on_device)
    told = render(device, scene, replace(on_device, passes=passes)).info
    stopped = prepare(scene, on_device, device, kept)
    for _ in range(passes):
        stopped.render_pass()
    info = stopped.info()
    assert {name: info[name] for name in told if name != "error"} == {
        name: told[name] for name in told if name != "error"
    }
    stopped.release()
    again = render(device, moved(scene, 0.0), on_device, kept)
    assert again.images == fresh.images and again.info == fresh.info
    assert again.traced == on_device.passes - passes
