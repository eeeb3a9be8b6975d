# SPDX-License-Identifier: GPL-3.0-or-later
"""What kernels read that know media."""

from ...streams import Table, When
from .records import GRID, VOXEL

# Of such as differ from place to place.
VARYING_TABLES = {
    "grids": When("VARYING", Table(GRID)),
    "voxels": When("VARYING", Table(VOXEL)),
}
