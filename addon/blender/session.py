# SPDX-License-Identifier: GPL-3.0-or-later
"""What outlives a single render: the warm renderer, and what the last renders said."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import bpy

from ..denoiser import VARIABLE, find
from ..photon.jobs.process import Progress, RendererProcess
from .export.report import Report


@dataclass
class Session:
    """The state of the add-on in this Blender."""

    reports: dict[str, Report] = field(default_factory=dict)  # by scene name
    info: dict[str, Any] = field(default_factory=dict)  # of the last render: device, times ...
    seconds: dict[str, float] = field(default_factory=dict)  # [s] of the last render, by phase
    error: str = ""  # why the last render failed
    cancelled: bool = False  # whether the last render was
    # Asks a render under way to stop, from a signal handler for one.
    cancel: threading.Event = field(default_factory=threading.Event)
    # Takes over from Blender's status line, for the command line's progress bar.
    listener: Callable[[Progress], None] | None = None
    # Whoever renders empties `error` before, and says it afterwards: Blender need not.
    quiet: bool = False
    # Where the exported scene goes instead of being rendered.
    snapshot_path: Path | None = None
    _renderer: RendererProcess | None = None

    @property
    def renderer(self) -> RendererProcess:
        """The renderer process, the same one from frame to frame."""
        if self._renderer is None:
            # The Python that runs there may not be Blender's, which has the denoiser.
            known = {VARIABLE: str(blender)} if (blender := _blender()) else {}
            self._renderer = RendererProcess(environment=known)
        return self._renderer

    @cached_property
    def has_denoiser(self) -> bool:
        """Whether OpenImageDenoise is here."""
        return find(_blender()) is not None

    def begin(self) -> None:
        """Forget what the last render said."""
        self.info, self.seconds = {}, {}
        self.cancelled = False
        if not self.quiet:  # the compositor renders several scenes
            self.error = ""

    def spend(self, phase: str, seconds: float) -> None:
        """Add to the time of a phase of this render."""
        self.seconds[phase] = self.seconds.get(phase, 0.0) + seconds

    def close(self) -> None:
        """End the renderer process."""
        renderer, self._renderer = self._renderer, None
        if renderer is not None:
            renderer.close()


def _blender() -> Path | None:
    """The folder that has all of this Blender, or of PyPI's bpy; None where a system has spread it
    over its own."""
    own = bpy.utils.resource_path("LOCAL")  # as blender-5.0/5.0
    return Path(own).parent if own else None


SESSION = Session()
