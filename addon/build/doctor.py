# SPDX-License-Identifier: GPL-3.0-or-later
"""`build.py doctor`: what is here, what is missing, and the command that installs it."""

from __future__ import annotations

import argparse
import json
import platform
import re
import subprocess
from collections.abc import Iterator
from importlib.util import find_spec

from .environment import (
    BPY_LIBRARIES,
    GL_LIBRARIES,
    PYTHON,
    ROOT,
    STAMPS,
    VENV,
    check_python,
    rust_env,
    rust_needed,
)
from .process import Failure, absent_libraries, apt, first_line

DEVICES = """
import json, moderngl
for index in range(16):
    try:
        context = moderngl.create_context(standalone=True, backend="egl", device_index=index)
    except Exception as error:
        print(json.dumps(["error", index, str(error)]))
        break
    about = context.info
    print(json.dumps([index, about["GL_RENDERER"], about["GL_VERSION"]]), flush=True)
"""


def doctor(_args: argparse.Namespace) -> int:
    """Print what is here, what is missing and the command that installs it; 1 if any is needed.

    A fix that apt has ends its line: .ci/run installs what follows `apt install`.
    """
    missing = 0

    def row(name: str, found: str | None, fix: str, needed: bool = True) -> None:
        nonlocal missing
        missing += needed and found is None
        absent = "MISSING" if needed else "absent (optional)"
        print(f"{name:18} {found or f'{absent}: {fix}'}")

    try:
        check_python(bpy=True)
        row("Python", platform.python_version(), "")
    except Failure as error:
        row("Python", None, str(error))
    row("venv module", "yes" if find_spec("ensurepip") else None, apt("python3-venv"))
    row("packages", installed(), "the first render or test installs them", needed=False)
    for name, packages in (("OpenGL libraries", GL_LIBRARIES), ("bpy's libraries", BPY_LIBRARIES)):
        absent = absent_libraries(packages)
        row(name, None if absent else "yes", apt(" ".join(absent)))
    for number, (device, fix) in enumerate(devices()):
        row("OpenGL device" if number == 0 else "", device, fix, needed=number == 0)
    row("C compiler", first_line("cc", "--version"), apt("gcc libc6-dev"))
    rust = rust_env()
    cargo = first_line("cargo", "--version", env=rust) if rust else None
    row("Rust", cargo, f"the first build fetches {rust_needed()} or newer into .venv", False)
    row("git", first_line("git", "--version"), apt("git"), needed=False)
    row("glslangValidator", first_line("glslangValidator", "-v"), apt("glslang-tools"), False)
    row("OpenImageDenoise", denoiser(), f"bpy brings it, or {PYTHON} -m pip install pyoidn", False)
    blender = first_line("blender", "--version")
    row("Blender", blender, "https://www.blender.org/download; PyPI's bpy does without", False)
    return int(missing > 0)


def installed() -> str | None:
    groups = sorted(json.loads(STAMPS.read_text())) if STAMPS.exists() else []
    return f"{', '.join(groups)} in {VENV}" if groups else None


def denoiser() -> str | None:
    """Where the renderer finds OpenImageDenoise."""
    if installed() is None:
        return None
    command = [str(PYTHON), "-c", "from addon.denoiser import find; print(find() or '')"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=ROOT)
    return done.stdout.strip() or None


def devices() -> Iterator[tuple[str | None, str]]:
    """Each OpenGL device that the renderer can choose, or None and what would bring one."""
    if installed() is None:
        yield "unknown until the packages are installed", ""
        return
    done = subprocess.run(
        [PYTHON, "-c", DEVICES], capture_output=True, text=True, check=False, timeout=120
    )
    found = [json.loads(line) for line in done.stdout.splitlines()]
    for index, *about in found:
        if index != "error":
            software = re.search("llvmpipe|softpipe|swrast", about[0])
            kind = "software: on the CPU" if software else "hardware"
            yield f"{index}: {about[0]}, OpenGL {about[1]} ({kind})", ""
    if not found or found[0][0] == "error":
        why = found[0][2] if found else f"the probe ended with exit code {done.returncode}"
        yield None, f"{why}; Mesa's suffices: {apt('libegl1 libgl1-mesa-dri')}"
