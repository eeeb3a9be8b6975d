# SPDX-License-Identifier: GPL-3.0-or-later
"""Passes of photons: their paths, where they land, and how they are summed."""
