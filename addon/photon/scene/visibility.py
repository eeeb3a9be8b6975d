# SPDX-License-Identifier: GPL-3.0-or-later
"""Which rays meet a surface: the bits of Scene.visible."""

# Rays by what sent them, in the order of their bits: the eye, a lobe of each kind, a shadow ray.
RAYS = ("camera", "diffuse", "glossy", "transmission", "shadow")
RAY_BITS = {name: 1 << bit for bit, name in enumerate(RAYS)}
ALL_RAYS = sum(RAY_BITS.values())
# The eye sees nothing there, and nothing behind it.
HOLDOUT = 1 << 6
# The eye sees there but what the other surfaces take of its light.
CATCHER = 1 << 7
# Lobes by whose light caustics are made, in the order of bits.
CAUSTICS = ("reflective", "refractive")
MOST_BOUNCES = 1024  # of a light: as many as there are
