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
IRRADIANCE = Record("Irradiance", {"irradiance": "vec3", "count": "float"})  # [W/m^2]
COVERAGE = Record("Coverage", {"share": "float"})  # of the filter on its own surface
SUM = Record("Sum", {"value": "vec4"})
