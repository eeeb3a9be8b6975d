# SPDX-License-Identifier: GPL-3.0-or-later
"""What kernels are compiled with where light goes through portals."""

from ...streams import Defines

MOST_PORTALS = 4
# Shadow rays of a point to the world where they go through portals: most of the noise is of these.
WORLD_RAYS = 4
FACES = 6  # of a box, that are portals of photons
# Photons that would be absorbed go through portals.
PORTALS_FOR_ABSORBED_DEFINES: Defines = {
    "PORTALS": MOST_PORTALS,
    "ONE_WAY": 1,
    "PORTALS_FOR_ABSORBED": 1,
}
# Or some do, whatever the surface absorbs: so Shade can draw their way, too. Of what it scatters
# the share MOST_BY_PORTAL goes through portals where all of them fill WIDE_PORTAL [sr] or more,
# else less by the root of that solid angle. For where photons start at all distances from what is
# shown alike, their flux goes with the square of the distance, and what of it comes there by the
# cosine with its third power: so each brings as much that goes through a portal.
MOST_BY_PORTAL, WIDE_PORTAL = 0.4, 0.25
PORTALS_BY_SHARE_DEFINES: Defines = {
    **{"PORTALS": FACES, "ONE_WAY": 1, "PORTALS_BY_SHARE": 1},
    **{"MOST_BY_PORTAL": MOST_BY_PORTAL, "WIDE_PORTAL": WIDE_PORTAL},
}
