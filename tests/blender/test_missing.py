# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the renderer lacks something, the add-on loads all the same, and F12 says what it lacks."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.stability.table import Measured

pytestmark = [pytest.mark.blender, pytest.mark.stability(53)]

ROOT = Path(__file__).resolve().parents[2]
F12 = """
import json, os, sys
import bpy, addon
usual = dict(os.environ)
for case, environment in json.loads(sys.argv[1]).items():
    os.environ.update(environment)
    addon.register()
    bpy.ops.wm.read_factory_settings(use_empty=False)
    scene = bpy.context.scene
    scene.render.engine = "PHOTON_STREAM"
    scene.render.resolution_x = scene.render.resolution_y = 16
    scene.photon_stream.passes = 1
    try:
        bpy.ops.render.render()
        said = "nothing"
    except RuntimeError as error:
        said = str(error)
    addon.unregister()
    print("SAID", json.dumps([case, said]))
    os.environ.clear()
    os.environ.update(usual)
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


@pytest.fixture(scope="module")
def told(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """What a Blender says, case after case, in which the add-on comes and goes each time."""
    folder, given = tmp_path_factory.mktemp("missing"), {}
    for case, (environment, _) in CASES.items():
        if isinstance(environment, str):
            python = folder / environment
            python.write_text(WITHOUT.format(python=sys.executable, module=environment))
            python.chmod(0o755)
            environment = {"PHOTON_STREAM_PYTHON": str(python)}
        given[case] = environment
    done = subprocess.run(
        [sys.executable, "-c", F12, json.dumps(given)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=240,
    )
    assert done.returncode == 0, done.stderr
    lines = [line for line in done.stdout.splitlines() if line.startswith("SAID ")]
    return dict(json.loads(line.removeprefix("SAID ")) for line in lines)


@pytest.mark.skipif(not linux, reason="drivers are hidden as on Linux")
@pytest.mark.parametrize("case", CASES)
def test_f12_says_what_is_missing(told: dict[str, str], measured: Measured, case: str) -> None:
    """One error."""
    print(f"{case}: {told[case]}")
    if case == "OpenGL 2.1" and told[case] == "nothing":
        pytest.skip("this driver does not let its version be lowered")
    assert re.search(CASES[case][1], told[case])
    assert "Traceback" not in told[case]
    measured("cases told", len(CASES))
