# SPDX-License-Identifier: GPL-3.0-or-later
"""The estimate of memory: not below what is used, and an error before, not a crash after."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from addon.photon import memory
from addon.photon.backends import backend as backend_module
from addon.photon.backends.backend import backend_of
from addon.photon.backends.sizes import FIXED
from addon.photon.errors import SceneError, SettingsError
from addon.photon.eye.compaction import Compaction
from addon.photon.memory import Budget
from addon.photon.photons import grid_sort
from addon.photon.photons.kept import Kept
from addon.photon.prepare import prepare
from addon.photon.scene import Medium, Scene, phong
from addon.photon.settings import Settings
from addon.streams import Device, Stream, StreamError, draw
from tests.scenes import cornell
from tests.unit.test_compaction import veiled
from tests.unit.test_denoiser import needs_it

ROOT = Path(__file__).parents[2]
SMALL = Settings(width=24, height=16, photons=1000, passes=1)

MEASURE = """
import sys
from addon.photon.memory import Budget
from addon.photon.backends.backend import backend_of, open_device
from addon.photon.prepare import prepare
from addon.photon.settings import Settings
from tests.bench.host import resident
from tests.scenes import cornell, hills
backend, size, photons, quads = sys.argv[1], *map(int, sys.argv[2:])
settings = Settings(width=size, height=size, photons=photons, backend=backend, passes=1)
scene = hills(quads) if quads else cornell(True)
device = open_device(settings)
budget = Budget(scene, settings, backend_of(settings, device))
before = resident("VmRSS")
renderer = prepare(scene, settings, device)
renderer.render_pass()
renderer.images()
used = resident("VmHWM") - before
assert renderer.photons
places, _ = renderer.photons.mapper.deposits.arrays()
guessed, known = budget.needed(), budget.needed(len(places) / photons)
renderer.release()
del renderer, places
print(used, guessed, known, resident("VmRSS") - before)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")
@pytest.mark.thorough("1100-4096", "64-600000-0-fragment", "64-4096-400-native")
@pytest.mark.parametrize("backend", ["native", "fragment"])
@pytest.mark.parametrize(
    ("size", "photons", "quads"),
    [(512, 4096, 0), (1100, 4096, 0), (64, 600_000, 0), (64, 4096, 400)],
)
def test_estimate_is_what_is_used(
    device: Device, backend: str, size: int, photons: int, quads: int
) -> None:
    """On software OpenGL, where textures are resident memory: no less, and not far above."""
    if not device.is_software:
        pytest.skip("textures are the GPU's")
    command = [sys.executable, "-c", MEASURE, backend, *map(str, (size, photons, quads))]
    result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    used, guessed, known, left = map(int, result.stdout.split())
    print(f"used {used / 1e6:.0f} MB, estimated {guessed / 1e6:.0f}, then {known / 1e6:.0f}")
    print(f"left after it {left / 1e6:.0f} MB")
    assert used <= known <= 2 * used
    assert used <= guessed <= 4 * used
    assert left <= 500e6  # programs, and some forty textures of a strip that the driver holds


def scene_of(lobes: int, lights: int) -> Scene:
    """With so many lobes at a point, and so many lights."""
    scene = cornell(mirror=lobes > 1)
    of_walls = phong((0.1,) * 3, 9.0), phong((0.1,) * 3)  # of which the first gathers
    walls = replace(scene.materials[0], lobes=of_walls[:lobes])
    materials = (walls, *scene.materials[1:])
    return replace(scene, materials=materials, lights=scene.lights * lights)


@pytest.mark.parametrize("strip", [24 * 16, 24 * 4])
@pytest.mark.parametrize(("lobes", "lights"), [(0, 1), (1, 3), (2, 9)])
@pytest.mark.parametrize(
    "settings",
    [
        {},
        {"backend": "fragment"},
        {"estimator": "splat", "backend": "fragment"},
        {"photons": 0},
        {"denoise": True, "backend": "fragment"},
        {"denoising_data": True, "mist": (0.0, 9.0, 1.0)},
    ],
    ids=str,
)
def test_textures_are_counted(
    device: Device,
    monkeypatch: pytest.MonkeyPatch,
    lobes: int,
    lights: int,
    strip: int,
    settings: dict[str, Any],
) -> None:
    scene = scene_of(lobes, lights)
    found, expected = textures_of(device, monkeypatch, scene, strip, replace(SMALL, **settings))
    assert found == expected


@pytest.mark.parametrize("backend", ["native", "fragment", "compute"])
def test_textures_of_mist_are_counted(
    device: Device, monkeypatch: pytest.MonkeyPatch, backend: Any
) -> None:
    """Seen through what is transparent, too."""
    settings = replace(SMALL, backend=backend, mist=(0.0, 9.0, 1.0))
    found, expected = textures_of(device, monkeypatch, veiled(), 24 * 16, settings)
    assert found == expected


@needs_it
@pytest.mark.parametrize("backend", ["native", "fragment", "compute"])
def test_halves_of_emission_are_counted(
    device: Device, monkeypatch: pytest.MonkeyPatch, backend: Any
) -> None:
    settings = replace(SMALL, backend=backend, denoise=True)
    scene = cornell(mirror=True, bulb=True)
    found, expected = textures_of(device, monkeypatch, scene, 24 * 16, settings)
    assert found == expected


@pytest.mark.parametrize("backend", ["native", "fragment", "compute"])
@pytest.mark.parametrize("medium", [Medium((0.1,) * 3), Medium((0.1,) * 3, (0.2,) * 3)], ids=str)
@pytest.mark.thorough("0-Medium", "scattering=(0.0, ")
@pytest.mark.parametrize("lobes", [0, 2])
def test_textures_of_media_are_counted(
    device: Device, monkeypatch: pytest.MonkeyPatch, lobes: int, medium: Medium, backend: str
) -> None:
    scene, settings = replace(scene_of(lobes, 2), air=medium), replace(SMALL, backend=backend)
    found, expected = textures_of(device, monkeypatch, scene, 24 * 16, settings)
    assert found == expected
    glowing = replace(scene.materials[0], medium=Medium(emission=(1.0,) * 3))
    scene = replace(scene, materials=(glowing, *scene.materials[1:]))
    found, expected = textures_of(device, monkeypatch, scene, 24 * 16, settings)
    assert found == expected


def textures_of(
    device: Device,
    monkeypatch: pytest.MonkeyPatch,
    scene: Scene,
    strip: int,
    settings: Settings,
) -> tuple[int, int]:
    """How many of a strip's size a render makes, and what the budget says."""
    monkeypatch.setattr(backend_module, "STRIP_PIXELS", strip)
    monkeypatch.setattr(backend_module, "GPU_STRIP_PIXELS", strip)
    # Several launches, as where photons crowd.
    monkeypatch.setattr(grid_sort, "MAX_ADDED", 64)
    monkeypatch.setattr(grid_sort, "_is_crowded", lambda *_: True)
    monkeypatch.setattr(draw, "MOST_ITEMS", 64)
    made = []
    init = Stream.__init__

    def counted(stream: Stream, *args: Any) -> None:
        init(stream, *args)
        made.append(stream.size)

    monkeypatch.setattr(Stream, "__init__", counted)
    monkeypatch.setattr(Compaction, "compact", lambda *_: None)  # smaller ones count besides
    renderer = prepare(scene, settings, device)
    renderer.render_pass()
    budget = Budget(renderer.scene, renderer.settings, renderer.backend)
    renderer.release()
    count = 24 * 16 // strip
    on_host = renderer.backend.name == "native"  # the film is in arrays, of as many bytes
    expected = budget.strip_textures + (0 if on_host else count * budget.film_textures)
    expected += (budget.together - 1) * budget.path_textures
    height = 16 // count
    found = sum(size[1] // height for size in made if size[0] == 24 and size[1] % height == 0)
    return found, expected


@pytest.mark.parametrize(
    ("settings", "error", "match"),
    [
        (
            {"width": 4096, "height": 2048},
            SettingsError,
            "for 8388608 pixels: lower the resolution",
        ),
        (
            {"photons": 1 << 24, "backend": "native"},
            SettingsError,
            "for 16777216 photons: lower the photons a pass",
        ),
        ({}, SceneError, "for 5142 triangles: give the scene fewer"),
    ],
    ids=["pixels", "photons", "triangles"],
)
def test_too_large(
    device: Device,
    monkeypatch: pytest.MonkeyPatch,
    settings: dict[str, Any],
    error: type[Exception],
    match: str,
) -> None:
    """Refused before anything is taken, with what is needed, what there is and what to lower."""
    free = FIXED + (1_000_000 if not settings else 900_000_000)
    monkeypatch.setattr(memory, "free_host_memory", lambda: free)
    monkeypatch.setattr(Device, "texture", None)
    needs = r"needs about [\d.]+ GB of memory and [\d.]+ GB are free; [\d.]+ GB of it are "
    with pytest.raises(error, match=needs + match):
        prepare(cornell(), replace(SMALL, **settings), device)


def test_region_counts(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """A part of a picture that would be too large as a whole is rendered."""
    monkeypatch.setattr(memory, "free_host_memory", lambda: 400_000_000)
    settings = replace(SMALL, width=8192, height=8192)
    with pytest.raises(SettingsError, match="67108864 pixels: lower .* or render a border region"):
        prepare(cornell(), settings, device)
    prepare(cornell(), replace(settings, region=(4000, 4000, 4064, 4064)), device).release()


def test_what_was_kept_makes_room(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    kept = Kept(device)
    prepare(cornell(), SMALL, device, kept).release()
    assert kept.photon_bytes > 0
    monkeypatch.setattr(
        memory, "free_host_memory", lambda: 10_000 if kept.photon_bytes else 400_000_000
    )
    renderer = prepare(cornell(), replace(SMALL, radius=1.0), device, kept)
    assert kept.photon_bytes == 0
    renderer.release()
    kept.release()


def test_more_deposits_than_guessed(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """What the photons that tell the radii say is looked at, too."""
    settings = replace(SMALL, photons=1 << 20, backend="native")
    monkeypatch.setattr(memory, "MOST_GUESSED", 0.0)
    guess = Budget(cornell(), settings, backend_of(Settings(backend="native"), device)).needed()
    monkeypatch.setattr(memory, "free_host_memory", lambda: guess)
    with pytest.raises(SettingsError, match="for 1048576 photons: lower the photons a pass"):
        prepare(cornell(), settings, device)


def test_albedos_above_one(device: Device) -> None:
    """Photons meet no more than all that they bring: as many are guessed as where they lose none,
    and no power of it is too large for a number."""
    settings = replace(SMALL, photons=1 << 16, photon_bounces=1024)
    guesses = []
    for lobes in ((0.2,), (0.9, 0.9, 0.9)):
        scene = cornell()
        worn = tuple(phong((x,) * 3, 5.0 + number) for number, x in enumerate(lobes))
        materials = tuple(replace(m, diffuse=(0.8,) * 3, lobes=worn) for m in scene.materials)
        brighter = replace(scene, materials=materials)
        guesses.append(Budget(brighter, settings, backend_of(settings, device))._deposits(None))
    assert guesses[0] == pytest.approx(guesses[1], rel=1e-3)


def test_what_the_caller_takes(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """Blender's own copies of the picture count as the renderer's do."""
    native = backend_of(Settings(backend="native"), device)
    needed = Budget(cornell(), SMALL, native).needed()
    monkeypatch.setattr(memory, "free_host_memory", lambda: needed + 1_000_000)
    Budget(cornell(), replace(SMALL, caller_bytes=900_000), native)
    with pytest.raises(SettingsError, match="for 384 pixels: lower the resolution"):
        Budget(cornell(), replace(SMALL, caller_bytes=1_100_000_000), native)


def test_sides_of_textures(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(device, "texture_limit", 200)
    with pytest.raises(SettingsError, match="300x8 pixels are more than 200 a side"):
        prepare(cornell(), replace(SMALL, width=300, height=8), device)
    with pytest.raises(SettingsError, match=r"204801 photons a pass are more than .* lower the ph"):
        settings = replace(SMALL, photons=200 * 1024 + 1, backend="fragment")
        prepare(cornell(), settings, device)
    monkeypatch.setattr(device, "texture_limit", 25)
    with pytest.raises(SceneError, match=r"30000 triangles are more than .* fewer triangles"):
        prepare(many(30000), SMALL, device)


def test_size_of_buffers(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """The lists that compute programs read, once it is known how many photons land."""
    monkeypatch.setattr(device, "buffer_limit", 16 * 5000)
    with pytest.raises(SettingsError, match="20000 photons a pass are more than .* lower the ph"):
        prepare(cornell(), replace(SMALL, photons=20000, backend="compute"), device)
    prepare(cornell(), replace(SMALL, photons=20000, backend="fragment"), device).release()


def test_memory_of_a_gpu(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """Textures count there, and what the host holds here."""
    monkeypatch.setattr(device, "is_software", False)
    monkeypatch.setattr(device, "prefers_native", False)
    settings = replace(SMALL, width=1024, height=1024)
    free, compute = 900_000_000, backend_of(Settings(backend="compute"), device)
    monkeypatch.setattr(device, "free_memory", lambda: free, raising=False)
    with pytest.raises(SettingsError, match=r"of memory on .* and 0.9 GB are free; .* pixels"):
        Budget(cornell(), settings, compute)
    free = 1_100_000_000
    assert Budget(cornell(), settings, compute).needed() > free
    monkeypatch.setattr(memory, "free_host_memory", lambda: 500_000_000)
    with pytest.raises(SettingsError, match="of memory and 0.5 GB are free"):
        Budget(cornell(), settings, compute)
    free = None  # a driver that does not tell
    monkeypatch.setattr(memory, "free_host_memory", lambda: None)
    Budget(cornell(), replace(settings, width=16384), compute)


def test_texture_without_room(device: Device) -> None:
    """What the driver refuses is an error that says so; llvmpipe holds 1 to 2 GB a texture."""
    if not device.is_software:
        pytest.skip("a GPU may have room")
    with pytest.raises(StreamError, match="has no room for 16384x16384 texels .*OUT_OF_MEMORY"):
        device.texture((16384, 16384), 4)
    device.check()


def test_free_memory(device: Device) -> None:
    free = memory.free_host_memory()
    if sys.platform == "linux":
        assert free and 1 << 20 < free < 1 << 50
    free = device.free_memory()
    assert free is None or 1 << 20 < free < 1 << 50


def test_free_memory_of_a_driver_that_tells(
    device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The call works: another number that is known here stands in for it."""
    extension, texture_size = sorted(device.ctx.extensions)[0], 0x0D33
    monkeypatch.setattr("addon.streams.driver._FREE_MEMORY", {extension: texture_size})
    assert device.free_memory() == 1024 * device.ctx.info["GL_MAX_TEXTURE_SIZE"]


def many(count: int) -> Scene:
    """A scene's first triangle, so many times."""
    scene = cornell()
    arrays = ("triangles", "corner_normals", "material", "surface")
    return replace(scene, **{name: getattr(scene, name)[[0] * count] for name in arrays})
