# SPDX-License-Identifier: GPL-3.0-or-later
"""The errors that Photon Stream raises on purpose; anything else is a bug of ours."""


class PhotonStreamError(Exception):
    """A problem that the user can act on; its text names the object, file and value."""


class SceneError(PhotonStreamError):
    """The scene cannot be rendered as it is (no camera, malformed arrays, unreadable file)."""


class SettingsError(PhotonStreamError):
    """A render setting is outside its range."""


class DeviceError(PhotonStreamError):
    """OpenGL is missing, too old, or failed."""


class RenderError(PhotonStreamError):
    """The renderer stopped before the picture was done."""
