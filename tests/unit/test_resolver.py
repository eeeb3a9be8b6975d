# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures and errors made on the device are those made on the host; programs linked ahead."""

from __future__ import annotations

import math
import os
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import moderngl
import numpy as np
import pytest

from addon.photon.backends import backend as backend_module
from addon.photon.film.device_resolver import DeviceResolver
from addon.photon.film.picture import FEATURES
from addon.photon.film.resolver import HostResolver
from addon.photon.prepare import prepare
from addon.photon.renderer import ALL_IMAGES, Renderer
from addon.photon.scene import Scene
from addon.photon.settings import Settings
from addon.streams import Device
from addon.streams.ahead import Ahead, links_ahead
from addon.streams.linked import Linked
from tests.scenes import cornell
from tests.unit.test_denoiser import needs_it

ROOT = Path(__file__).parents[2]
SETTINGS = Settings(
    width=40, height=24, photons=2048, backend="compute", illuminance=True, passes=9
)
SETTINGS = replace(SETTINGS, denoise=True, denoising_data=True, mist=(1.0, 9.0, 2.0))


def rendered(device: Device, scene: Scene, passes: int) -> Renderer:
    renderer = prepare(scene, replace(SETTINGS, passes=passes), device)
    for _ in range(passes):
        renderer.render_pass()
    return renderer


@needs_it
@pytest.mark.parametrize("rows", [24, 7])  # of a strip at most
@pytest.mark.parametrize(
    "scene",
    [cornell(), cornell(mirror=True), cornell(mirror=True, bulb=True)],
    ids=["diffuse", "mirror", "bulb"],
)
def test_resolvers_agree(
    device: Device, monkeypatch: pytest.MonkeyPatch, scene: Scene, rows: int
) -> None:
    monkeypatch.setattr(backend_module, "STRIP_PIXELS", 40 * rows)
    renderer = rendered(device, scene, 9)
    names = [*renderer.film.films[0].sums]  # type: ignore[union-attr]
    resolver = DeviceResolver(device, renderer.film, names)
    expected, telling = HostResolver(renderer.film).resolve(ALL_IMAGES)
    by_host = telling()
    images, telling = resolver.resolve(ALL_IMAGES)
    error = telling()
    assert (
        images.keys() == expected.keys() >= {"Illuminance", "Mist", "Mirror", "Combined", *FEATURES}
    )
    for name, image in images.items():
        assert image.dtype == np.float32 and image.shape == expected[name].shape
        np.testing.assert_allclose(image, expected[name], rtol=1e-5, atol=1e-7, err_msg=name)
    assert math.isclose(error.noise, by_host.noise, rel_tol=1e-4)
    assert math.isclose(error.bias, by_host.bias, rel_tol=1e-4)
    assert error.image is not None and by_host.image is not None
    np.testing.assert_allclose(error.image, by_host.image, rtol=1e-3)
    few, telling = resolver.resolve(["Combined"])
    assert few.keys() == {"Combined"} and telling() == replace(error, image=None)
    np.testing.assert_array_equal(few["Combined"], images["Combined"])
    halves = resolver.first_half(), HostResolver(renderer.film).first_half()
    assert halves[0].dtype == halves[1].dtype == np.float32 and halves[1].mean() > 0.0
    np.testing.assert_allclose(*halves, rtol=1e-5, atol=1e-6)
    resolver.release()
    renderer.release()


def test_a_few_passes_tell_no_error(device: Device) -> None:
    renderer = rendered(device, cornell(), 2)
    resolver = DeviceResolver(device, renderer.film, ["blur"])
    assert resolver.resolve([])[1]().total == math.inf
    resolver.release()
    renderer.release()


def test_texels_are_shown_where_the_device_writes(
    device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(device, "is_software", False)
    for size in ((8, 4), (64, 48), (16, 2)):
        texture = device.ctx.texture(size, 4, dtype="f4")
        texels = np.random.default_rng(size[0]).random((size[0] * size[1], 4), np.float32)
        texture.write(texels)
        for count in (3, len(texels)):
            np.testing.assert_array_equal(device.shown(texture, count), texels[:count])
        texture.release()


TEXT = """#version 430 core
layout(local_size_x = 1) in;
layout(std430, binding = 0) buffer Out { uint value[]; };
void main() { value[0] = 7u; }
"""


def test_programs_are_linked_ahead(device: Device) -> None:
    """What was begun ends as what moderngl makes of the same text; a refusal is moderngl's own."""
    ahead = links_ahead(device.ctx)
    begun = ahead.begin(TEXT)
    assert begun or "GL_KHR_parallel_shader_compile" not in device.ctx.extensions
    program = ahead.end(begun, lambda: device.ctx.compute_shader(TEXT))
    out = device.ctx.buffer(bytes(4))
    out.bind_to_storage_buffer(0)
    program.run()
    assert out.read() == (7).to_bytes(4, "little")
    wrong = TEXT.replace("7u", "nothing")
    with pytest.raises(moderngl.Error, match="nothing"):
        ahead.end(ahead.begin(wrong), lambda: device.ctx.compute_shader(wrong))


def test_who_finds_nothing_links_nothing_ahead() -> None:
    """Without a cache every program would be linked twice."""
    assert Ahead({}).begin(TEXT) == 0
    slow = Ahead({"glGetProgramiv": lambda *_: None, "glDeleteProgram": lambda _: None})
    slow.end(1, lambda: time.sleep(0.3))
    assert slow.begin(TEXT) == 0


def test_programs_wait_to_be_run() -> None:
    """Their uniforms are kept until then, and what the driver says against them."""
    made: list[dict[str, float]] = []

    class Program(dict):  # type: ignore[type-arg]
        def release(self) -> None:
            made.clear()

    class Member:
        value = 0.0

    def link() -> Program:
        made.append({})
        return Program(scale=Member())

    linked = Linked(link)
    linked.set("scale", 2.0)
    linked.set("unused", 1.0)
    assert not made
    assert linked.program["scale"].value == 2.0 and len(made) == 1
    linked.set("scale", 3.0)
    assert linked.program["scale"].value == 3.0 and len(made) == 1
    linked.release()
    assert not made


FIRST_HALF = """
import hashlib
from types import SimpleNamespace
import numpy as np
from addon.photon.film.picture import first_half
names = ("combined", "direct", "indirect", "mirror", "mirror_indirect")
numbers = np.random.default_rng(1)
means, halves = ({name: numbers.random((16, 16, 4)) for name in names} for _ in range(2))
found = first_half(SimpleNamespace(means=means, halves=halves))
print(hashlib.sha256(found.tobytes()).hexdigest())
"""


def test_halves_add_up_the_same_in_each_process() -> None:
    """Whatever order strings have in its sets: floats do not add up in any."""
    found = set()
    for seed in range(4):
        done = subprocess.run(
            [sys.executable, "-c", FIRST_HALF],
            cwd=ROOT,
            env=os.environ | {"PYTHONHASHSEED": str(seed)},
            capture_output=True,
            text=True,
            check=True,
            timeout=60,
        )
        found.add(done.stdout)
    assert len(found) == 1
