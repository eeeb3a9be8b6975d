# SPDX-License-Identifier: GPL-3.0-or-later
"""What passes add up to: sums, their error, the picture."""
