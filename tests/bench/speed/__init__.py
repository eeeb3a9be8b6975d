# SPDX-License-Identifier: GPL-3.0-or-later
"""How fast Photon Stream is, beside what the machine could do, the paper and its own choices."""
