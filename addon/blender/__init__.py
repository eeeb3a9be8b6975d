# SPDX-License-Identifier: GPL-3.0-or-later
"""The Blender side of Photon Stream; the only package here that imports bpy."""

from __future__ import annotations

import atexit

import bpy

from . import cycles_panels, panels, properties, visibility_panels
from .engine import PhotonStreamEngine
from .session import SESSION


def register() -> None:
    """Make the engine known to Blender."""
    properties.register()
    bpy.utils.register_class(PhotonStreamEngine)
    panels.register()
    visibility_panels.register()
    cycles_panels.register()
    atexit.register(_leave)


def unregister() -> None:
    """Take everything back and end the renderer process."""
    atexit.unregister(_leave)
    SESSION.close()
    if not PhotonStreamEngine.is_registered:  # the command line has replaced this copy by its own
        return
    cycles_panels.unregister()
    visibility_panels.unregister()
    panels.unregister()
    bpy.utils.unregister_class(PhotonStreamEngine)
    properties.unregister()


def _leave() -> None:
    """End with Python: an engine that is still registered then crashes or hangs bpy.

    An installed Blender has unregistered it before it ends Python, bpy has not.
    """
    SESSION.close()
    if PhotonStreamEngine.is_registered:
        bpy.utils.unregister_class(PhotonStreamEngine)
