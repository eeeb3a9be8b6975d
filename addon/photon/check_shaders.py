# SPDX-License-Identifier: GPL-3.0-or-later
"""Validate every program offline with glslangValidator: `python -m addon.photon.check_shaders`.

Each kernel is checked for both layers, with every value of its defines and number of lanes.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from ..streams.compute import compute_source
from ..streams.declaration import GROUPS
from ..streams.source import Source, read
from . import variants

FRAGMENT_VERSION, COMPUTE_VERSION = 330, 450


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


def main() -> int:
    """Print each error with its file and line; 0 if there is none, or no validator."""
    validator = shutil.which("glslangValidator")
    if validator is None:
        print("shaders: not checked offline, glslangValidator is absent (Debian: glslang-tools)")
        return 0
    failed = count = 0
    with tempfile.TemporaryDirectory() as folder:
        seen = set[tuple[str, str]]()
        for name, stage, source in programs():
            if (stage, source.text) in seen:
                continue
            seen.add((stage, source.text))
            count += 1
            file = Path(folder) / f"program.{stage}"
            file.write_text(source.text, encoding="utf-8")
            result = subprocess.run([validator, str(file)], capture_output=True, text=True)
            if result.returncode:
                failed += 1
                print(f"{name} ({stage}):\n{source.explain(result.stdout)}")
    print(f"shaders: {count} programs checked, {failed} with errors")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
