# SPDX-License-Identifier: GPL-3.0-or-later
"""Allocations that fail, one after the other: one error, no leak, and the next render is right."""

from __future__ import annotations

import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from addon.photon.errors import PhotonStreamError, SceneError
from addon.photon.jobs.process import Images, RendererProcess
from addon.photon.scene import Scene
from addon.photon.settings import Settings
from tests.scenes import cornell
from tests.stability.failing import ask, counted, failing_python
from tests.stability.table import Measured
from tests.stability.test_interruptions import same
from tests.stability.test_leaks import MOST_GROWTH, held_by, linux

SETTINGS = Settings(width=24, height=16, photons=300, passes=1)


def broken() -> Scene:
    """A renderer process refuses it, and opens its device anew for the next render."""
    triangles = cornell().triangles.copy()
    triangles[0, 0] = -1
    return replace(cornell(), triangles=triangles)


def grown(sizes: list[float]) -> float:
    """By how much the second half needs more: it goes up and down by 10 MB from one to the next."""
    half = len(sizes) // 2
    return min(sizes[half:]) - min(sizes[:half])


class Failing:
    """Renders in a process in which allocations of one kind fail when told to."""

    def __init__(self, folder: Path, kind: str, backend: str) -> None:
        self._folder, self._kind = folder, kind
        self._settings = replace(SETTINGS, backend=backend)
        self.process = RendererProcess(failing_python(folder))
        self.expected: Images = {}

    def __enter__(self) -> Failing:
        self.expected = self.render(0)
        return self

    def __exit__(self, *_: object) -> None:
        self.process.close()

    def render(self, number: int, scene: Scene | None = None, **layers: Any) -> Images:
        """Let that allocation fail, 0: none."""
        ask(self._folder, number, self._kind)
        scene = scene or cornell()
        *_, last = self.process.render(scene, self._settings, previews=False, **layers)
        assert last.done and last.images
        return last.images

    def reopen(self) -> None:
        """Have the process open its device anew."""
        with pytest.raises(SceneError, match="is outside"):
            self.render(0, broken())

    def allocations(self) -> int:
        """How many a render makes on a device that was just opened."""
        self.reopen()
        self.render(0)
        self.render(0)
        return counted(self._folder)

    def error(self, number: int) -> str:
        """What a render says in which that one fails; the next one is as ever."""
        self.reopen()
        try:
            found = self.render(number)
        except PhotonStreamError as error:
            said = f"{type(error).__name__}: {error}"
        else:  # a GPU's driver had room when what could be used again was given back
            assert self._kind == "memory" and same(found, self.expected)
            said = "a picture"
        assert same(self.render(0), self.expected)
        return said

    def resident_after(self, number: int) -> float:
        """The process's memory [MB] after that error."""
        self.error(number)
        return self.resident()

    def resident(self) -> float:
        """The process's memory [MB]."""
        assert self.process.pid
        return held_by(self.process.pid)[0] / 1e6


@linux
@pytest.mark.stability(50)
@pytest.mark.parametrize("kind", ["refused", "memory", "host"])
def test_every_allocation(tmp_path: Path, measured: Measured, thorough: bool, kind: str) -> None:
    """On every backend; by default a few on one. The process lives on, and does not grow."""
    for backend in ("native", "fragment", "compute") if thorough else ("auto",):
        with Failing(tmp_path, kind, backend) as failing:
            total, pid = failing.allocations(), failing.process.pid
            wanted = range(1, total + 1) if thorough else sorted({1, 2, total // 2, total})
            said = [failing.error(number) for number in wanted]
            sizes = [failing.resident_after(n) for n in [*range(1, total + 1, -(-total // 8))] * 2]
            growth = grown(sizes)
            assert failing.process.pid == pid
        print(f"{backend}, {kind}: {total} places; {sorted({text[:75] for text in said})}")
        assert not any("internal error" in text for text in said), said
        assert any(text != "a picture" for text in said)
        measured(f"{backend}, {kind}: places of {total}", len(wanted))
        assert measured("memory more, in MB", growth) <= MOST_GROWTH / 1e6


@linux
@pytest.mark.stability(50)
def test_other_view_layers_make_room(tmp_path: Path, measured: Measured) -> None:
    """Where there is no room beside what other view layers keep, there is without it."""
    sizes = []
    with Failing(tmp_path, "memory", "auto") as failing:
        half = failing.allocations() // 2
        failing.reopen()
        for _ in range(12):
            for number, name in ((0, "one"), (half, "other")):
                found = failing.render(number, layer=name, layers=2)
                assert same(found, failing.expected)
            sizes.append(failing.resident())
    assert measured("memory more, in MB", grown(sizes[2:])) <= MOST_GROWTH / 1e6


@linux
@pytest.mark.stability(50)
def test_little_memory(tmp_path: Path, measured: Measured, thorough: bool) -> None:
    """Whatever the system still gives the process: a picture or one error."""
    settings = replace(SETTINGS, width=256, height=256, photons=100_000)
    found = []
    for megabytes in range(200, 1500, 50) if thorough else (250, 450, 700):
        python = tmp_path / "python"
        python.write_text(f'#!/bin/sh\nulimit -v {megabytes}000\nexec {sys.executable} "$@"\n')
        python.chmod(0o755)
        process, begun = RendererProcess(str(python)), time.monotonic()
        try:
            done = False
            for event in process.render(cornell(), settings, previews=False):
                assert time.monotonic() - begun < 30, f"hangs at {megabytes} MB"
                done = event.done
            found.append("a picture" if done else "nothing")
        except PhotonStreamError as error:
            found.append(str(error))
            assert "\n" not in found[-1]
        finally:
            process.close()
        print(f"{megabytes} MB: {found[-1]}")
    assert "nothing" not in found
    errors = len(found) - found.count("a picture")
    assert measured(f"errors of {len(found)} limits", errors) > 0
