# SPDX-License-Identifier: GPL-3.0-or-later
"""An engine in a process of its own: one JSON request a line in, JSON answers a line out.

    {"load": [snapshot, blend, size]}               -> {"about": ..., "methods": {...}}
    {"climb": method, "seed": n, "budget": seconds, "folder": path}
                                                    -> {"effort", "wall", "cpu", "file"} ...
                                                       {"done": {phase: seconds}}
    {"features": file}                              -> {"done": {}}

A failure is answered by {"error": text}. Whatever the engines print goes to stderr.
"""

from __future__ import annotations

import importlib
import json
import os
import select
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[3]
PATIENCE = 180.0  # [s] after which an engine that loads in silence is given up

# Machines are shared: seconds of less than MOMENT [s] are medians of so many climbs, during which
# nobody looks at pictures; one before brings the caches and a GPU's clock up.
MOMENT, CLIMBS = 0.5, 5

MERCY = 20.0  # [s] beyond twice its budget, after which a climbing engine is given up


class EngineError(Exception):
    """The engine refused the scene, failed or fell silent."""


class Worker:
    """The parent's end of an engine's process."""

    def __init__(self, module: str) -> None:
        self.module, self._unread = module, b""
        self._log = tempfile.TemporaryFile()  # noqa: SIM115
        self._process = subprocess.Popen(
            [sys.executable, "-m", "tests.bench.chart.worker", module],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._log,
            cwd=ROOT,
        )

    def load(self, snapshot: Path, blend: Path, size: int) -> dict[str, Any]:
        return self._ask({"load": [str(snapshot), str(blend), size]})

    def features(self, file: Path) -> dict[str, Any]:
        self._ask({"features": str(file)})
        with np.load(file) as data:
            return dict(data)

    def climb(
        self, method: str, seed: int, budget: float, folder: Path
    ) -> Iterator[dict[str, Any]]:
        """Yield the answers to a climb; the last one has "done"."""
        self._send({"climb": method, "seed": seed, "budget": budget, "folder": str(folder)})
        end = time.monotonic() + 2 * budget + MERCY
        while True:
            answer = self._receive(end - time.monotonic())
            yield answer
            if "done" in answer:
                return

    def close(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.communicate()
        self._log.close()

    def _ask(self, request: dict[str, Any]) -> dict[str, Any]:
        self._send(request)
        return self._receive(PATIENCE)

    def _send(self, request: dict[str, Any]) -> None:
        assert self._process.stdin
        try:
            self._process.stdin.write(json.dumps(request).encode() + b"\n")
            self._process.stdin.flush()
        except BrokenPipeError:
            raise EngineError(self._last_words()) from None

    def _receive(self, patience: float) -> dict[str, Any]:
        pipe = self._process.stdout
        assert pipe
        end = time.monotonic() + patience
        while b"\n" not in self._unread:
            ready, _, _ = select.select([pipe], [], [], max(0.0, end - time.monotonic()))
            if not ready:
                raise EngineError("it fell silent")
            part = os.read(pipe.fileno(), 1 << 16)
            if not part:
                raise EngineError(self._last_words())
            self._unread += part
        line, self._unread = self._unread.split(b"\n", 1)
        answer = dict(json.loads(line))
        if "error" in answer:
            raise EngineError(answer["error"])
        return answer

    def _last_words(self) -> str:
        code = self._process.wait(10)
        self._log.seek(0)
        lines = self._log.read().decode(errors="replace").strip().splitlines() or ["no message"]
        return f"ended with status {code}: {lines[-1][:300]}"


def serve(module: str) -> None:
    """The child's end: answer requests until stdin ends."""
    out = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(2, 1)
    engine: Any = None

    def answer(**values: Any) -> None:
        out.write(json.dumps(values) + "\n")

    for line in sys.stdin:
        request = json.loads(line)
        try:
            if engine is None:
                contender = importlib.import_module(f"{__package__}.contenders.{module}")
                engine = contender.Engine()
            if "load" in request:
                snapshot, blend, size = request["load"]
                engine.load(Path(snapshot), Path(blend), size)
                answer(about=engine.about, methods=contender.METHODS)
            elif "features" in request:
                np.savez(request["features"], **engine.features())
                answer(done={})
            else:
                _climb(engine, request, answer)
        except (Exception, SystemExit) as error:
            answer(error=f"{type(error).__name__}: {error}".splitlines()[0][:300])


def _climb(engine: Any, request: dict[str, Any], answer: Any) -> None:
    """Climb, and answer with the median of several climbs where a picture takes but a moment."""
    from .contenders.steps import Budget, Seconds

    method, seed, begun = request["climb"], request["seed"], time.perf_counter()
    timed: dict[float, list[Seconds]] = {}
    for climb in range(1 + CLIMBS):
        for step in engine.climb(method, seed, Budget(MOMENT)):
            if climb:
                timed.setdefault(step.effort, []).append(step.seconds)
        if time.perf_counter() - begun > (1 + CLIMBS) * MOMENT:
            break  # what it does before its first picture takes long
    budget = max(MOMENT, request["budget"] - (time.perf_counter() - begun))
    for rung, step in enumerate(engine.climb(method, seed, Budget(budget))):
        file = Path(request["folder"]) / f"{method}-{rung}.npy"
        np.save(file, np.asarray(step.look(), np.float32))
        both = zip(*timed.get(step.effort, [step.seconds]), strict=True)
        wall, cpu = map(statistics.median, both)
        answer(effort=step.effort, wall=wall, cpu=cpu, file=str(file))
    answer(done=getattr(engine, "where", {}))


if __name__ == "__main__":
    serve(sys.argv[1])
