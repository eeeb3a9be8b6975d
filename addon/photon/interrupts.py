# SPDX-License-Identifier: GPL-3.0-or-later
"""Ctrl-C, of which every process of a terminal hears: when it is let in, and by whom."""

from __future__ import annotations

import contextlib
import os
import signal
from collections.abc import Iterator


@contextlib.contextmanager
def held_back() -> Iterator[None]:
    """Let no Ctrl-C in, nor into what is started meanwhile until that lets it in itself."""
    with _masked("SIG_BLOCK"):
        yield


@contextlib.contextmanager
def let_in() -> Iterator[None]:
    """Let Ctrl-C in, also one that came while build.py held it back."""
    with _masked("SIG_UNBLOCK"):
        yield


@contextlib.contextmanager
def _masked(how: str) -> Iterator[None]:
    if os.name != "posix":
        yield
        return
    before = signal.pthread_sigmask(getattr(signal, how), {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
