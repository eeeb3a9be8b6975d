# SPDX-License-Identifier: GPL-3.0-or-later
"""Validate every program offline with glslangValidator: `python -m addon.photon.check_shaders`.

Each kernel is checked for both layers, with every value of its defines and number of lanes.
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
from functools import partial
from pathlib import Path

from ..streams.compute import compute_source
from ..streams.declaration import GROUPS
from ..streams.source import Source, read
from . import variants

FRAGMENT_VERSION, COMPUTE_VERSION = 330, 450
AT_ONCE = 64  # programs of a call


def programs() -> Iterator[tuple[str, str, Source]]:
    """Every program as (name, glslang's stage, source)."""

    for kernel, defines, made in variants.kernels():
        name = " ".join([kernel.stem, *defines])
        yield name, "frag", kernel.source("fragment", FRAGMENT_VERSION, defines, made=made)
        for lanes in (
            GROUPS if "sum_over_lanes" in read(f"kernels/{kernel.stem}.glsl", name) else (1,)
        ):
            yield name, "comp", kernel.source("compute", COMPUTE_VERSION, defines, lanes, made)
    for drawing, shape, defines in variants.drawn():
        name = " ".join([drawing.stem, shape, *defines])
        vertex, fragment = drawing.sources(FRAGMENT_VERSION, shape, defines)
        yield name, "vert", vertex
        yield name, "frag", fragment
    for stem, declarations, made in variants.compute_programs():
        yield stem, "comp", compute_source(stem, declarations=declarations, made=made)


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
    argparse.ArgumentParser(prog="addon.photon.check_shaders", description=__doc__).parse_args()
    validator = shutil.which("glslangValidator")
    if validator is None:
        print("shaders: not checked offline, glslangValidator is absent (Debian: glslang-tools)")
        return 0
    unique = {(stage, source.text): (name, source) for name, stage, source in programs()}
    found = [(name, stage, source) for (stage, _), (name, source) in unique.items()]
    count, failed = len(found), 0
    batches = [found[first : first + AT_ONCE] for first in range(0, count, AT_ONCE)]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for wrong in pool.map(partial(_wrong, validator), batches):
            for text in wrong:
                failed += 1
                print(text)
    print(f"shaders: {count} programs checked, {failed} with errors")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
