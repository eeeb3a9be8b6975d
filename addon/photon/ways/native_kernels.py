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

from ...streams import Device, HostKernel, Stream
from ...streams.declaration import Ports
from ...streams.device import Layer
from ..kernels.coverage import Coverage
from ..kernels.cuts import Cuts
from ..kernels.gather import Gather
from ..kernels.plain_lobe import PlainLobe
from ..kernels.records import (
    COVERAGE,
    CUTS,
    FACING,
    GATHERED,
    GLOSS,
    IRRADIANCE,
    PLACE,
    PLAIN_LOBE,
    PLAIN_PEAK,
    TILT,
)
from ..kernels.tracer import Tracer
from ..photons.deposits import Deposits
from ..photons.radius_field import TABLES, UNIFORMS
from ..stage.geometry import Mesh
from ..stage.needs import SceneNeeds

Arrays = Mapping[str, NDArray[Any]]
Values = Mapping[str, Any]
EVERY_RAY = 255


class NativeTriangles:
    """A scene's triangles for the native kernels: those of the mesh that was taken last."""

    tracer: native.Tracer
    normals: NDArray[Any]  # of CORNER_NORMALS

    def take(self, mesh: Mesh) -> None:
        """Hold those of a mesh from now on."""
        self.tracer, self.normals = tracer_of(mesh), mesh.normals


def tracer_of(mesh: Mesh) -> native.Tracer:
    """What the native core traces a mesh's triangles by."""
    visible = mesh.visible if len(mesh.visible) else None
    return native.Tracer(mesh.tree.nodes, mesh.corners, visible)


class NativeTracer(HostKernel):
    """Tracer, or with `any_hit` its ANY_HIT variant, with vector instructions on all cores.

    `rays` are the bits that its VISIBILITY has.
    """

    stem = Tracer.stem
    inputs = Tracer.inputs
    outputs = Tracer.outputs

    def __init__(
        self,
        device: Device,
        triangles: NativeTriangles,
        any_hit: bool = False,
        rays: int = EVERY_RAY,
    ) -> None:
        super().__init__(device)
        self._triangles, self._any_hit, self._rays = triangles, any_hit, rays

    def compute(self, inputs: Arrays, tables: Values, uniforms: Values) -> Any:
        """Hits of the rays."""
        return self._triangles.tracer.trace(
            inputs["origin"], inputs["direction"], self._any_hit, self._rays
        )


class NativeCuts(HostKernel):
    """Cuts, by the same rule."""

    stem = Cuts.stem
    inputs = Cuts.inputs
    outputs = Cuts.outputs
    uniforms = Cuts.uniforms
    tables = TABLES

    def __init__(self, device: Device, triangles: NativeTriangles) -> None:
        super().__init__(device)
        self._triangles = triangles

    def compute(self, inputs: Arrays, tables: Values, uniforms: Values) -> Any:
        """The half planes."""
        return self._triangles.tracer.cuts(
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
        "radius_scale",
        "probes",
        "first_probe",
        "seed",
        "depth",
        "frame_size",
    )

    def __init__(self, device: Device, triangles: NativeTriangles, filter_name: str) -> None:
        super().__init__(device)
        self._triangles, self._filter = triangles, filter_name

    def compute(self, inputs: Arrays, tables: Values, uniforms: Values) -> Any:
        """The shares, and how the filter is tilted."""
        return self._triangles.tracer.coverage(
            inputs["pixel"],
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
    inputs: Ports = {
        "place": PLACE,
        "facing": FACING,
        "cuts": CUTS,
        "coverage": COVERAGE,
        "tilt": TILT,
    }
    outputs: Ports = {"irradiance": IRRADIANCE}
    uniforms = UNIFORMS
    tables = TABLES
    directions = False  # whether photons' directions count

    def __init__(self, device: Device, filter_name: str) -> None:
        super().__init__(device)
        self._filter = filter_name
        self._map: native.PhotonMap | None = None

    def sort(self, deposits: Deposits, grid: Values) -> None:
        """Take a pass's deposits into the grid's cells."""
        place, deposit = deposits.arrays()
        origin, cell, cells = grid["grid_origin"], grid["cell_size"], grid["grid_cells"]
        self._map = native.PhotonMap(place, deposit, origin, cell, cells, self.directions)

    def estimate(self, points: Mapping[str, Stream], tables: Values, uniforms: Values) -> None:
        """Run on what it asks of points' streams."""
        self.run({name: points[name] for name in (*self.inputs, *self.outputs)}, tables, uniforms)

    def compute(self, inputs: Arrays, tables: Values, uniforms: Values) -> Any:
        """Irradiances; none before any photon was sorted."""
        if self._map is None:
            return np.zeros_like(inputs["place"])
        return self._map.gather(
            inputs["place"],
            inputs["facing"],
            inputs["cuts"],
            inputs["coverage"],
            inputs["tilt"],
            tables["radii"],
            uniforms["radius_scale"],
            self._filter,
        )


class NativeGlossGather(NativeGather):
    """The same, and what Phong's lobes send on."""

    inputs = {
        **NativeGather.inputs,
        "gathered": GATHERED,
        "plain_lobe": PLAIN_LOBE,
        "plain_peak": PLAIN_PEAK,
    }
    outputs = {"irradiance": IRRADIANCE, "gloss": GLOSS}
    directions = True

    def __init__(self, device: Device, layer: Layer, filter_name: str, needs: SceneNeeds) -> None:
        super().__init__(device, filter_name)
        self._plain_lobe = PlainLobe(device, layer, needs.gather_defines, made=needs.made)
        self._streams: dict[str, Stream] = {}  # what it writes

    def estimate(self, points: Mapping[str, Stream], tables: Values, uniforms: Values) -> None:
        """Look at the lobes first."""
        size = points["place"].size
        for name, record in (("plain_lobe", PLAIN_LOBE), ("plain_peak", PLAIN_PEAK)):
            if name not in self._streams or self._streams[name].size != size:
                self._streams[name] = Stream(self.device, record, size)
        points = {**points, **self._streams}
        kernel = self._plain_lobe
        kernel.run({name: points[name] for name in (*kernel.inputs, *kernel.outputs)})
        super().estimate(points, tables, uniforms)

    def release(self) -> None:
        """Free streams and program."""
        self._plain_lobe.release()
        for stream in self._streams.values():
            stream.release()

    def compute(self, inputs: Arrays, tables: Values, uniforms: Values) -> Any:
        """Irradiances and radiances; none before any photon was sorted."""
        if self._map is None:
            return (np.zeros_like(inputs["place"]),) * 2
        return self._map.gather_gloss(
            inputs["place"],
            inputs["facing"],
            inputs["cuts"],
            inputs["coverage"],
            inputs["tilt"],
            inputs["gathered"],
            inputs["plain_lobe"],
            inputs["plain_peak"],
            tables["radii"],
            uniforms["radius_scale"],
            self._filter,
        )
