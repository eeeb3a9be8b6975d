# SPDX-License-Identifier: GPL-3.0-or-later
"""The add-on comes and goes without a trace."""

from __future__ import annotations

import subprocess
import sys

import bpy
import pytest
from bl_ui import properties_output

import addon
from addon.blender import command
from addon.blender.engine import PhotonStreamEngine

pytestmark = pytest.mark.blender
COMMAND = command.__file__


def test_blender_without_numpy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "numpy", None)
    with pytest.raises(ImportError, match="needs numpy .* apt install python3-numpy"):
        addon.register()


def test_command_without_numpy() -> None:
    """Run by its path, as in an installed Blender."""
    run = f"sys.argv[0] = {COMMAND!r}; runpy.run_path({COMMAND!r}, run_name='__main__')"
    done = subprocess.run(
        [sys.executable, "-c", f"import runpy, sys; sys.modules['numpy'] = None; {run}", "x.blend"],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 1
    assert done.stderr.startswith("Error: Photon Stream needs numpy in Blender's Python")
    assert done.stderr.count("\n") == 1


def test_comes_and_goes() -> None:
    shared = properties_output.RENDER_PT_format.COMPAT_ENGINES
    assert PhotonStreamEngine.is_registered and "PHOTON_STREAM" in shared
    addon.unregister()
    addon.unregister()
    assert not PhotonStreamEngine.is_registered and "PHOTON_STREAM" not in shared
    assert not hasattr(bpy.types.Scene, "photon_stream")
    addon.register()
    assert bpy.context.scene.photon_stream.passes > 0
