# SPDX-License-Identifier: GPL-3.0-or-later
"""Export how small triangles of displaced objects shall be."""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray


def adaptive(obj: bpy.types.Object) -> bpy.types.SubsurfModifier | None:
    """The modifier by which Cycles subdivides an object as finely as it is seen: the last one."""
    if not obj.modifiers or obj.modifiers[-1].type != "SUBSURF":
        return None
    modifier = obj.modifiers[-1]
    own = getattr(modifier, "use_adaptive_subdivision", False)  # Blender 5.0 on
    older = getattr(getattr(obj, "cycles", None), "use_adaptive_subdivision", False)
    return modifier if modifier.show_render and (own or older) else None


def dicing_of(
    obj: bpy.types.Object, scene: bpy.types.Scene, matrix: NDArray[np.float64]
) -> tuple[float, float]:
    """How long sides of its triangles may be, in pixels and in metres; 0: as long as they are."""
    modifier = adaptive(obj)
    if modifier is None:
        return 0.0, 0.0
    if getattr(modifier, "adaptive_space", "PIXEL") == "OBJECT":
        scale = float(np.cbrt(abs(np.linalg.det(matrix[:3, :3]))))
        return 0.0, modifier.adaptive_object_edge_length * scale
    older: float = getattr(getattr(obj, "cycles", None), "dicing_rate", 1.0)
    own: float = getattr(modifier, "adaptive_pixel_size", older)
    rate: float = getattr(getattr(scene, "cycles", None), "dicing_rate", 1.0)
    return rate * own, 0.0
