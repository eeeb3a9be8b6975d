# SPDX-License-Identifier: GPL-3.0-or-later
"""OpenImageDenoise over its C API, wherever it is installed. It knows no rendering."""

from .library import ABSENT, VARIABLE, Denoiser, DenoiserError, find

__all__ = ["ABSENT", "VARIABLE", "Denoiser", "DenoiserError", "find"]
