# SPDX-License-Identifier: GPL-3.0-or-later
"""RendererProcess: when it or its parent ends, that is said, and nothing is left behind."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from addon.photon.errors import RenderError
from addon.photon.jobs.process import RendererProcess
from addon.photon.settings import Settings
from tests.process.renders import HUGE, LONG, SMALL, alive, finish, linux, start, wait_for
from tests.scenes import cornell

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("settings", [LONG, HUGE], ids=["small passes", "huge passes"])
def test_killed_mid_render(process: RendererProcess, settings: Settings) -> None:
    events = start(process, settings)
    assert process.pid
    os.kill(process.pid, signal.SIGKILL)
    begun = time.monotonic()
    with pytest.raises(RenderError, match="the renderer process ended by signal 9"):
        for _ in events:
            assert time.monotonic() - begun < 2
    assert process.pid is None and process._folder is None
    finish(process)


def test_killed_between_renders(process: RendererProcess) -> None:
    """Found out before the next render: nobody sees it."""
    finish(process)
    pid = process.pid
    assert pid
    os.kill(pid, signal.SIGKILL)
    wait_for(lambda: process.pid is None, 2)
    finish(process)
    assert process.pid != pid


def test_crash_says_what_the_child_said(tmp_path: Path) -> None:
    """The last line of its log is in the message."""
    fake = tmp_path / "python"
    fake.write_text("#!/bin/sh\necho driver said no >&2\nexit 3\n")
    fake.chmod(0o755)
    process = RendererProcess(str(fake))
    with pytest.raises(RenderError, match="ended with code 3: driver said no"):
        list(process.render(cornell(), SMALL))
    assert process.pid is None and process._folder is None


@linux
@pytest.mark.parametrize("name", ["INT", "HUP"])
def test_child_never_hears_of_ctrl_c_or_hang_up(tmp_path: Path, name: str) -> None:
    """Nor before its first line: it would end with a traceback."""
    fake = tmp_path / "python"
    fake.write_text(f"#!/bin/sh\nkill -{name} $$\necho still here >&2\nexit 3\n")
    fake.chmod(0o755)
    with pytest.raises(RenderError, match="ended with code 3: still here"):
        list(RendererProcess(str(fake)).render(cornell(), SMALL))
    assert not {signal.SIGINT, signal.SIGHUP} & signal.pthread_sigmask(signal.SIG_BLOCK, ())


def test_child_that_cannot_start() -> None:
    process = RendererProcess("/nonexistent/python")
    for _ in range(2):
        with pytest.raises(RenderError, match="cannot start the renderer with /nonexistent/python"):
            list(process.render(cornell(), SMALL))
        assert process.pid is None and process._folder is None


# What is left behind.


@linux
def test_close_leaves_nothing(process: RendererProcess) -> None:
    finish(process)
    folder, pid = process._folder, process.pid
    assert folder and folder.is_dir() and pid
    process.close()
    assert not folder.exists()
    assert not Path(f"/proc/{pid}").exists()  # not even a zombie
    assert process.pid is None
    process.close()  # again: nothing to do
    finish(process)


@linux
def test_close_mid_render_leaves_nothing(process: RendererProcess) -> None:
    events = start(process, HUGE)
    folder, pid = process._folder, process.pid
    begun = time.monotonic()
    events.close()
    process.close()
    assert time.monotonic() - begun < 1
    assert folder and not folder.exists() and not Path(f"/proc/{pid}").exists()


PARENT = """
import sys, time
from addon.photon.jobs.process import RendererProcess
from addon.photon.settings import Settings
from tests.scenes import cornell
process = RendererProcess()
settings = Settings(width=24, height=16, photons=int(sys.argv[1]), passes=1 << 20)
events = process.render(cornell(), settings)
for event in events:
    if event.phase != "Starting":
        print(process.pid, process._folder, flush=True)
        break
time.sleep(60)
"""


ENDS = [(1000, "kill"), (1 << 20, "kill"), (1000, "group"), (1000, "renderer first")]


@pytest.fixture(params=ENDS, ids=str)
def orphan(request: pytest.FixtureRequest) -> Any:
    """(pid, folder) of a renderer whose parent was killed mid-render, or with it their group, as
    build.py passes a termination on."""
    photons, how = request.param
    command = [sys.executable, "-c", PARENT, str(photons)]
    with subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.PIPE, text=True, process_group=0
    ) as parent:
        assert parent.stdout
        pid, folder = parent.stdout.readline().split()
        assert alive(int(pid))
        if how == "group":
            os.killpg(parent.pid, signal.SIGTERM)
        if how == "renderer first":
            os.kill(int(pid), signal.SIGTERM)
            time.sleep(0.7)
        parent.kill()
    yield int(pid), Path(folder)
    # The watch that the renderer left behind may be clearing it up at this very moment.
    shutil.rmtree(folder, ignore_errors=True)


@linux
def test_child_ends_with_its_parent(orphan: tuple[int, Path]) -> None:
    pid, _ = orphan
    print(f"outlived its parent by {wait_for(lambda: not alive(pid), 3):.2f} s")


@linux
def test_orphan_leaves_no_shared_memory(orphan: tuple[int, Path]) -> None:
    _, folder = orphan
    wait_for(lambda: not folder.exists(), 3)
