# SPDX-License-Identifier: GPL-3.0-or-later
"""Error against seconds beside other renderers on the same machine: `python build.py chart`."""
