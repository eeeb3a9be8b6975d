# SPDX-License-Identifier: GPL-3.0-or-later
"""`build.py test`: every check, one after the other, and a table of how they went."""

from __future__ import annotations

import argparse
import os
import shutil
import sys
import time
from pathlib import Path

from .environment import CARGO_TOML, PYTHON, ROOT, ensure, rust_env
from .process import apt, first_line, run, say

# Tests of several files run at once: most use one core, and what would take all is told to.
# One that crashes is not replaced: pytest-xdist 3.8 would wait for the new one for ever.
AT_ONCE = ("--numprocesses=auto", "--maxprocesses=4", "--dist=loadfile", "--max-worker-restart=0")
# Annotations are by numpy 1's, which bpy 5.0 has; numpy 2's tell shapes that change.
UNTYPED = "" if sys.version_info < (3, 13) else "Python 3.11 checks them, whose numpy is 1.26"
ONE_THREAD = {"LP_NUM_THREADS": "0", "OPENBLAS_NUM_THREADS": "1"}  # Mesa's llvmpipe, numpy


def test(args: argparse.Namespace) -> int:
    """Run all checks, also after one that failed; 1 if any did, 0 otherwise.

    A check whose tool is optional and absent is named in the table with what installs it, and one
    for other Pythons with theirs.
    With --stability, only the tests of the stability table, which then print it.
    """
    ensure("run", "native", "blender", "dev")
    env = dict(rust_env() or os.environ, PYO3_PYTHON=str(PYTHON))
    module: list[str | Path] = [PYTHON, "-m"]
    if args.stability:
        return run([*module, "pytest", "--stability", *args.pytest], env, ROOT)
    manifest: list[str | Path] = ["--manifest-path", CARGO_TOML]
    glslang = "" if shutil.which("glslangValidator") else apt("glslang-tools")
    absent = {"fmt": "rustup component add rustfmt", "clippy": "rustup component add clippy"}
    for tool in absent:
        if first_line("cargo", tool, "--version", env=env):
            absent[tool] = ""
    lint = ["--release", "--all-targets", "--all-features", "--", "-D", "warnings"]
    offline: list[str | Path] = [*module, "addon.photon.check_shaders"]
    offline += [option for option in args.pytest if option == "--thorough"]
    steps: list[tuple[str, list[str | Path], str]] = [
        ("formatting", [*module, "ruff", "format", "--check", "."], ""),
        ("lint", [*module, "ruff", "check", "."], ""),
        ("types", [*module, "mypy"], UNTYPED),
        ("shaders offline", offline, glslang),
        ("native formatting", ["cargo", "fmt", "--check", *manifest], absent["fmt"]),
        ("native lint", ["cargo", "clippy", *manifest, *lint], absent["clippy"]),
        ("native tests", ["cargo", "test", "--release", *manifest], ""),
        ("tests", [*module, "pytest", *AT_ONCE, *args.pytest], ""),
    ]
    table, failed = [], False
    for name, command, fix in steps:
        start, result = time.monotonic(), f"absent: {fix}"
        if not fix:
            say(f"\n== {name}")
            code = run(command, ONE_THREAD | env, ROOT)
            failed |= code != 0
            result = "passed" if code == 0 else f"FAILED ({code})"
        table.append(f"{time.monotonic() - start:7.1f} s  {name:18} {result}")
    print("\n" + "\n".join(table), flush=True)
    return int(failed)
