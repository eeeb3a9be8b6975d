# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes made by chance, by Photon Stream and by Cycles: where their pictures differ something is
wrong, or is approximated. Run as `python -m tests.bench.random_scenes`."""
