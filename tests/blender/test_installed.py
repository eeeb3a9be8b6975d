# SPDX-License-Identifier: GPL-3.0-or-later
"""An installed Blender renders the pixels that PyPI's bpy renders, and takes the package."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import OpenEXR
import pytest

ROOT = Path(__file__).resolve().parents[2]
COMMAND = ROOT / "addon/blender/command.py"
SCENE = ROOT / "blend_scenes/cornell_mirror.blend"
OPTIONS = ["--width", "64", "--height", "48", "--passes", "2", "--photons", "20000"]


def test_installed_blender_gives_the_same_pixels(tmp_path: Path) -> None:
    """In every pass, bit for bit: the renderer is the same process under the same OpenGL."""
    blender = shutil.which(os.environ.get("PHOTON_STREAM_BLENDER", "blender"))
    if blender is None:
        pytest.skip("no Blender on PATH or in $PHOTON_STREAM_BLENDER")
    files = [tmp_path / "bpy.exr", tmp_path / "blender.exr"]
    background = [blender, "-b", "--factory-startup", "--python-exit-code", "1", "--python"]
    for command, file in zip(([sys.executable], [*background]), files, strict=True):
        separator = ["--"] if command[0] == blender else []
        subprocess.run(
            [*command, COMMAND, *separator, SCENE, "-o", file, *OPTIONS],
            env=os.environ | {"PHOTON_STREAM_PYTHON": sys.executable},
            check=True,
            timeout=300,
        )
    ours, theirs = (OpenEXR.File(str(file)).channels() for file in files)
    assert ours.keys() == theirs.keys()
    for name, channel in ours.items():
        assert np.array_equal(channel.pixels, theirs[name].pixels), name


def test_package_is_a_valid_extension() -> None:
    """`build.py package`, which has Blender's own checker look at what it wrote."""
    stamps = ROOT / ".venv/photon_stream.json"
    if not (stamps.exists() and "native" in json.loads(stamps.read_text())):
        pytest.skip("the environment was not set up by build.py")
    done = subprocess.run(
        [sys.executable, ROOT / "build.py", "package"],
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "Wrote " in done.stdout + done.stderr
