# SPDX-License-Identifier: GPL-3.0-or-later
"""What a render under way says on a terminal and in Blender's status line."""

from __future__ import annotations

import contextlib
import math
import shutil
import sys

from .process import DENOISING, Progress, last_error


class ProgressLine:
    """One line on a terminal that follows a render."""

    def show(self, progress: Progress) -> None:
        """Draw over the last line."""
        columns = shutil.get_terminal_size().columns
        text = status_text(progress)
        room = max(10, min(40, columns - len(text) - 4))
        filled = room * progress.passes_done // max(1, progress.passes)
        line = f"[{'=' * filled}{' ' * (room - filled)}] {text}"
        _draw(f"\r\x1b[K{line[: columns - 1]}")

    def clear(self) -> None:
        """Leave the line."""
        _draw("\r\x1b[K")


def _draw(text: str) -> None:
    # A terminal that was closed is no error here; whoever renders hears of that by a signal.
    with contextlib.suppress(OSError):
        sys.stderr.write(text)
        sys.stderr.flush()


def status_text(progress: Progress) -> str:
    """Return the line that Blender shows while it renders."""
    parts = [progress.phase]
    if progress.passes_done and progress.phase != DENOISING:
        parts = [
            f"Pass {progress.passes_done}/{progress.passes}",
            f"{count_text(progress.photons)} photons",
        ]
        if known := last_error(progress.info):
            parts.append(error_text(*known))
        if math.isfinite(progress.remaining) and not progress.done:
            parts.append(f"Remaining {clock_text(progress.remaining)}")
    return " | ".join(parts)


def error_text(error: float, noise: float, bias: float) -> str:
    """Return e.g. 'Error 1.3 % (noise 1.1 %, bias 0.62 %)'."""
    total, *parts = (
        f"{100 * x:.2g} %" if x < 1 else f"{100 * x:.0f} %" for x in (error, noise, bias)
    )
    return f"Error {total} (noise {parts[0]}, bias {parts[1]})"


def count_text(count: int) -> str:
    """Return 262144 as '262 k'."""
    for size, unit in ((1e9, "G"), (1e6, "M"), (1e3, "k")):
        if count >= size:
            return f"{count / size:.3g} {unit}"
    return str(count)


def clock_text(seconds: float) -> str:
    """Return seconds as Blender's clock writes them, 01:23.45 or 01:02:03.45."""
    hundredths = round(seconds * 100)
    minutes, hundredths = divmod(hundredths, 6000)
    hours, minutes = divmod(minutes, 60)
    tail = f"{minutes:02d}:{hundredths // 100:02d}.{hundredths % 100:02d}"
    return f"{hours:02d}:{tail}" if hours else tail
