# SPDX-License-Identifier: GPL-3.0-or-later
"""Who traces, sorts and sums: the only room that asks which device does."""
