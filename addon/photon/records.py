# SPDX-License-Identifier: GPL-3.0-or-later
"""What one element of each stream holds. Lengths in scene units (see geometry.py)."""

from ..streams import Record

RAY_ORIGIN = Record("RayOrigin", {"position": "vec3", "source": "float"})  # source: triangle or -1
RAY_DIRECTION = Record(
    "RayDirection", {"direction": "vec3", "t_max": "float"}
)  # unit; zero: no ray
HIT = Record("Hit", {"t": "float", "triangle": "float", "u": "float", "v": "float"})  # number + 1
FLUX = Record("Flux", {"flux": "vec3", "photon": "float"})  # [W], linear RGB, >= 0; its number
PLACE = Record("Place", {"position": "vec3", "surface": "float"})  # surface number + 1
DEPOSIT = Record("Deposit", {"flux": "vec3", "normal": "float"})  # [W]; geometric normal, packed
FACING = Record("Facing", {"normal": "vec3", "material": "float"})  # unit, on the viewer's side
SHADING = Record("Shading", {"normal": "vec3", "triangle": "float"})  # unit
THROUGHPUT = Record("Throughput", {"throughput": "vec3"})  # of a chain of mirrors
RADIANCE = Record("Radiance", {"radiance": "vec3", "alpha": "float"})  # [W/(m^2 sr)]
# [W/m^2]; `inner` is the channels' mean within the inner radius (density.glsl)
IRRADIANCE = Record("Irradiance", {"irradiance": "vec3", "inner": "float"})
REACH = Record("Reach", {"radius": "float"})  # [scene units]
# Half planes that end a visible point's disc (lib/cuts.glsl) [1 / scene units]; zero: no cut
CUTS = Record("Cuts", {"first": "vec2", "second": "vec2"})
# Share of the filter, and of the inner one, on its own surface.
COVERAGE = Record("Coverage", {"share": "float", "inner": "float"})
# Indirect light within the inner radius, and what the radius adds to it: means of the channels
# [W/(m^2 sr)], uncorrected. Coverage's inner share, weighted as the light is.
BLUR = Record("Blur", {"inner": "float", "inner_share": "float", "difference": "float"})
SUM = Record("Sum", {"value": "vec4"})
