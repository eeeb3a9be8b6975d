# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene on a device: units, triangles, tables, and what it has a use for."""
