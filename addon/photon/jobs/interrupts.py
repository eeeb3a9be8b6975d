# SPDX-License-Identifier: GPL-3.0-or-later
"""Ctrl-C, and the hang-up when a terminal is closed: when they are let in, and by whom.

Every process of a terminal hears of both.
"""

from __future__ import annotations

import contextlib
import os
import signal
import sys
from collections.abc import Callable, Iterator
from types import FrameType

Handler = Callable[[int, FrameType | None], None]

INTERRUPTED = 130  # what a shell expects of a program that Ctrl-C ended: 128 + SIGINT
HUNG_UP = 129  # and of one whose terminal was closed: 128 + SIGHUP
HANGUP: signal.Signals | None = getattr(signal, "SIGHUP", None)  # Windows has none


class Hangup(KeyboardInterrupt):
    """The terminal was closed; whatever Ctrl-C ends in order, this does, too."""


@contextlib.contextmanager
def held_back() -> Iterator[None]:
    """Let neither in, nor into what is started meanwhile until that lets them in itself."""
    with _masked("SIG_BLOCK"):
        yield


@contextlib.contextmanager
def let_in() -> Iterator[None]:
    """Let both in, also those that came while build.py held them back."""
    with _masked("SIG_UNBLOCK"):
        yield


@contextlib.contextmanager
def on_hangup(handler: Handler) -> Iterator[None]:
    """Have `handler` called when the terminal is closed, unless nohup or its like forbids that.

    Once: shell and system both tell of it, and nothing may disturb the end that is under way.
    """
    if HANGUP is None or signal.getsignal(HANGUP) == signal.SIG_IGN:
        yield
        return
    heard = False

    def once(number: int, frame: FrameType | None) -> None:
        nonlocal heard
        heard = True
        signal.signal(number, signal.SIG_IGN)
        handler(number, frame)

    before = signal.signal(HANGUP, once)
    try:
        yield
    finally:
        if not heard:
            # Python does not know a handler of Blender's and gives None for it.
            signal.signal(HANGUP, signal.SIG_DFL if before is None else before)


@contextlib.contextmanager
def raising() -> Iterator[Callable[[], None]]:
    """Let both in and have Ctrl-C raise KeyboardInterrupt, a hang-up Hangup.

    What is yielded raises it again, for loops that would go on: Python drops what is raised while
    it clears up after an object or an import.
    """
    heard: type[KeyboardInterrupt] | None = None

    def interrupt(number: int, frame: FrameType | None) -> None:
        nonlocal heard
        heard = Hangup if number == HANGUP else KeyboardInterrupt
        raise heard

    def check() -> None:
        if heard:
            raise heard

    before = signal.getsignal(signal.SIGINT)
    if before != signal.SIG_IGN:
        signal.signal(signal.SIGINT, interrupt)
    try:
        with on_hangup(interrupt), let_in():
            yield check
    finally:
        # Python does not know a handler of C's and gives None for it.
        signal.signal(signal.SIGINT, signal.SIG_DFL if before is None else before)


def say_last(text: str) -> None:
    """Print `text` as an error, or nowhere if the terminal is gone.

    What cannot be written then is dropped: Python would exit with 120 for it at the very end.
    """
    with contextlib.suppress(OSError):
        print(text, file=sys.stderr, flush=True)
    for stream in filter(None, (sys.stdout, sys.stderr)):
        try:
            stream.flush()
        except OSError:
            null = os.open(os.devnull, os.O_WRONLY)
            os.dup2(null, stream.fileno())
            os.close(null)


@contextlib.contextmanager
def _masked(how: str) -> Iterator[None]:
    if HANGUP is None:
        yield
        return
    before = signal.pthread_sigmask(getattr(signal, how), {signal.SIGINT, HANGUP})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
