# SPDX-License-Identifier: GPL-3.0-or-later
"""There is a barrier where a launch needs what another has done, and nowhere else."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import moderngl
import pytest

from addon.photon.backends.backend import backend_of
from addon.photon.photons.kept import Kept
from addon.photon.prepare import prepare
from addon.photon.settings import Settings
from addon.streams import Device
from addon.streams.bindings import Bindings
from addon.streams.readback import Readback
from tests.measure import assert_same
from tests.scenes import cornell


@dataclass
class Item:
    """A texture or a buffer."""

    glo: int

    def use(self, location: int) -> None:
        """Bind it to read."""

    def bind_to_image(self, unit: int, read: bool, write: bool) -> None:
        """Bind it to write."""

    def bind_to_storage_buffer(self, binding: int) -> None:
        """Bind it to read and write."""


class Launches:
    """Launches on a driver that counts barriers."""

    def __init__(self) -> None:
        self.barriers = 0
        ctx = SimpleNamespace(version_code=430, memory_barrier=self._count)
        self.bind = Bindings(ctx)

    def _count(self) -> None:
        self.barriers += 1

    def run(
        self,
        reads: int | None = None,
        writes: int | None = None,
        lists: int | None = None,
        buffers: int | None = None,
        counts: int | None = None,
    ) -> int:
        """A launch by names of what it uses; how many barriers were before it."""
        bind, before = self.bind, self.barriers
        bind.textures([Item(reads)] if reads else [])
        bind.images([Item(writes)] if writes else [])
        bind.lists([Item(lists)] if lists else [])
        bind.buffers([Item(buffers)] if buffers else [])
        if counts:
            bind.counter(Item(counts), True)
        bind.ready()
        return self.barriers - before


@pytest.mark.parametrize(
    ("first", "second", "expected"),
    [
        ({"writes": 1}, {"reads": 1}, 1),
        ({"reads": 1}, {"writes": 1}, 1),
        ({"writes": 1}, {"writes": 1}, 1),
        ({"reads": 1}, {"reads": 1}, 0),
        ({"reads": 1, "writes": 2}, {"reads": 1, "writes": 3}, 0),
        ({"buffers": 1}, {"lists": 1}, 1),
        ({"lists": 1}, {"buffers": 1}, 1),
        ({"lists": 1}, {"lists": 1}, 0),
        ({"counts": 1}, {"counts": 1}, 0),
        ({"counts": 1}, {"lists": 1}, 1),
        ({"counts": 1}, {"buffers": 1}, 1),
        ({"buffers": 1}, {"counts": 1}, 1),
        ({"lists": 1}, {"counts": 1}, 1),
        ({"writes": 1}, {"buffers": 1}, 0),  # a texture and a buffer
        ({"writes": 1}, {"lists": 1}, 0),
        ({"reads": 1}, {"buffers": 1}, 0),
    ],
)
def test_barrier_between_two(first: dict[str, int], second: dict[str, int], expected: int) -> None:
    launches = Launches()
    assert launches.run(**first) == 0
    assert launches.run(**second) == expected


def test_barrier_is_for_all_before() -> None:
    launches = Launches()
    assert launches.run(writes=1) == launches.run(writes=2) == launches.run(reads=3) == 0
    assert launches.run(reads=1, writes=4) == 1
    assert launches.run(reads=2, writes=3) == 0
    assert launches.run(reads=4) == 1


def test_counter_that_is_not_used() -> None:
    """It is bound all the same."""
    launches = Launches()
    launches.run(buffers=1)
    launches.bind.counter(Item(1), False)
    launches.bind.ready()
    assert launches.barriers == 0


def test_host_reads() -> None:
    """Before it does there is one, if anything was written since the last."""
    launches = Launches()
    launches.bind.settle()
    launches.run(reads=1)
    launches.bind.settle()
    assert launches.barriers == 0
    launches.run(writes=2)
    launches.bind.settle()
    launches.bind.settle()
    assert launches.barriers == 1
    assert launches.run(reads=2, writes=1) == 0


def test_drawing_leaves_nothing_bound() -> None:
    """Of what a draw reads no launch waits for anything, and it is not kept."""
    launches = Launches()
    launches.run(writes=1)
    launches.bind.before_drawing()
    assert launches.barriers == 1
    for texture in range(2, 50):
        launches.bind.textures([Item(texture)])
        launches.bind.before_drawing()
    assert launches.bind._reads == []
    assert launches.run(writes=20) == 0


@pytest.mark.usefixtures("resident")
@pytest.mark.parametrize("estimator", ["gather", "splat"])
def test_nothing_goes_past_barriers(
    device: Device, monkeypatch: pytest.MonkeyPatch, estimator: Any
) -> None:
    """No way to textures and buffers but launches finds what is being written still."""
    calls: Counter[str] = Counter()

    def watched(owner: Any, name: str, of: Callable[..., list[Any]]) -> None:
        real = getattr(owner, name)

        def call(item: Any, *arguments: Any, **named: Any) -> Any:
            for used in of(item, *arguments):
                glo = -used.glo if isinstance(used, moderngl.Buffer) else used.glo
                assert glo not in device.bind._written | device.bind._counted, name
            calls[name] += 1
            return real(item, *arguments, **named)

        monkeypatch.setattr(owner, name, call)

    def both(item: Any, *arguments: Any) -> list[Any]:
        return [item, *(x for x in arguments if isinstance(x, moderngl.Buffer))]

    for owner in (moderngl.Texture, moderngl.Buffer):
        for name in ("read", "read_into", "write"):
            watched(owner, name, both)

    def bound(*_: Any) -> list[Any]:
        return [Item(glo) for glo in device.bind._reads]

    watched(moderngl.VertexArray, "render", bound)
    watched(Readback, "ask", lambda _, buffer, count: [buffer])
    watched(moderngl.Context, "copy_buffer", lambda _, *buffers: list(buffers[:2]))
    watched(moderngl.Framebuffer, "use", lambda item: [*item.color_attachments])
    watched(moderngl.Framebuffer, "clear", lambda item, *_: [*item.color_attachments])
    settings = Settings(
        24,
        16,
        photons=2000,
        passes=10,
        mirror_depth=3,
        backend="compute",
        estimator=estimator,
        caustics=True,
    )
    kept = Kept(device)
    for _ in range(2):  # the second takes the first one's photons
        renderer = prepare(cornell(mirror=True), settings, device, kept)
        for _ in range(settings.passes):
            renderer.render_pass()
        renderer.images()
        renderer.release()
    kept.release()
    used = ["read_into", "write", "copy_buffer", "ask", *["render"] * (estimator == "splat")]
    assert min(calls[name] for name in used) > 0, calls


@pytest.mark.usefixtures("resident")
def test_a_pass_has_fewer_barriers_than_launches(
    device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And the picture is that with one before each launch."""
    settings = Settings(24, 16, photons=2000, passes=3, backend="compute", mirror_depth=3)
    assert backend_of(settings, device).works_alone
    ready, barriers, launched, found = Bindings.ready, 0, 0, []
    barrier = device.bind._barrier

    def counted() -> None:
        nonlocal barriers
        barriers += 1
        barrier()

    def noted(bind: Bindings) -> None:
        nonlocal launched
        launched += 1
        ready(bind)

    def always(bind: Bindings) -> None:
        barrier()
        noted(bind)

    monkeypatch.setattr(device.bind, "_barrier", counted)
    for way in (noted, always):
        monkeypatch.setattr(Bindings, "ready", way)
        renderer = prepare(cornell(mirror=True), settings, device)
        barriers = launched = 0
        for _ in range(settings.passes):
            renderer.render_pass()
        assert 0 < barriers < 0.8 * launched
        found.append(renderer.images())
        renderer.release()
    assert_same(*found)
