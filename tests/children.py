# SPDX-License-Identifier: GPL-3.0-or-later
"""Programs that a test starts, and ends whatever happens."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

STOPS_WITHIN = 120.0  # [s] on the slowest of machines: what takes longer never ends


@contextmanager
def child(command: Sequence[str | Path], **keywords: Any) -> Iterator[subprocess.Popen[Any]]:
    """Popen, which by itself waits for a program that a failed test has left running."""
    with subprocess.Popen(command, **keywords) as process:
        try:
            yield process
        except BaseException:
            process.terminate()  # build.py passes that on to what it started
            try:
                process.wait(10.0)
            except subprocess.TimeoutExpired:
                process.kill()
            raise
