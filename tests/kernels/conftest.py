# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.photon.stage.upload import texels_of, upload_table
from addon.streams import Device, Kernel, Made, Stream
from tests.unit.glsl_files import copy_glsl, use_root


@pytest.fixture(scope="session")
def _root_of_kernels(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The real GLSL, and beside it the kernels that these tests have in `glsl`."""
    return copy_glsl(tmp_path_factory.mktemp("glsl"), Path(__file__).parent / "glsl")


@pytest.fixture(autouse=True)
def _kernels_of_tests(_root_of_kernels: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One root for all, so files are read once."""
    use_root(_root_of_kernels, monkeypatch)


@pytest.fixture(params=["fragment", "compute"])
def layer(request: pytest.FixtureRequest, device: Device) -> str:
    """Each physical layer that the device has."""
    if request.param == "compute" and not device.has_compute:
        pytest.skip(f"{device.name} has no compute programs")
    return request.param


class Bench:
    """Runs kernels on arrays: (n, 4) inputs by port, (n, 4) outputs by port."""

    WIDTH = 1024

    def __init__(self, device: Device, layer: Any) -> None:
        self.device, self.layer = device, layer

    def run(
        self,
        kind: type[Kernel],
        inputs: dict[str, NDArray[Any]],
        uniforms: dict[str, Any] | None = None,
        tables: dict[str, NDArray[Any]] | None = None,
        defines: dict[str, int | float] | None = None,
        count: int = 0,
        made: Made | None = None,
        lanes: int = 1,
    ) -> dict[str, Any]:
        """The outputs, and under "alive" how many elements were not skipped.

        Of `inputs` and `uniforms` it takes those that the kernel has. `count`: the number of
        elements, for kernels without inputs; `lanes` share one. Pixels are of a frame of the
        streams' width.
        """
        y, x = np.divmod(np.arange(count or len(next(iter(inputs.values())))), self.WIDTH)
        inputs = {"pixel": np.column_stack([x, y, 0 * x, 0 * x]).astype(np.float32)} | inputs
        count = len(x)
        size = (self.WIDTH, -(-count // self.WIDTH))
        kernel = kind(self.device, self.layer, defines, lanes, made)
        ports = {**kernel.inputs, **kernel.outputs}
        streams = {name: Stream(self.device, record, size) for name, record in ports.items()}
        for name in kernel.inputs:
            texels = np.zeros((size[0] * size[1], 4), np.float32)
            texels[:count] = inputs[name]
            streams[name].upload(texels.reshape(size[1], size[0], 4))
        textures = {
            name: upload_table(self.device, data if data.dtype.names is None else texels_of(data))
            for name, data in (tables or {}).items()
            if name in kernel.tables
        }
        values = {n: value for n, value in (uniforms or {}).items() if n in kernel.uniforms}
        alive = kernel.count(streams, textures, values).wait()
        result: dict[str, Any] = {
            name: streams[name].download().reshape(-1, 4)[:count] for name in kernel.outputs
        }
        for item in (*streams.values(), *textures.values(), kernel):
            item.release()
        return result | {"alive": alive}


@pytest.fixture
def bench(device: Device, layer: str) -> Bench:
    """On each layer."""
    return Bench(device, layer)


@pytest.fixture
def one_bench(device: Device) -> Bench:
    """On the fragment layer: for mathematics that does not depend on it."""
    return Bench(device, "fragment")
