# SPDX-License-Identifier: GPL-3.0-or-later
"""HostKernel: a kernel whose elements the host computes."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping
from typing import Any

from numpy.typing import NDArray

from .device import Device
from .kernel import Kernel, Placed
from .stream import Stream
from .tally import Tally


class HostKernel(Kernel):
    """A kernel without GLSL: its inputs come to the host, its output goes back.

    For software OpenGL, where both are copies within the same memory. Ports and uniforms are
    declared and checked as every kernel's.
    """

    def __init__(self, device: Device) -> None:
        self.device, self.launches = device, 0

    @abstractmethod
    def compute(
        self,
        inputs: Mapping[str, NDArray[Any]],
        tables: Mapping[str, Any],
        uniforms: Mapping[str, Any],
    ) -> Any:
        """The output from the inputs, float32 (h, w, 4), or a tuple of several; tables are what the
        host reads."""

    def _launch(
        self,
        streams: Mapping[str, Stream],
        tables: Mapping[str, Any],
        uniforms: Mapping[str, Any],
        count: bool | Tally,
    ) -> Callable[[], int]:
        """As Kernel's; what counts are the elements of the first output that are not zero, and
        there is no wait."""
        assert not isinstance(count, Tally)  # that is on a device
        self._check_bindings(streams, tables, uniforms)
        self.launches += 1
        inputs = {name: streams[name].download() for name in self.inputs}
        found = self.compute(inputs, tables, uniforms)
        outputs = found if isinstance(found, tuple) else (found,)
        for name, output in zip(self.outputs, outputs, strict=True):
            streams[name].upload(output)
        alive = int(outputs[0].any(axis=-1).sum()) if count else 0
        return lambda: alive

    @staticmethod
    def placed(table: Placed) -> Any:
        """As Kernel's."""
        return table.on_host

    def release(self) -> None:
        """Nothing is held on the device."""
