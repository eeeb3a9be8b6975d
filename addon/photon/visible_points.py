# SPDX-License-Identifier: GPL-3.0-or-later
from ..streams import Kernel, Table
from .records import FACING, HIT, PLACE, RAY_DIRECTION, SHADING


class VisiblePoints(Kernel):
    """Find where eye rays and their secondary rays meet surfaces."""

    stem = "visible_points"
    inputs = {"direction": RAY_DIRECTION, "hit": HIT}
    outputs = {"place": PLACE, "facing": FACING, "shading": SHADING}
    tables = {"bvh_corners": Table(), "bvh_normals": Table()}
