# SPDX-License-Identifier: GPL-3.0-or-later
"""The renderer as a process of its own, seen from the one that wants a picture.

A driver that crashes takes down the child and nothing else. Messages go through pipes
(`messages.py`), scene (`blobs.py`) and images through files in shared memory. `worker.py` is the
other end.
"""

from __future__ import annotations

import math
import os
import queue
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Collection, Generator, Iterable, Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import errors
from ..errors import PhotonStreamError, RenderError
from ..scene import Scene
from ..scene.snapshot import pack
from ..settings import Settings
from .blobs import BLOBS, BlobWriter, Layout
from .interrupts import held_back
from .messages import Message, receive, send

Images = dict[str, NDArray[np.float32]]

DENOISING = "Denoising"  # the phase
TICK = 0.05  # [s] between looks at a render under way
SHARED_MEMORY = "/dev/shm"
IMAGE_BYTES = 144  # a pixel: 36 floats over all images
CANCEL_GRACE = 0.08  # [s] for the child to end its pass; then it is killed
PREVIEW_SHARE = 0.1  # of the time may go into previews
_HINTS = (
    "note: ",
    "stack backtrace",
    "skipping backtrace",
)  # Rust's last lines after it has said what happened


@dataclass(frozen=True)
class Progress:
    """What the renderer says about a render under way.

    `images`, when there is a new picture: {"Combined": (h, w, 4) premultiplied RGBA,
    "Direct"/"Indirect"/"Mirror"/"Emission"/"Background"/"Normal": (h, w, 3),
    "Depth"/"Error": (h, w, 1)} float32, row 0 at the bottom, of the rendered region, and what else
    the settings ask for.
    """

    phase: str  # e.g. "Starting", "Rendering", "Denoising"
    passes_done: int
    passes: int
    photons: int  # emitted so far
    elapsed: float  # [s]
    remaining: float  # [s], inf while unknown
    warnings: tuple[str, ...] = ()  # said once, on the first event that knows them
    images: Images | None = None
    done: bool = False
    info: dict[str, Any] = field(default_factory=dict)  # Renderer.info() once known


def last_error(info: Mapping[str, Any]) -> tuple[float, float, float] | None:
    """The error of Renderer.info(), its noise and its bias: relative; None while unknown."""
    error, noise, bias = (info.get(name, math.inf) for name in ("error", "noise", "bias"))
    return (error, noise, bias) if math.isfinite(error) else None


class RendererProcess:
    """A warm child process that renders; started at the first render, ended by `close`."""

    def __init__(
        self, python: str | None = None, environment: Mapping[str, str] | None = None
    ) -> None:
        """`python`: the child's interpreter; default $PHOTON_STREAM_PYTHON or sys.executable;
        `environment`: what it finds there, unless it is set already."""
        self._environment = environment or {}
        self._python = python or os.environ.get("PHOTON_STREAM_PYTHON") or sys.executable
        self._child: subprocess.Popen[bytes] | None = None
        self._folder: Path | None = None
        self._blobs: BlobWriter | None = None  # as long as the folder
        self._lifeline = -1
        self._inbox: queue.Queue[Message | None] = queue.Queue()
        self._burial: threading.Thread | None = None  # of a child that was killed

    @property
    def pid(self) -> int | None:
        """The child's process number while it runs."""
        return self._child.pid if self._child and self._child.poll() is None else None

    def render(
        self,
        scene: Scene,
        settings: Settings,
        previews: bool = True,
        layer: str = "",
        layers: int = 1,
        images: Collection[str] | None = None,
    ) -> Generator[Progress, None, None]:
        """Yield a Progress at least every 0.1 s; the last has done=True and images: those
        named, or all.

        What has not changed since the last frame is used again, for each `layer` of a frame that
        has so many `layers`.
        Closing the iterator cancels the render within 0.2 s. Raises what the renderer raised
        (SceneError, SettingsError, DeviceError), or RenderError when the child died.
        """
        settings.check()
        start = time.monotonic()
        progress = Progress("Starting", 0, settings.passes, 0, 0.0, math.inf)
        yield progress
        rendering = True
        try:
            arrays = pack(scene)
            folder = self._start(_shared_bytes(arrays, settings))
            request = {"settings": asdict(settings), "layer": layer, "layers": layers}
            request["images"] = images and [*images]
            self._send({"type": "render", "scene": self._share(arrays, layer, layers)} | request)
            next_preview = 0.5
            while rendering:
                elapsed = time.monotonic() - start
                try:
                    message = self._inbox.get(timeout=TICK)
                except queue.Empty:
                    progress = replace(progress, elapsed=elapsed, images=None, warnings=())
                    yield progress
                    continue
                if message is None:
                    raise RenderError(self._epitaph())
                if message["type"] == "error":
                    rendering = False
                    raise _as_error(message)
                progress = _as_progress(message, folder, elapsed)
                rendering = not progress.done
                if previews and rendering and progress.passes_done and elapsed > next_preview:
                    next_preview = elapsed + max(0.5, PREVIEW_SHARE * elapsed)
                    self._send({"type": "preview"})
                yield progress
        except (GeneratorExit, KeyboardInterrupt):
            if rendering:
                self._cancel()
            raise
        except PhotonStreamError:
            if self.pid is None:
                self.close()
            raise

    def close(self) -> None:
        """End the child and free what it shared."""
        if self._burial:
            self._burial.join()
        _bury(*self._let_go())

    def _let_go(self) -> tuple[subprocess.Popen[bytes] | None, Path | None, int]:
        """Part with the child, its folder and its lifeline: the next render starts anew."""
        parted = self._child, self._folder, self._lifeline
        self._child, self._folder, self._blobs, self._lifeline = None, None, None, -1
        return parted

    def _start(self, shared_bytes: int) -> Path:
        """Start the child if it does not run; its folder, in shared memory if that has room."""
        shared = _shared_memory(shared_bytes)
        fits = self._folder and (shared or self._folder.parent != Path(SHARED_MEMORY))
        if self.pid is not None and self._folder and fits:
            return self._folder
        self.close()
        self._folder = Path(tempfile.mkdtemp(prefix="photon_stream_", dir=shared))
        self._blobs = BlobWriter(self._folder / BLOBS)
        package = Path(__file__).resolve().parents[2]
        # Our own packages come along only if the child is the same Python.
        path = [str(package.parent)] + ([*sys.path] if self._python == sys.executable else [])
        code = (
            f"import sys; sys.path[:1] = {path!r}\n"
            f"from importlib import import_module\n"
            f"import_module({package.name + '.photon.jobs.worker'!r})"
        )
        # Its other end closes with this process, however that ends (worker.py, _watch).
        lifeline, self._lifeline = os.pipe() if os.name == "posix" else (-1, -1)
        code += f".main({str(self._folder)!r}, {lifeline})"
        try:
            # It never lets Ctrl-C or a hang-up in: what they mean is decided here.
            with open(self._folder / "log", "wb") as log, held_back():
                self._child = subprocess.Popen(
                    [self._python, "-c", code],
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    stderr=log,
                    # What is left for numpy are matrices of 4x4: threads would only take memory.
                    env={**self._environment, **os.environ, "OPENBLAS_NUM_THREADS": "1"},
                    pass_fds=(lifeline,) if lifeline >= 0 else (),
                )
        except OSError as error:
            raise RenderError(f"cannot start the renderer with {self._python}: {error}") from error
        finally:
            if lifeline >= 0:
                os.close(lifeline)
        self._inbox = queue.Queue()
        threading.Thread(
            target=_deliver, args=(self._child.stdout, self._inbox), daemon=True
        ).start()
        return self._folder

    def _share(self, arrays: list[NDArray[Any]], layer: str, layers: int) -> Layout:
        """Put the arrays of a scene where the child finds them, those it has not got."""
        assert self._blobs
        try:
            return self._blobs.write(arrays, layer, layers)
        except OSError as error:
            raise RenderError(f"cannot hand the scene to the renderer: {error}") from error

    def _send(self, message: Message) -> None:
        assert self._child
        try:
            send(self._child.stdin, message)  # type: ignore[arg-type]  # a pipe of bytes
        except OSError:
            raise RenderError(self._epitaph()) from None

    def _cancel(self) -> None:
        """Ask the child to stop; a pass that takes longer than the grace period dies with it."""
        if self._child is None:  # interrupted before it began
            self.close()
            return
        deadline = time.monotonic() + CANCEL_GRACE
        try:
            self._send({"type": "cancel"})
            while time.monotonic() < deadline:
                message = self._inbox.get(timeout=max(0.0, deadline - time.monotonic()))
                if message is None:
                    break
                if message["type"] == "cancelled":
                    return
        except (queue.Empty, PhotonStreamError):
            pass
        # On a busy machine a death takes seconds: only what starts the next child waits for it.
        self._child.kill()
        self._burial = threading.Thread(target=_bury, args=self._let_go())
        self._burial.start()

    def _epitaph(self) -> str:
        """Why the child died, as far as it can be known."""
        assert self._child and self._folder
        try:
            code: int | None = self._child.wait(1.0)
        except subprocess.TimeoutExpired:
            code = None
        log = (self._folder / "log").read_text(errors="replace").strip().splitlines()
        log = [line for line in log if not line.startswith(_HINTS)]
        ended = f"by signal {-code}" if code is not None and code < 0 else f"with code {code}"
        return f"the renderer process ended {ended}" + (f": {log[-1]}" if log else "")


def _bury(child: subprocess.Popen[bytes] | None, folder: Path | None, lifeline: int) -> None:
    """End a child, which has a moment to do it itself, and free what it shared."""
    if child:
        for pipe in (child.stdin, child.stdout):
            try:
                if pipe:
                    pipe.close()
            except OSError:
                pass  # a pipe to a dead child
        try:
            child.wait(CANCEL_GRACE)
        except subprocess.TimeoutExpired:
            child.kill()
            child.wait()
    if lifeline >= 0:
        os.close(lifeline)
    if folder:
        shutil.rmtree(folder, ignore_errors=True)


def _shared_bytes(arrays: Iterable[NDArray[Any]], settings: Settings) -> int:
    """What a render puts into its folder at most: the scene, and the images twice while they
    change."""
    x0, y0, x1, y1 = settings.frame_region
    pixels = (x1 - x0) * (y1 - y0)
    return sum(array.nbytes for array in arrays) + 2 * IMAGE_BYTES * pixels


def _shared_memory(needed: int) -> str | None:
    """The folder of shared memory if it has room to spare, else None: the usual temporary one."""
    if not os.access(SHARED_MEMORY, os.W_OK):
        return None
    return SHARED_MEMORY if shutil.disk_usage(SHARED_MEMORY).free > 2 * needed else None


def _deliver(pipe: Any, inbox: queue.Queue[Message | None]) -> None:
    """Move messages from the pipe to the inbox; None when the child is gone."""
    while True:
        try:
            message = receive(pipe)
        except (OSError, ValueError):
            message = None
        inbox.put(message)
        if message is None:
            return


def _as_error(message: Message) -> PhotonStreamError:
    kind = getattr(errors, message["kind"], RenderError)
    return kind(message["text"])


def _as_progress(message: Message, folder: Path, elapsed: float) -> Progress:
    done = message["type"] == "done"
    passes, passes_done = message["passes"], message["passes_done"]
    per_pass = message["render_seconds"] / passes_done if passes_done else math.inf
    return Progress(
        message.get("phase") or ("Rendering" if passes_done else "Preparing"),
        passes_done,
        passes,
        message["photons"],
        elapsed,
        0.0 if done else per_pass * max(0, message["expected"] - passes_done),
        tuple(message.get("warnings", ())),
        _read_images(folder, message["images"]) if "images" in message else None,
        done,
        message["info"],
    )


def _read_images(folder: Path, layout: list[Any]) -> Images:
    """Map the images from shared memory: the child writes the next ones into another file, and
    these stay until they are let go."""
    data, at = np.memmap(folder / "images", np.float32, mode="c"), 0
    images: Images = {}
    for name, shape in layout:
        images[name] = np.asarray(data[at : (at := at + math.prod(shape))]).reshape(shape)
    return images
