# SPDX-License-Identifier: GPL-3.0-or-later
"""Device.program: each program is compiled once on a device, whoever uses it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest

from addon.photon.prepare import prepare
from addon.photon.settings import Settings
from addon.streams import Device, Kernel, Program, Stream, StreamError, Uniform
from tests.scenes import cornell
from tests.unit.glsl_files import VALUE, declare, write

DOUBLE = "void kernel() { store_b(Value(factor * load_a().value)); }\n"


@pytest.fixture
def compiled(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """The programs that OpenGL is asked to compile in a test."""
    made: list[Any] = []
    for name in ("program", "compute_shader"):
        compile_ = getattr(moderngl.Context, name)

        def spy(*args: Any, _compile: Any = compile_, **kwargs: Any) -> Any:
            made.append(_compile(*args, **kwargs))
            return made[-1]

        monkeypatch.setattr(moderngl.Context, name, spy)
    return made


@pytest.fixture
def new_device() -> Iterator[Device]:
    """A device that has compiled nothing yet."""
    made = Device()
    yield made
    made.check()
    made.release()


def multiplier(device: Device, layer: Any, root: Path) -> Kernel:
    write(root, "kernels/probe.glsl", DOUBLE)
    ports = {"inputs": {"a": VALUE}, "outputs": {"b": VALUE}}
    return declare("probe", **ports, uniforms={"factor": Uniform("float")})(device, layer)


def product(kernel: Kernel, factor: float) -> float:
    """What the kernel makes of one."""
    a, b = (Stream(kernel.device, VALUE, (2, 2)) for _ in range(2))
    a.upload(np.ones((2, 2, 4), np.float32))
    kernel.run({"a": a, "b": b}, uniforms={"factor": factor})
    result = b.download()
    for stream in (a, b):
        stream.release()
    assert (result == result[0, 0, 0]).all()
    return float(result[0, 0, 0])


def test_released_by_one_kept_for_the_other(
    device: Device, layer: str, root: Path, compiled: list[Any]
) -> None:
    """Two kernels of one text share a program, and neither disturbs the other."""
    first, second = (multiplier(device, layer, root) for _ in range(2))
    assert len(compiled) == 1
    assert (product(first, 3.0), product(second, 5.0), product(first, 7.0)) == (3.0, 5.0, 7.0)
    first.release()
    assert product(second, 2.0) == 2.0
    second.release()
    third = multiplier(device, layer, root)
    assert len(compiled) == 1 and product(third, 4.0) == 4.0
    third.release()


def test_refused_again_each_time(device: Device, root: Path) -> None:
    """A text that the driver refused is not taken for one that it compiled."""
    write(root, "kernels/probe.glsl", "void kernel() { store_b(nonsense); }\n")
    for _ in range(2):
        with pytest.raises(StreamError, match=r"kernels/probe\.glsl:1"):
            declare("probe", outputs={"b": VALUE})(device, "fragment")


@pytest.mark.thorough("compute-splat", "fragment-gather")
@pytest.mark.parametrize("estimator", ["gather", "splat"])
def test_second_renderer_compiles_nothing(
    new_device: Device, layer: str, compiled: list[Any], estimator: Any
) -> None:
    settings = Settings(width=8, height=8, photons=256, backend=layer, estimator=estimator)
    new_device.prefers_native = False  # the device's programs for lists, too
    counts, pictures = [], []
    for _ in range(3):
        renderer = prepare(cornell(mirror=True, lobe=True), settings, new_device)
        renderer.render_pass()
        pictures.append(renderer.images()["Combined"].tobytes())
        renderer.release()
        counts.append(len(compiled))
    print(f"programs compiled after each renderer: {counts}")
    assert counts[0] > 10 and counts[2] == counts[1] == counts[0]
    assert pictures[0] == pictures[1] == pictures[2]


def test_freed_with_the_device(compiled: list[Any]) -> None:
    device = Device()
    renderer = prepare(cornell(), Settings(width=8, height=8, photons=256), device)
    if device.has_compute:
        Program(device, "fill_zero")
    renderer.release()
    assert compiled
    assert not any(isinstance(program.mglo, moderngl.InvalidObject) for program in compiled)
    device.release()
    assert all(isinstance(program.mglo, moderngl.InvalidObject) for program in compiled)
