# SPDX-License-Identifier: GPL-3.0-or-later
from ...streams import Kernel, Uniform
from .records import FACING, PLACE, RAY_DIRECTION, RAY_ORIGIN, SHADING, THROUGHPUT
from .shade import GATHERED_LOBES, LOBES


class Scatter(Kernel):
    """Send the secondary rays of lobes (Marino & Abbate, mirror pass)."""

    stem = "scatter"
    structure = ("LOBES", "TWO_LOBES", "TINTED", "WEIGHED", *GATHERED_LOBES)
    inputs = {
        "place": PLACE,
        "facing": FACING,
        "shading": SHADING,
        "direction": RAY_DIRECTION,
        "throughput": THROUGHPUT,
        **LOBES,
    }
    outputs = {
        "next_origin": RAY_ORIGIN,
        "next_direction": RAY_DIRECTION,
        "next_throughput": THROUGHPUT,
    }
    uniforms = {
        "seed": Uniform("uint"),
        "pass_index": Uniform("uint"),
        "depth": Uniform("int"),
        "frame_size": Uniform("ivec2"),
        "region_origin": Uniform("ivec2"),
    }
