# SPDX-License-Identifier: GPL-3.0-or-later
from ..streams import Kernel, Table, Uniform
from .records import FACING, PLACE, RAY_DIRECTION, RAY_ORIGIN, SHADING, THROUGHPUT


class Mirror(Kernel):
    """Send the secondary rays of mirrors and Phong lobes (Marino & Abbate, mirror pass)."""

    stem = "mirror"
    inputs = {
        "place": PLACE,
        "facing": FACING,
        "shading": SHADING,
        "direction": RAY_DIRECTION,
        "throughput": THROUGHPUT,
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
    tables = {"materials": Table()}
