# SPDX-License-Identifier: GPL-3.0-or-later
"""What is kept or put back takes no more memory from frame to frame, and changes no bit."""

from __future__ import annotations

import ctypes
import ctypes.util
import sys
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import moderngl
import numpy as np
import pytest

from addon.photon.photons.deposits import DEPOSIT_BYTES, DeviceDeposits
from addon.photon.photons.kept import Kept
from addon.photon.scene import Scene
from addon.photon.settings import Settings
from addon.photon.stage.device_scene import DeviceScene
from addon.streams import Device, StreamError
from tests.scenes import cornell
from tests.unit.kept_frames import ALL, SETTINGS, WAYS, moved, render, widened

# What few photons tell of where others shall start is asked for each view anew.
pytestmark = pytest.mark.usefixtures("not_aimed")


@pytest.mark.thorough(
    "compute-gather-False-scene0", "compute-splat-False-scene0", "compute-splat-False-scene1"
)
@pytest.mark.parametrize("scene", [cornell(), cornell(True)])
@pytest.mark.parametrize(("backend", "estimator", "on_host"), WAYS)
def test_textures_put_back(
    device: Device,
    monkeypatch: pytest.MonkeyPatch,
    backend: Any,
    estimator: Any,
    on_host: bool,
    scene: Scene,
) -> None:
    """A render finds those of the last one, as on GPUs, and whatever they hold is nothing to it."""
    monkeypatch.setattr(device, "prefers_native", on_host)
    settings = replace(SETTINGS, backend=backend, estimator=estimator)
    fresh = render(device, scene, settings)
    put_back, made = device.put_back, 0

    def spoil(item: moderngl.Texture | moderngl.Buffer) -> None:
        if isinstance(item, moderngl.Buffer):
            item.write(np.full(item.size // 4, np.nan, np.float32))
        else:
            kind = np.float32 if item.dtype == "f4" else np.uint32
            value = np.nan if item.dtype == "f4" else 0xFFFFFFFF
            item.write(np.full((item.height, item.width, item.components), value, kind))
        put_back(item)

    def count(*arguments: Any) -> Any:
        nonlocal made
        made += 1
        return texture(*arguments)

    monkeypatch.setattr(device, "reuses", True)
    monkeypatch.setattr(device, "put_back", spoil)
    try:
        first = render(device, scene, settings)
        texture = device._new_texture
        monkeypatch.setattr(device, "_new_texture", count)
        again = render(device, scene, settings)
        assert first.images == again.images == fresh.images
        few = made  # what is uploaded anew in each pass, if anything is
        device.drop_spare()
        assert render(device, scene, settings).images == fresh.images
        assert made - few > 20 + few
    finally:
        device.drop_spare()


def test_no_room_beside_what_was_put_back(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """It goes first, and then what is kept: a texture that the driver has no room for at once."""
    monkeypatch.setattr(device, "reuses", True)
    device.put_back(device.texture((8, 8), 4))
    real, asked = device.ctx, []

    class Full:
        """Refuses while anything is put back."""

        error = property(lambda self: self.refused.pop() if self.refused else real.error)

        def __init__(self) -> None:
            self.refused: list[str] = []

        def texture(self, *arguments: Any, **named: Any) -> Any:
            asked.append(arguments[0])
            if any(device._spare.values()):
                self.refused.append("GL_OUT_OF_MEMORY")
            return real.texture(*arguments, **named)

        def __getattr__(self, name: str) -> Any:
            return getattr(real, name)

    monkeypatch.setattr(device, "ctx", Full())
    device.free(device.texture((16, 8), 4))
    assert asked == [(16, 8)] * 2 and not any(device._spare.values())


def test_deposits_without_room(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """What was put back for longer lists is put back once."""
    monkeypatch.setattr(device, "reuses", True)
    deposits = DeviceDeposits(device)

    def refuse(*_: Any) -> None:
        raise StreamError("no room")

    with monkeypatch.context() as patch:
        patch.setattr(device, "_new_texture", refuse)
        with pytest.raises(StreamError):
            deposits.make_room(1 << 20)
    deposits.release()
    textures = [device.texture((4096, 1), 4) for _ in range(4)]
    assert len({texture.glo for texture in textures}) == 4
    for texture in textures:
        device.free(texture)
    device.drop_spare()


def test_budget(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """What goes beyond it is traced again: never less, never other pictures."""
    everything, none = Kept(device), Kept(device, budget=0)
    scene = cornell()
    fresh = render(device, scene, kept=everything)
    whole = everything.photon_bytes
    sizes = [kept.deposits.bytes for kept in everything._passes.values()]
    assert whole == sum(sizes) and all(size % DEPOSIT_BYTES == 0 for size in sizes)
    some = Kept(device, budget=sizes[0] + DEPOSIT_BYTES)
    for kept, expected in ((everything, [0, 0]), (some, [ALL, 1]), (none, [ALL, ALL])):
        frames = [render(device, scene, kept=kept) for _ in range(2)]
        assert [frame.traced for frame in frames] == expected
        assert all(frame.images == fresh.images for frame in frames)
    assert (some.photon_bytes, none.photon_bytes) == (sizes[0], 0)
    for kept in (everything, some, none):
        kept.release()
        assert kept.photon_bytes == 0


def living(device: Device) -> dict[str, int]:
    """How many objects of each kind OpenGL holds for the device."""
    ctx, library = device.ctx, ctypes.util.find_library("EGL")
    find = ctypes.CDLL(library).eglGetProcAddress
    find.restype, find.argtypes = ctypes.c_void_p, [ctypes.c_char_p]
    texture, buffer = ctx.texture((1, 1), 4), ctx.buffer(reserve=4)
    framebuffer = ctx.framebuffer([texture])
    program = ctx.program(vertex_shader="#version 330 core\nvoid main() { gl_Position = vec4(0); }")
    made = {
        "VertexArray": ctx.vertex_array(program, []),
        "Program": program,
        "Framebuffer": framebuffer,
        "Texture": texture,
        "Buffer": buffer,
    }
    counts = {}
    for kind, item in made.items():
        lives = ctypes.CFUNCTYPE(ctypes.c_ubyte, ctypes.c_uint)(find(f"glIs{kind}".encode()))
        counts[kind] = sum(lives(name) for name in range(1, max(1 << 13, item.glo + 1)))
    for item in made.values():
        item.release()
    return counts


@pytest.fixture(params=WAYS, ids=lambda way: "-".join(map(str, way)))
def way(
    request: pytest.FixtureRequest, device: Device, monkeypatch: pytest.MonkeyPatch
) -> Settings:
    """Settings of each of WAYS."""
    backend, estimator, on_host = request.param
    if backend == "compute" and not device.has_compute:
        pytest.skip(f"{device.name} has no compute programs")
    monkeypatch.setattr(device, "prefers_native", on_host)
    return replace(SETTINGS, backend=backend, estimator=estimator)


@pytest.fixture(params=[moved, lambda s, x: widened(s, x)], ids=["eye", "light"])
def frames(request: pytest.FixtureRequest, device: Device, kept: Kept, way: Settings) -> Any:
    """Renders so many frames in which that changes, one each time it is asked."""

    def rendered(count: int) -> Iterator[None]:
        for frame in range(count):
            render(device, request.param(cornell(mirror=True), 0.02 * (frame + 1)), way, kept)
            yield

    return rendered


@pytest.mark.thorough("eye-compute-gather", "light-compute-splat", "light-compute-gather")
def test_spare_streams_do_not_add_up(
    device: Device, monkeypatch: pytest.MonkeyPatch, frames: Any
) -> None:
    """As GPUs render animations: what is put back serves the next frame."""
    monkeypatch.setattr(device, "reuses", True)
    spare = [sum(map(len, device._spare.values())) for _ in frames(8)]
    device.drop_spare()
    assert max(spare[4:]) <= max(spare[:4]) + 2 and spare[-1] > 0


@pytest.mark.thorough(
    "compute-gather-False-eye",
    "compute-splat-False-light",
    "compute-splat-False-eye",
    "compute-gather-False-light",
)
@pytest.mark.skipif(sys.platform != "linux", reason="asks OpenGL through EGL")
def test_animations_hold_no_more_from_frame_to_frame(
    device: Device, kept: Kept, monkeypatch: pytest.MonkeyPatch, way: Settings, frames: Any
) -> None:
    monkeypatch.setattr(device, "reuses", False)  # what is put back is freed
    device.drop_spare()
    device._release_framebuffers()  # a cache with a limit of its own
    before = living(device)
    counts, sizes = [], []
    for _ in frames(6):
        device._release_framebuffers()
        counts.append(living(device))
        sizes.append(kept.photon_bytes)
    print(f"OpenGL holds {counts[0]}, {sizes[0]} bytes of deposits")
    assert counts[1:] == [counts[0]] * 5
    tables = 5 if way.backend == "native" else 7  # the scene's, with the tree and solids
    assert counts[0]["Texture"] - before["Texture"] == tables
    assert max(sizes) <= 1.1 * sizes[0]
    kept.release()
    after = living(device)
    assert after | {"Program": 0} == before | {"Program": 0}


def test_what_was_kept_goes_before_the_next_is_built(
    device: Device, kept: Kept, monkeypatch: pytest.MonkeyPatch
) -> None:
    build, seen = DeviceScene.build, []
    monkeypatch.setattr(device, "reuses", False)  # nor is put back, as on GPUs

    def spy(device: Device, scene: Scene, layer: str, *rest: Any) -> DeviceScene:
        seen.append([isinstance(t.mglo, moderngl.InvalidObject) for t in textures])
        assert kept.photon_bytes == 0
        made = build(device, scene, layer, *rest)
        textures[:] = made.tables.textures.values()
        return made

    textures: list[moderngl.Texture] = []
    monkeypatch.setattr(DeviceScene, "build", staticmethod(spy))
    for scene in (cornell(), widened(cornell(), 0.1)):
        render(device, scene, kept=kept)
        assert kept.photon_bytes > 0
    assert seen[0] == [] and seen[1] and all(seen[1])
