# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders as jobs: the renderer's process, the command line."""
