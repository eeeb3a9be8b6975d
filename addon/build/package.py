# SPDX-License-Identifier: GPL-3.0-or-later
"""`build.py package`: the extension that Blender installs."""

from __future__ import annotations

import argparse
import platform
import re
import shutil
import sys
import zipfile
from pathlib import Path

from .environment import (
    BPY,
    PYPROJECT,
    PYTHON,
    ROOT,
    VENV,
    WHEELS,
    build_native,
    ensure,
    pinned,
    pip,
)
from .process import run, say

PLATFORMS = {"x86_64": "x64", "aarch64": "arm64"}  # Blender's names


def package(_args: argparse.Namespace) -> int:
    """Write dist/photon_stream-<version>.zip, an extension for Blender 4.2 and later."""
    ensure("run", "native")
    if not any(WHEELS.glob("*.whl")):
        build_native()
    fetched = ROOT / "build" / "wheels-pypi"
    shutil.rmtree(fetched, ignore_errors=True)
    pins = [pin for pin in pinned()["run"] if pin.startswith(("moderngl", "glcontext"))]
    for python in BPY:  # as many as there are Pythons among the Blenders
        tags = ["--python-version", python, "--only-binary=:all:", "--no-deps"]
        if sys.platform == "linux":  # moderngl's and glcontext's wheels bear these two names
            for glibc in ("manylinux2014", "manylinux_2_28"):
                tags += ["--platform", f"{glibc}_{platform.machine()}"]
        pip("download", *tags, "-d", str(fetched), *pins)
    wheels = sorted([*WHEELS.glob("*.whl"), *fetched.glob("*.whl")], key=lambda path: path.name)

    manifest = (ROOT / "addon" / "blender_manifest.toml").read_text(encoding="utf-8")
    manifest = re.sub(r"^wheels *= *\[.*?\]\n", "", manifest, flags=re.M | re.S)
    listed = "".join(f'    "./wheels/{path.name}",\n' for path in wheels)
    head, bracket, tables = manifest.partition("\n[")  # keys after a table would belong to it
    if sys.platform == "linux":
        head += f'\nplatforms = ["linux-{PLATFORMS.get(platform.machine(), platform.machine())}"]'
    manifest = f"{head.rstrip()}\nwheels = [\n{listed}]\n{bracket}{tables}"

    files = {f"wheels/{path.name}": path.read_bytes() for path in wheels}
    files |= {
        "blender_manifest.toml": manifest.encode(),
        "LICENSE": (ROOT / "LICENSE").read_bytes(),
    }
    for top, prefix in ((ROOT / "addon", ""), (ROOT / "glsl", "glsl/")):
        for path in sorted(top.rglob("*")):
            if path.is_file() and not {"__pycache__", "build"} & {*path.parts[len(top.parts) :]}:
                files.setdefault(prefix + path.relative_to(top).as_posix(), path.read_bytes())

    version = re.search(r'^version = "(.*)"', PYPROJECT, re.M)
    assert version
    target = ROOT / "dist" / f"photon_stream-{version[1]}.zip"
    target.parent.mkdir(exist_ok=True)
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in sorted(files.items()):  # no clock, no order of a file system
            entry = zipfile.ZipInfo(name, date_time=(1980, 1, 1, 0, 0, 0))
            entry.external_attr = 0o644 << 16
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, content)
    say(f"Wrote {target} ({target.stat().st_size / 1e6:.1f} MB)")
    return validate(target)


def validate(extension: Path) -> int:
    """Have Blender check the extension: bpy's own copy of the checker, or an installed Blender."""
    checkers = list(
        VENV.glob("lib/*/site-packages/bpy/*/scripts/addons_core/bl_pkg/cli/blender_ext.py")
    )
    blender = shutil.which("blender")
    if checkers:
        return run([PYTHON, checkers[0], "validate", extension])
    if blender:
        return run([blender, "--command", "extension", "validate", extension])
    say("Not validated: neither bpy nor Blender is here")
    return 0
