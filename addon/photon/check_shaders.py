# SPDX-License-Identifier: GPL-3.0-or-later
"""Validate every program offline with glslangValidator: `python -m addon.photon.check_shaders`.

Each kernel is checked as a compute program with every two of its defines and includes and every
number of lanes, and as a fragment program with each define and include, or with `--thorough` with
every value of all.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from hashlib import blake2b
from itertools import combinations_with_replacement
from pathlib import Path

from ..streams.compute import compute_source
from ..streams.declaration import GROUPS, THREADS
from ..streams.source import Source, read
from . import variants

FRAGMENT_VERSION, COMPUTE_VERSION = 330, 450
AT_ONCE = 64  # programs of a call


def programs(thorough: bool = True) -> Iterator[tuple[str, str, Source]]:
    """Every program as (name, glslang's stage, source). Unless they shall be thorough, those alone
    that are the first with some two defines or includes, and of fragment programs with some one:
    these differ from compute programs by how they read and write."""
    known: dict[type, set[frozenset[object]]] = {}
    for kernel, defines, made in variants.kernels():
        name = " ".join([kernel.stem, *defines])
        parts = {"", *made.values(), *((x, defines.get(x)) for x in kernel.structure)}
        before = known.setdefault(kernel, set())
        new = {frozenset(pair) for pair in combinations_with_replacement(parts, 2)} - before
        before |= new
        if thorough or any(len(pair) == 1 for pair in new):
            yield name, "frag", kernel.source("fragment", FRAGMENT_VERSION, defines, made=made)
        if not (thorough or new):
            continue
        for lanes in (
            GROUPS[THREADS]
            if "sum_over_lanes" in read(f"kernels/{kernel.stem}.glsl", name)
            else (1,)
        ):
            yield name, "comp", kernel.source("compute", COMPUTE_VERSION, defines, lanes, made)
    for drawing, shape, defines in variants.drawn():
        name = " ".join([drawing.stem, shape, *defines])
        vertex, fragment = drawing.sources(FRAGMENT_VERSION, shape, defines)
        yield name, "vert", vertex
        yield name, "frag", fragment
    for stem, declarations, made in variants.compute_programs():
        yield stem, "comp", compute_source(stem, declarations=declarations, made=made)


def _batches(thorough: bool) -> Iterator[list[tuple[str, str, Source]]]:
    """Programs that differ, AT_ONCE at a time."""
    known, batch = set[bytes](), []
    for name, stage, source in programs(thorough):
        digest = blake2b(source.text.encode(), digest_size=16, key=stage.encode()).digest()
        if digest in known:
            continue
        known.add(digest)
        batch.append((name, stage, source))
        if len(batch) == AT_ONCE:
            yield batch
            batch = []
    if batch:
        yield batch


def _wrong(validator: str, batch: list[tuple[str, str, Source]]) -> list[str]:
    """What is wrong with each program of a batch that has errors."""
    with tempfile.TemporaryDirectory() as folder:
        files = [Path(folder) / f"{k}.{stage}" for k, (_, stage, _) in enumerate(batch)]
        for file, (_, _, source) in zip(files, batch, strict=True):
            file.write_text(source.text, encoding="utf-8")
        # One call for all: starting it takes longer than a program does. Which is wrong is asked
        # of each alone.
        if subprocess.run([validator, *files], capture_output=True).returncode == 0:
            return []
        wrong = []
        for file, (name, stage, source) in zip(files, batch, strict=True):
            result = subprocess.run([validator, file], capture_output=True, text=True)
            if result.returncode:
                wrong.append(f"{name} ({stage}):\n{source.explain(result.stdout)}")
        return wrong


def main() -> int:
    """Print each error with its file and line; 0 if there is none, or no validator."""
    parser = argparse.ArgumentParser(prog="addon.photon.check_shaders", description=__doc__)
    parser.add_argument("--thorough", action="store_true", help="all fragment programs, too")
    thorough = parser.parse_args().thorough
    validator = shutil.which("glslangValidator")
    if validator is None:
        print("shaders: not checked offline, glslangValidator is absent (Debian: glslang-tools)")
        return 0
    count, failed = 0, 0
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        waiting = []
        for batch in _batches(thorough):  # while others are checked
            count += len(batch)
            waiting.append(pool.submit(_wrong, validator, batch))
        for wrong in waiting:
            for text in wrong.result():
                failed += 1
                print(text)
    print(f"shaders: {count} programs checked, {failed} with errors")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
