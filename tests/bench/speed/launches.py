# SPDX-License-Identifier: GPL-3.0-or-later
"""Which kernels a pass runs, how long each takes on the device, and what bytes move."""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import moderngl

from addon.photon.backends.native_kernels import NativeTracer
from addon.photon.backends.native_photon_grid import NativePhotonGrid
from addon.photon.photons.device_photon_mapper import DevicePhotonMapper
from addon.photon.photons.native_photon_mapper import NativePhotonMapper
from addon.photon.photons.photon_grid import PhotonGrid
from addon.photon.photons.photon_mapper import PhotonMapper
from addon.photon.photons.splats import Splats
from addon.streams import Device, HostKernel, Kernel, Program, Stream

PHOTONS, PHOTON_MAP, EYE = "photons", "photon map", "eye"  # the parts of a pass
TEXEL_BYTES = 16
# A timer query of OpenGL counts nanoseconds in 32 bits.
LONGEST_QUERY = 2.0  # [s]


@dataclass
class Spent:
    """What a kernel took in a pass."""

    seconds: float = 0.0
    launches: int = 0
    moved: int = 0  # [B] of the streams at its ports, each read or written once; tables not counted


class Timer:
    """A device's timer queries; moderngl frees none, so all watches share them."""

    def __init__(self, device: Device) -> None:
        self.device = device
        self._queries: list[Any] = []

    def query(self, number: int) -> Any:
        """The query of a watch's launch."""
        while number >= len(self._queries):
            self._queries.append(self.device.ctx.query(time=True))
        return self._queries[number]


@contextmanager
def replaced(patches: Mapping[tuple[Any, str], Callable[[Any], Any]]) -> Iterator[None]:
    """Classes with some functions wrapped: {(class, name): wrapper of the function it has}."""
    before = {place: vars(place[0])[place[1]] for place in patches}
    try:
        for (kind, name), wrap in patches.items():
            setattr(kind, name, wrap(before[kind, name]))
        yield
    finally:
        for (kind, name), function in before.items():
            setattr(kind, name, function)


@dataclass
class Watch:
    """Times each launch within a `with watch.watching()` block.

    By timer queries, or with `waits` by the clock, the device waited for before and after. Host
    kernels always by the clock. A part of the pass that launches nothing is one launch itself.
    """

    timer: Timer
    waits: bool
    spent: dict[tuple[str, str], Spent] = field(default_factory=lambda: defaultdict(Spent))
    wall: float = 0.0  # [s] of the pass watched
    to_host: int = 0  # [B] copied from the device
    to_device: int = 0

    def __post_init__(self) -> None:
        self._part, self._names = EYE, ["other"]
        self._waiting = False  # within a launch that the clock times
        self._queried: list[tuple[Spent, Any]] = []

    @contextmanager
    def watching(self) -> Iterator[None]:
        """Watch every launch; `spent` is complete at the end."""
        runs = {
            (kind, "_launch"): self._named(lambda kernel: str(kernel.stem), hosts=kind)
            for kind in kernel_classes()
        }
        runs[NativeTracer, "hits"] = self._named(
            lambda kernel: str(kernel.stem), hosts=NativeTracer
        )
        runs[Program, "run"] = self._named(lambda kernel: str(kernel.stem), hosts=Program)
        parts = {
            (DevicePhotonMapper, "start"): self._as_part(PHOTONS),
            (DevicePhotonMapper, "finish"): self._as_part(PHOTONS, works=False),
            (PhotonMapper, "start"): self._as_part(PHOTONS),
            (NativePhotonMapper, "start"): self._as_part(PHOTONS),
            (PhotonGrid, "prepare"): self._as_part(PHOTON_MAP),
            (NativePhotonGrid, "prepare"): self._as_part(PHOTON_MAP),
            (Splats, "prepare"): self._as_part(PHOTON_MAP),
        }
        launches = {
            (moderngl.ComputeShader, "run"): self._timed,
            (moderngl.VertexArray, "render"): self._timed,
        }
        with replaced(runs | parts | launches | self._copies()):
            yield
        for spent, query in self._queried:
            spent.seconds += query.elapsed * 1e-9
        self._queried.clear()

    @property
    def seconds(self) -> float:
        """Of all launches."""
        return sum(spent.seconds for spent in self.spent.values())

    def of(self, stem: str, part: str | None = None) -> Spent:
        """All launches of a kernel, or those in a part of the pass."""
        total = Spent()
        for (where, name), spent in self.spent.items():
            if name == stem and part in (None, where):
                total.seconds += spent.seconds
                total.launches += spent.launches
                total.moved += spent.moved
        return total

    def _named(self, name: Callable[[Any], str], hosts: Any = None) -> Any:
        """Launches within are of this name; a host kernel is one launch itself."""

        def wrap(function: Any) -> Any:
            def run(kernel: Any, *args: Any, **kwargs: Any) -> Any:
                self._names.append(name(kernel))
                streams = args[0] if args and isinstance(kernel, Kernel) else {}
                moved = sum(
                    stream.size[0] * stream.size[1] * TEXEL_BYTES
                    for stream in streams.values()
                    if isinstance(stream, Stream)
                )
                self.spent[self._part, self._names[-1]].moved += moved
                try:
                    if isinstance(hosts, type) and issubclass(hosts, HostKernel):
                        return self._by_clock(lambda: function(kernel, *args, **kwargs))
                    return function(kernel, *args, **kwargs)
                finally:
                    self._names.pop()

            return run

        return wrap

    def _as_part(self, part: str, works: bool = True) -> Any:
        """Launches within are of this part; it `works` on the host if there are none."""

        def wrap(function: Any) -> Any:
            def run(*args: Any, **kwargs: Any) -> Any:
                before, self._part = self._part, part
                launched = sum(spent.launches for spent in self.spent.values())
                start = time.perf_counter()
                try:
                    result = function(*args, **kwargs)
                finally:
                    self._part = before
                if works and sum(spent.launches for spent in self.spent.values()) == launched:
                    own = self.spent[part, "on the host"]
                    own.launches += 1
                    own.seconds += time.perf_counter() - start
                return result

            return run

        return wrap

    def _timed(self, function: Any) -> Any:
        def run(*args: Any, **kwargs: Any) -> Any:
            if self.waits:
                return self._by_clock(lambda: function(*args, **kwargs))
            spent = self.spent[self._part, self._names[-1]]
            spent.launches += 1
            query = self.timer.query(len(self._queried))
            self._queried.append((spent, query))
            with query:
                return function(*args, **kwargs)

        return run

    def _by_clock(self, launch: Callable[[], Any]) -> Any:
        if self._waiting:
            return launch()
        finish = self.timer.device.ctx.finish
        finish()
        start = time.perf_counter()
        self._waiting = True
        try:
            result = launch()
        finally:
            self._waiting = False
        finish()
        spent = self.spent[self._part, self._names[-1]]
        spent.seconds += time.perf_counter() - start
        spent.launches += 1
        return result

    def _copies(self) -> dict[tuple[Any, str], Any]:
        """Count what goes between host and device."""

        def up(data_at: int) -> Any:
            def wrap(function: Any) -> Any:
                def run(*args: Any, **kwargs: Any) -> Any:
                    data = kwargs.get("data", args[data_at] if len(args) > data_at else None)
                    self.to_device += memoryview(data).nbytes if data is not None else 0
                    return function(*args, **kwargs)

                return run

            return wrap

        def down(size: Callable[[Any], int]) -> Any:
            def wrap(function: Any) -> Any:
                def run(source: Any, *args: Any, **kwargs: Any) -> Any:
                    self.to_host += size(source)
                    return function(source, *args, **kwargs)

                return run

            return wrap

        def texels(texture: Any) -> int:
            return int(texture.width * texture.height * texture.components * 4)

        return {
            (moderngl.Texture, "write"): up(1),
            (moderngl.Buffer, "write"): up(1),
            (moderngl.Context, "texture"): up(3),
            (moderngl.Context, "buffer"): up(1),
            (moderngl.Texture, "read"): down(texels),
            (moderngl.Texture, "read_into"): down(texels),
            (moderngl.Buffer, "read"): down(lambda buffer: buffer.size),
        }


def kernel_classes() -> list[type[Kernel]]:
    """Kernel and those below it that run in a way of their own."""
    found: list[type[Kernel]] = []
    waiting: list[type[Kernel]] = [Kernel]
    while waiting:
        kind = waiting.pop()
        waiting += kind.__subclasses__()
        if "_launch" in vars(kind):
            found.append(kind)
    return found
