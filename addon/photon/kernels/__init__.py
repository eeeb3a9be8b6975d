# SPDX-License-Identifier: GPL-3.0-or-later
"""The kernels' declarations, a file for each of glsl/kernels that streams run through."""
