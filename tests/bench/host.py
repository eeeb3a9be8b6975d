# SPDX-License-Identifier: GPL-3.0-or-later
"""What benchmarks say of the machine and of their own process."""

from __future__ import annotations

import os
import platform
from pathlib import Path

CORES = os.cpu_count() or 1


def resident(field: str) -> int:
    """This process's resident memory now, VmRSS, or at most, VmHWM [bytes]; 0 if unknown.

    Not getrusage's: that begins with what the parent had.
    """
    file = Path("/proc/self/status")
    lines = file.read_text().splitlines() if file.exists() else []
    return sum(1024 * int(line.split()[1]) for line in lines if line.startswith(f"{field}:"))


def processor() -> str:
    """Model and cores."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        model = next(line.split(":")[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        model = platform.machine()
    return f"{model}, {CORES} cores"
