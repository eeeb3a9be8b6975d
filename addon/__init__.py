# SPDX-License-Identifier: GPL-3.0-or-later
"""Photon Stream: a render engine for Blender that traces photons on the GPU.

Importing the package needs no Blender, so the renderer runs and is tested without one.
"""


def check_numpy() -> None:
    """Raise ImportError where Blender's Python comes without, as that of a bare Debian package."""
    try:
        import numpy  # noqa: F401
    except ImportError as error:
        raise ImportError(
            f"Photon Stream needs numpy in Blender's Python ({error}); "
            "on Debian: apt install python3-numpy"
        ) from None


def register() -> None:
    """Called by Blender when the add-on is switched on."""
    check_numpy()
    from . import blender

    blender.register()


def unregister() -> None:
    """Called by Blender when the add-on is switched off."""
    from . import blender

    blender.unregister()
