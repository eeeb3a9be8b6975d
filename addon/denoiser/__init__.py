# SPDX-License-Identifier: GPL-3.0-or-later
"""OpenImageDenoise over its C API, wherever it is installed. It knows no rendering."""

from .cuda import CudaBuffers, CudaError
from .library import ABSENT, VARIABLE, Denoiser, DenoiserError, PreparedFilter, Way, find

__all__ = [
    "ABSENT",
    "VARIABLE",
    "CudaBuffers",
    "CudaError",
    "Denoiser",
    "DenoiserError",
    "PreparedFilter",
    "Way",
    "find",
]
