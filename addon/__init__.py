# SPDX-License-Identifier: GPL-3.0-or-later
"""Photon Stream: a render engine for Blender that traces photons on the GPU.

Importing the package needs no Blender, so the renderer runs and is tested without one.
"""

from __future__ import annotations


def register() -> None:
    """Called by Blender when the add-on is switched on."""
    from . import blender

    blender.register()


def unregister() -> None:
    """Called by Blender when the add-on is switched off."""
    from . import blender

    blender.unregister()
