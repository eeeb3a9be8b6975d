# SPDX-License-Identifier: GPL-3.0-or-later
from ...streams import Kernel, Table, Uniform
from .records import NODE, PIXEL, RAY_DIRECTION, RAY_ORIGIN, THROUGHPUT, TRIANGLE, WALK


class Walk(Kernel):
    """Follow rays that lobes send below surfaces to where they come out (Chiang, Kutz & Burley
    2016)."""

    stem = "walk"
    inputs = {
        "pixel": PIXEL,
        "origin": RAY_ORIGIN,
        "direction": RAY_DIRECTION,
        "throughput": THROUGHPUT,
        "walk": WALK,
    }
    outputs = {
        "next_direction": RAY_DIRECTION,
        "next_origin": RAY_ORIGIN,
        "next_throughput": THROUGHPUT,
    }
    uniforms = {
        "seed": Uniform("uint"),
        "pass_index": Uniform("uint", of_parts=True),
        "depth": Uniform("int"),
        "frame_size": Uniform("ivec2"),
    }
    tables = {"nodes": Table(NODE), "triangles": Table(TRIANGLE)}
