# SPDX-License-Identifier: GPL-3.0-or-later
"""The add-on comes and goes without a trace."""

from __future__ import annotations

import bpy
import pytest
from bl_ui import properties_output

import addon
from addon.blender.engine import PhotonStreamEngine

pytestmark = pytest.mark.blender


def test_comes_and_goes() -> None:
    shared = properties_output.RENDER_PT_format.COMPAT_ENGINES
    assert PhotonStreamEngine.is_registered and "PHOTON_STREAM" in shared
    addon.unregister()
    addon.unregister()
    assert not PhotonStreamEngine.is_registered and "PHOTON_STREAM" not in shared
    assert not hasattr(bpy.types.Scene, "photon_stream")
    addon.register()
    assert bpy.context.scene.photon_stream.passes > 0
