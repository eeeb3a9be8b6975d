# SPDX-License-Identifier: GPL-3.0-or-later
from ...streams import Kernel, Uniform, When
from .records import (
    CHAIN,
    FACING,
    HIT,
    PIXEL,
    PLACE,
    RAY_DIRECTION,
    RAY_ORIGIN,
    SHADING,
    THROUGHPUT,
)
from .shade import GATHERED_LOBES, LOBES


class Scatter(Kernel):
    """Send the secondary rays of lobes (Marino & Abbate, mirror pass)."""

    stem = "scatter"
    structure = (
        "LOBES",
        "TWO_LOBES",
        "TINTED",
        "WEIGHED",
        "TRANSPARENT",
        "DISPERSION",
        *GATHERED_LOBES,
    )
    inputs = {
        "pixel": PIXEL,
        "place": PLACE,
        "facing": FACING,
        "shading": SHADING,
        "direction": RAY_DIRECTION,
        "throughput": THROUGHPUT,
        "hit": When("TRANSPARENT", HIT),
        "chain": When("TRANSPARENT", CHAIN),
        **LOBES,
    }
    outputs = {
        "next_origin": RAY_ORIGIN,
        "next_direction": RAY_DIRECTION,
        "next_throughput": THROUGHPUT,
        "next_chain": When("TRANSPARENT", CHAIN),
    }
    uniforms = {
        "seed": Uniform("uint"),
        "pass_index": Uniform("uint"),
        "depth": Uniform("int"),
        "chain_depth": When("TRANSPARENT", Uniform("int")),
        "transparent_depth": When("TRANSPARENT", Uniform("int")),
        "frame_size": Uniform("ivec2"),
    }
