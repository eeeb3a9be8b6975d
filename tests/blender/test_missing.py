# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the renderer lacks something, the add-on loads all the same, and F12 says what it lacks."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.stability.table import Measured

pytestmark = [pytest.mark.blender, pytest.mark.stability(53)]

ROOT = Path(__file__).resolve().parents[2]
F12 = """
import bpy, addon
addon.register()
bpy.ops.wm.read_factory_settings(use_empty=False)
scene = bpy.context.scene
scene.render.engine = "PHOTON_STREAM"
scene.render.resolution_x = scene.render.resolution_y = 16
scene.photon_stream.passes = 1
try:
    bpy.ops.render.render()
    print("SAID nothing")
except RuntimeError as error:
    print("SAID", repr(str(error)))
addon.unregister()
print("UNREGISTERED")
"""
WITHOUT = """#!/bin/sh
exec {python} -c "import sys
sys.modules['{module}'] = None
$2"
"""
linux = sys.platform.startswith("linux")
CASES = {
    "no EGL": ({"GLCONTEXT_LINUX_LIBEGL": "/nonexistent/libEGL.so.1"}, "no OpenGL.*libegl1"),
    "no driver": ({"__EGL_VENDOR_LIBRARY_FILENAMES": "/nonexistent"}, "no OpenGL.*libgl1-mesa-dri"),
    "OpenGL 2.1": ({"MESA_GL_VERSION_OVERRIDE": "2.1"}, r"no OpenGL 3\.3 context"),
    "no moderngl": ("moderngl", "moderngl"),
    "no numpy": ("numpy", "numpy"),
    "no native core": ("photon_stream_native", "photon_stream_native"),
    "no interpreter": ({"PHOTON_STREAM_PYTHON": "/nonexistent/python"}, "cannot start.*/nonexist"),
}


@pytest.mark.skipif(not linux, reason="drivers are hidden as on Linux")
@pytest.mark.parametrize("case", CASES)
def test_f12_says_what_is_missing(tmp_path: Path, measured: Measured, case: str) -> None:
    """In a Blender of its own: one error, and the add-on comes and goes."""
    environment, said = CASES[case]
    if isinstance(environment, str):
        python = tmp_path / "python"
        python.write_text(WITHOUT.format(python=sys.executable, module=environment))
        python.chmod(0o755)
        environment = {"PHOTON_STREAM_PYTHON": str(python)}
    done = subprocess.run(
        [sys.executable, "-c", F12],
        cwd=ROOT,
        env=os.environ | environment,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0 and "UNREGISTERED" in done.stdout, done.stderr
    (line,) = (line for line in done.stdout.splitlines() if line.startswith("SAID"))
    print(f"{case}: {line}")
    if case == "OpenGL 2.1" and "SAID nothing" in line:
        pytest.skip("this driver does not let its version be lowered")
    assert re.search(said, line), line
    assert "Traceback" not in line
    measured("cases told", len(CASES))
