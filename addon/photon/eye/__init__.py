# SPDX-License-Identifier: GPL-3.0-or-later
"""Paths from the eye, and the images that they make."""
