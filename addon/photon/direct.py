# SPDX-License-Identifier: GPL-3.0-or-later
from ..streams import Kernel, Table, Uniform
from .records import FACING, PLACE, RADIANCE, RAY_DIRECTION, RAY_ORIGIN, SHADING


class Direct(Kernel):
    """Evaluate a light's unshadowed radiance at each visible point and aim its shadow ray."""

    stem = "direct"
    inputs = {"place": PLACE, "facing": FACING, "shading": SHADING, "direction": RAY_DIRECTION}
    outputs = {
        "shadow_origin": RAY_ORIGIN,
        "shadow_direction": RAY_DIRECTION,
        "unshadowed": RADIANCE,
    }
    uniforms = {
        "seed": Uniform("uint"),
        "pass_index": Uniform("uint"),
        "depth": Uniform("int"),
        "light_index": Uniform("int"),
        "frame_size": Uniform("ivec2"),
        "region_origin": Uniform("ivec2"),
    }
    tables = {"lights": Table(), "materials": Table()}
