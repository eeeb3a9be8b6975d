# SPDX-License-Identifier: GPL-3.0-or-later
"""Every program that the renderer can build, for offline checks."""

from __future__ import annotations

from collections.abc import Iterator
from typing import get_args

from ..streams import Kernel
from ..streams.source import Source
from .blur import Blur
from .bounces import Bounces, declarations
from .combine import CombineAll, CombineMirror, CombinePrimary
from .coverage import Coverage
from .cuts import Cuts
from .device_radii import DECLARATIONS
from .direct import Direct
from .eye_rays import EyeRays
from .film import Accumulate, AccumulateBatches, AccumulateTwo
from .gather import Gather
from .generator import Generator
from .lit import Lit
from .mirror import Mirror
from .projector import Projector
from .reach import Reach
from .reflector import Reflector
from .settings import Filter, SplatShape
from .splat import splat_sources
from .tracer import Tracer
from .visible_points import VisiblePoints

PLAIN: tuple[type[Kernel], ...] = (
    Generator,
    EyeRays,
    Tracer,
    Reflector,
    Projector,
    VisiblePoints,
    Direct,
    Lit,
    Mirror,
    Cuts,
    Blur,
    CombinePrimary,
    CombineMirror,
    CombineAll,
    Accumulate,
    AccumulateTwo,
    AccumulateBatches,
    Reach,
)
COMPUTE = (
    "scan_blocks",
    "scan_add",
    "compact_count",
    "compact_move",
    "paths_count",
    "paths_move",
    "grid_count",
    "grid_scatter",
    "grid_rank",
    "fill_zero",
    "fill_texture",
    "radius_box",
    "radius_sides",
    "radius_count",
    "radius_sum",
    "radius_sum_rows",
    "radius_find",
    "radius_flatten",
    "radius_flatten_rows",
    "radius_tell",
)


def kernels() -> Iterator[tuple[type[Kernel], dict[str, int | float]]]:
    """Each kernel with each of its defines."""
    for kernel in PLAIN:
        yield kernel, {}
    yield Tracer, {"ANY_HIT": 1}
    for name in get_args(Filter):
        yield Gather, {f"FILTER_{name.upper()}": 1}
        yield (
            Coverage,
            {
                f"FILTER_{name.upper()}": 1,
            },
        )


def compute_programs() -> Iterator[tuple[str, str]]:
    """Each program that is no kernel, and what it is compiled with."""
    for stem in COMPUTE:
        yield stem, DECLARATIONS.get(stem, "")
    yield Bounces.stem, declarations()


def splats(version: int) -> Iterator[tuple[str, Source, Source]]:
    """Each splat program as (name, vertex source, fragment source)."""
    for shape in get_args(SplatShape):
        for name in get_args(Filter):
            defines = {f"FILTER_{name.upper()}": 1}
            yield f"splat {shape} {name}", *splat_sources(version, shape, defines)
