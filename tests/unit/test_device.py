# SPDX-License-Identifier: GPL-3.0-or-later
"""Device: errors reported by OpenGL, layers, devices that are not there."""

from __future__ import annotations

import gc

import moderngl
import numpy as np
import pytest

from addon.photon.backends.backend import open_device
from addon.photon.errors import DeviceError
from addon.photon.prepare import prepare
from addon.photon.settings import Settings
from addon.streams import Device, StreamError
from tests.scenes import cornell


def test_driver_errors_reach_check(device: Device) -> None:
    device.ctx.enable_direct(0xFFFF)  # no such capability
    if device.version.startswith(("4.3", "4.4", "4.5", "4.6")):
        assert device.errors and "GL_INVALID_ENUM" in device.errors[0]  # KHR_debug's own words
    with pytest.raises(StreamError, match="GL_INVALID_ENUM") as raised:
        device.check()
    assert device.name in str(raised.value)
    device.check()  # told once


def test_errors_in_order(device: Device) -> None:
    device.ctx.enable_direct(0xFFFF)
    device.ctx.disable_direct(0xFFFE)
    assert len(device.errors) == 2
    with pytest.raises(StreamError):
        device.check()


def test_launches_are_handed_over(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """Soon after the host asked for something, for then a GPU may have none; and what it asks."""
    flushed: list[int] = []
    launched = 0
    buffer = device.ctx.buffer(bytes(4))
    monkeypatch.setattr(device, "_flush", lambda: flushed.append(launched))
    for rounds in range(2):
        device.ask(buffer, 1).numbers()
        assert flushed == [launched]
        flushed.clear()
        for _ in range(20 + rounds):
            launched += 1
            device.launched()
        assert [number - launched + 20 + rounds for number in flushed] == [1, 2, 4, 8, 16]
        flushed.clear()
    buffer.release()


def test_layers(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(device, "has_compute", True)
    monkeypatch.setattr(device, "is_software", True)
    assert device.choose_layer("auto") == "fragment"
    monkeypatch.setattr(device, "is_software", False)
    assert device.choose_layer("auto") == "compute"
    assert device.choose_layer("fragment") == "fragment"
    assert device.choose_layer("compute") == "compute"
    monkeypatch.setattr(device, "has_compute", False)
    assert device.choose_layer("auto") == "fragment"
    with pytest.raises(StreamError, match="has no compute programs"):
        device.choose_layer("compute")


def test_no_such_device() -> None:
    with pytest.raises(DeviceError, match=r"no OpenGL 3\.3 context on device 200.*libegl1"):
        open_device(Settings(device_index=200))


def test_framebuffers_of_released_textures_are_forgotten(device: Device) -> None:
    """A released texture's number is given to the next one: its framebuffer must not be."""
    for _ in range(3):
        texture = device.ctx.texture((4, 4), 4, dtype="f4")
        framebuffer = device.framebuffer([texture])
        assert device.framebuffer([texture]) is framebuffer
        framebuffer.clear(1.0, 2.0, 3.0, 4.0)
        assert isinstance(framebuffer, moderngl.Framebuffer)
        device.free(texture)
        assert not any(key == (texture.glo,) for key in device._framebuffers)


def test_two_devices_in_one_process(device: Device) -> None:
    """Each keeps its own objects and errors, whichever was opened or closed last."""
    renderer = prepare(cornell(), Settings(width=16, height=16, photons=256), device)
    renderer.render_pass()
    expected = renderer.images()["Combined"]
    other = Device()
    other.ctx.enable_direct(0xFFFF)
    np.testing.assert_array_equal(renderer.images()["Combined"], expected)
    assert len(other.errors) == 1
    other.release()
    del other
    gc.collect()
    device.use()
    device.ctx.enable_direct(0xFFFF)  # no callback of the other's is called
    assert len(device.errors) == 1
    with pytest.raises(StreamError):
        device.check()
    np.testing.assert_array_equal(renderer.images()["Combined"], expected)
    renderer.release()
