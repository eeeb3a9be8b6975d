# SPDX-License-Identifier: GPL-3.0-or-later
"""Kernels that the native core runs where OpenGL is software: the ones that take the time.

Each has the ports of the GLSL kernel whose place it takes, and gives the same results to rounding
(tests/kernels/test_native_kernels.py).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import photon_stream_native as native
from numpy.typing import NDArray

from ...streams import Device, HostKernel
from ..kernels.coverage import Coverage
from ..kernels.cuts import Cuts
from ..kernels.gather import Gather
from ..kernels.records import CUTS, FACING, PLACE
from ..kernels.tracer import Tracer
from ..photons.deposits import Deposits
from ..photons.radius_field import TABLES, UNIFORMS
from ..stage.geometry import Mesh

Arrays = Mapping[str, NDArray[Any]]
Values = Mapping[str, Any]


class NativeTracer(HostKernel):
    """Tracer, or with `any_hit` its ANY_HIT variant, with vector instructions on all cores."""

    stem = Tracer.stem
    inputs = Tracer.inputs
    outputs = Tracer.outputs

    def __init__(self, device: Device, triangles: native.Tracer, any_hit: bool = False) -> None:
        super().__init__(device)
        self._triangles, self._any_hit = triangles, any_hit

    def compute(self, inputs: Arrays, tables: Values, uniforms: Values) -> Any:
        """Hits of the rays."""
        return self._triangles.trace(inputs["origin"], inputs["direction"], self._any_hit)


class NativeCuts(HostKernel):
    """Cuts, by the same rule."""

    stem = Cuts.stem
    inputs = Cuts.inputs
    outputs = Cuts.outputs
    uniforms = Cuts.uniforms
    tables = TABLES

    def __init__(self, device: Device, triangles: native.Tracer) -> None:
        super().__init__(device)
        self._triangles = triangles

    def compute(self, inputs: Arrays, tables: Values, uniforms: Values) -> Any:
        """The half planes."""
        return self._triangles.cuts(
            inputs["place"], inputs["facing"], inputs["diffuse"], tables["radii"], **uniforms
        )


class NativeCoverage(HostKernel):
    """Coverage, by the same probes."""

    stem = Coverage.stem
    inputs = Coverage.inputs
    outputs = Coverage.outputs
    uniforms = Coverage.uniforms
    tables = TABLES
    _OWN = (
        "shrink",
        "probes",
        "first_probe",
        "seed",
        "depth",
        "frame_size",
        "region_origin",
    )

    def __init__(self, device: Device, triangles: native.Tracer, filter_name: str) -> None:
        super().__init__(device)
        self._triangles, self._filter = triangles, filter_name

    def compute(self, inputs: Arrays, tables: Values, uniforms: Values) -> Any:
        """The shares."""
        return self._triangles.coverage(
            inputs["place"],
            inputs["facing"],
            inputs["shading"],
            inputs["cuts"],
            inputs["diffuse"],
            tables["radii"],
            filter=self._filter,
            **{name: uniforms[name] for name in self._OWN},
        )


class NativeGather(HostKernel):
    """Gather from photons that the native core has sorted."""

    stem = Gather.stem
    inputs = {"place": PLACE, "facing": FACING, "cuts": CUTS}
    outputs = Gather.outputs
    uniforms = UNIFORMS
    tables = TABLES

    def __init__(self, device: Device, filter_name: str) -> None:
        super().__init__(device)
        self._filter = filter_name
        self._map: native.PhotonMap | None = None

    def sort(self, deposits: Deposits, grid: Values) -> None:
        """Take a pass's deposits into the grid's cells."""
        place, deposit = deposits.arrays()
        self._map = native.PhotonMap(
            place, deposit, grid["grid_origin"], grid["cell_size"], grid["grid_cells"]
        )

    def compute(self, inputs: Arrays, tables: Values, uniforms: Values) -> Any:
        """Irradiances; none before any photon was sorted."""
        if self._map is None:
            return np.zeros_like(inputs["place"])
        return self._map.gather(
            inputs["place"],
            inputs["facing"],
            inputs["cuts"],
            tables["radii"],
            uniforms["shrink"],
            self._filter,
        )


def triangles_of(mesh: Mesh) -> native.Tracer:
    """A scene's triangles for the native kernels."""
    return native.Tracer(mesh.tree.nodes, mesh.corners)
