# SPDX-License-Identifier: GPL-3.0-or-later
"""The renderer process: renders what `process.py` asks for, until its input ends."""

from __future__ import annotations

import os
import queue
import select
import shutil
import signal
import sys
import threading
import time
import traceback
from pathlib import Path
from typing import Any, BinaryIO

import moderngl
import numpy as np

from ...streams import Device, StreamError
from ..backends.backend import open_device
from ..errors import DeviceError, PhotonStreamError, RenderError
from ..film.resolver import Picture
from ..photons.kept import BUDGET, Kept
from ..prepare import prepare
from ..renderer import Renderer
from ..scene.snapshot import unpack
from ..settings import Settings
from .blobs import BLOBS, BlobReader
from .messages import Message, receive, send
from .process import DENOISING
from .stops import Stops

IDLE = 10.0  # [s] between renders, after which a GPU's memory is given back; frames come sooner


def main(folder: str, lifeline: int) -> None:
    """Serve requests from standard input; scene and images are files in `folder`.

    `lifeline`: a descriptor that reads end-of-file when the parent is gone, or -1.
    """
    if lifeline >= 0:
        _watch(folder, lifeline)
    # What Ctrl-C means, the parent decides; this is for systems where it can't hold it back.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # OpenBLAS takes 32 MB with the first matrix, and tries for ever where they are not to be had:
    # so now, before anything else may have them. It keeps them.
    np.linalg.inv(np.eye(4))
    # The pipe is ours alone: whatever a driver prints goes to the log.
    out = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    inbox: queue.Queue[Message | None] = queue.Queue()
    threading.Thread(target=_listen, args=(sys.stdin.buffer, inbox), daemon=True).start()
    worker = _Worker(Path(folder), out, inbox)
    while (message := _next(inbox, worker)) is not None:
        if message["type"] == "render":
            worker.answer(message)
        elif message["type"] == "cancel":  # the render was over before the word arrived
            send(out, {"type": "cancelled"})


def _next(inbox: queue.Queue[Message | None], worker: _Worker) -> Message | None:
    """The next message; one that is long in coming finds less memory taken."""
    try:
        return inbox.get(timeout=IDLE)
    except queue.Empty:
        worker.rest()
        return inbox.get()


def _watch(folder: str, lifeline: int) -> None:
    """Leave a process behind that ends the renderer when its parent dies, and clears up.

    No thread of ours could: a long OpenGL call holds the interpreter. Before OpenGL and threads,
    which a fork would not survive.
    """
    renderer = os.getpid()
    if os.fork():
        os.close(lifeline)
        return
    for descriptor in (0, 1, 2):  # else the parent would wait for ours to close
        os.close(descriptor)
    os.setsid()  # what ends parent and renderer by their group or terminal must not end this
    try:
        select.select([lifeline], [], [])
        if os.getppid() == renderer:  # else it has ended by itself
            os.kill(renderer, signal.SIGKILL)
        shutil.rmtree(folder, ignore_errors=True)
    finally:
        os._exit(0)


def _listen(pipe: BinaryIO, inbox: queue.Queue[Message | None]) -> None:
    while True:
        try:
            message = receive(pipe)
        except ValueError as error:
            print(f"a message came damaged: {error}", file=sys.stderr, flush=True)
            os._exit(1)  # nothing that follows can be trusted; the parent reads the line above
        inbox.put(message)
        if message is None:
            # The parent is gone: a pass under way must not outlive it for long.
            time.sleep(1.0)
            os._exit(0)


class _Worker:
    """Renders with a device that stays open between renders, and what they have in common."""

    def __init__(self, folder: Path, out: BinaryIO, inbox: queue.Queue[Message | None]) -> None:
        self._folder, self._out, self._inbox = folder, out, inbox
        self._blobs = BlobReader(folder / BLOBS)
        self._device: Device | None = None
        self._kept: dict[str, Kept] = {}  # on the device, by view layer
        self._device_index = -1

    def answer(self, request: Message) -> None:
        """Render one picture, or say why not."""
        try:
            settings = _settings(request["settings"])
            scene = unpack(self._blobs.read(request["scene"]))
            device = self._open(settings)
            kept = self._kept_of(device, request["layer"], request["layers"])
            try:
                renderer = prepare(scene, settings, device, kept)
            except PhotonStreamError:
                if len(self._kept) == 1:
                    raise
                # There may be room without what other view layers keep, and on another device: this
                # one has what of the renderer was made.
                self._forget_device()
                device = self._open(settings)
                kept = self._kept_of(device, request["layer"], request["layers"])
                renderer = prepare(scene, settings, device, kept)
            try:
                self._render(renderer, request["images"])
            finally:
                renderer.release()
        except Exception as error:
            # It may be lost, or hold a half-built renderer's streams: the next opens another.
            self._forget_device()
            kind: type[Exception] = RenderError
            text = f"internal error: {type(error).__name__}: {error}"
            if isinstance(error, PhotonStreamError):
                kind, text = type(error), str(error)
            elif isinstance(error, (StreamError, moderngl.Error)):
                kind, text = DeviceError, f"OpenGL: {error}"
            elif isinstance(error, (MemoryError, OSError)):
                text = f"out of memory or shared memory: {error}"
            else:
                traceback.print_exc()
            send(self._out, {"type": "error", "kind": kind.__name__, "text": text})

    def rest(self) -> None:
        """Give back what would only make the next render start sooner."""
        if self._device:
            self._device.use()
            self._device.drop_spare()

    def _open(self, settings: Settings) -> Device:
        if self._device is None or self._device_index != settings.device_index:
            self._forget_device()
            self._device = open_device(settings)
            self._device_index = settings.device_index
        return self._device

    def _kept_of(self, device: Device, layer: str, layers: int) -> Kept:
        """What a view layer keeps, one of so many that a frame has."""
        budget = BUDGET // layers
        as_many = all(kept.budget == budget for kept in self._kept.values())
        if not as_many or (layer not in self._kept and len(self._kept) == layers):
            self._forget_kept()
        return self._kept.setdefault(layer, Kept(device, budget))

    def _forget_kept(self) -> None:
        for kept in self._kept.values():
            kept.release()
        self._kept.clear()

    def _forget_device(self) -> None:
        """Close the device, and with it whatever a failed render left on it."""
        if self._device:
            self._device.release()
            self._device = None
            self._kept.clear()

    def _render(self, renderer: Renderer, wanted: list[str] | None) -> None:
        start, stops, reached = time.monotonic(), Stops(renderer.settings), ""
        self._report(renderer, "progress", start, stops, {"warnings": renderer.warnings})
        while not reached:
            renderer.render_passes(stops.most_together())
            reached = stops.reached(
                renderer.film.passes, time.monotonic() - start, lambda: renderer.error().total
            )
            extra: dict[str, Any] = {}
            while not self._inbox.empty():
                message = self._inbox.get()
                if message is None:
                    return
                if message["type"] == "cancel":
                    send(self._out, {"type": "cancelled"})
                    return
                # The parent asked for a preview.
                extra = {"images": self._share(renderer.images(wanted, is_preview=True))}
            self._report(renderer, "progress", start, stops, extra)
        if renderer.settings.denoise:
            self._report(renderer, "progress", start, stops, {"phase": DENOISING})
        said, images = len(renderer.warnings), renderer.images(wanted)
        extra = {"images": self._share(images), "warnings": renderer.warnings[said:]}
        self._report(renderer, "done", start, stops, extra)

    def _report(
        self, renderer: Renderer, kind: str, start: float, stops: Stops, extra: Message
    ) -> None:
        info = renderer.info()
        send(
            self._out,
            {
                "type": kind,
                "passes_done": info["passes"],
                "passes": renderer.settings.passes,
                "expected": stops.expected,
                "photons": info["photons"],
                "render_seconds": time.monotonic() - start,
                "info": info,
            }
            | extra,
        )

    def _share(self, images: Picture) -> list[Any]:
        """Write images to shared memory, and empty them; their layout."""
        layout: list[Any] = [[name, image.shape] for name, image in images.items()]
        # In one step: the parent has the last preview's file.
        with open(self._folder / "images.part", "wb") as file:
            for name, _ in layout:
                images.pop(name).tofile(file)  # makes room for what it wrote
        os.replace(self._folder / "images.part", self._folder / "images")
        return layout


def _settings(values: Message) -> Settings:
    own = {name: tuple(values[name]) for name in ("region", "mist") if values[name]}
    return Settings(**(values | own))
