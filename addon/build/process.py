# SPDX-License-Identifier: GPL-3.0-or-later
"""Run other programs, and end with a message where one fails."""

from __future__ import annotations

import contextlib
import ctypes
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path


class Failure(Exception):
    """Ends build.py with its message and exit code 1."""


def say(message: str) -> None:
    print(message, file=sys.stderr, flush=True)


def apt(packages: str) -> str:
    """The command that installs Debian packages; elsewhere it says what to look for."""
    root = os.name == "posix" and os.geteuid() == 0
    return f"{'' if root else 'sudo '}apt install {packages}"


def absent_libraries(packages: dict[str, str]) -> list[str]:
    """Of {shared library: the Debian package that holds it}, the packages that are not there."""
    absent = []
    for library, package in packages.items() if sys.platform == "linux" else ():
        try:
            ctypes.CDLL(library)
        except OSError:
            absent.append(package)
    return absent


@contextlib.contextmanager
def blocked(signals: Iterable[int]) -> Iterator[None]:
    """Hold signals back, here and in what is started meanwhile, until that lets them in."""
    if os.name != "posix":
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, signals)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def hangup() -> list[signal.Signals]:
    """The signal that the terminal was closed, unless nohup or its like forbids to hear of it."""
    number: signal.Signals | None = getattr(signal, "SIGHUP", None)  # Windows has none
    if number is None or signal.getsignal(number) == signal.SIG_IGN:
        return []
    return [number]


def run(
    command: Sequence[str | Path],
    env: dict[str, str] | None = None,
    cwd: Path | None = None,
    held: Iterable[int] = (),
) -> int:
    """Run to the end and return the exit code; pass Ctrl-C, termination and the closing of the
    terminal on, once each.

    The child has a process group of its own, so that it hears of these from us only, and the
    same way whether that came from the terminal or from `kill`. It starts with the signals `held`
    blocked: it lets them in when it can stop in order, and its exit code tells whether it did.
    """
    child: subprocess.Popen[bytes] | None = None
    received: list[int] = []

    def pass_on(number: int, _frame: object) -> None:
        received.append(number)
        if child is not None and os.name == "posix":
            os.killpg(child.pid, number)

    numbers = [signal.SIGINT, signal.SIGTERM, *hangup()]
    before = {n: signal.signal(n, pass_on) for n in numbers}
    try:
        own_group = 0 if os.name == "posix" else None
        with blocked(held):
            child = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, env=env, cwd=cwd, process_group=own_group
            )
            if received and os.name == "posix":  # while it was starting
                os.killpg(child.pid, received[0])
        code = child.wait()
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    if received and not (held and code == 0):
        raise SystemExit(128 + received[0])
    return code if code >= 0 else 128 - code


def first_line(*command: str, env: dict[str, str] | None = None) -> str | None:
    """The first line that a program prints, None if it cannot be run."""
    where = shutil.which(command[0], path=env["PATH"] if env else None)
    if where is None:
        return None
    try:
        done = subprocess.run(
            [where, *command[1:]], env=env, capture_output=True, text=True, check=False, timeout=60
        )
    except (OSError, subprocess.TimeoutExpired):
        return None
    lines = done.stdout.strip().splitlines()
    return lines[0].strip() if done.returncode == 0 and lines else None
