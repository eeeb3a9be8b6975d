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

from ...streams import Device, HostKernel, Kernel, Stream
from ...streams.declaration import Ports
from ...streams.device import Layer
from ..kernels.bent_base import BentBase
from ..kernels.coverage import Coverage
from ..kernels.cuts import Cuts
from ..kernels.gather import Gather
from ..kernels.plain_lobe import PlainLobe
from ..kernels.plain_microfacets import MICROFACETS, PlainMicrofacets
from ..kernels.records import (
    COVERAGE,
    CUTS,
    FACING,
    GLOSS,
    IRRADIANCE,
    PLACE,
    RAY_DIRECTION,
    SHADING,
    TILT,
)
from ..kernels.shade import depth_for
from ..kernels.tracer import Tracer
from ..kernels.walk import Walk
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
    mesh: Mesh

    def take(self, mesh: Mesh) -> None:
        """Hold those of a mesh from now on."""
        self.tracer, self.mesh = tracer_of(mesh), mesh


def tracer_of(mesh: Mesh) -> native.Tracer:
    """What the native core traces a mesh's triangles by."""
    visible = mesh.visible if len(mesh.visible) else None
    flags = mesh.normals["flags"].astype(np.uint8)
    return native.Tracer(mesh.tree.nodes, mesh.corners, visible, flags)


class NativeTracer(HostKernel):
    """Tracer, or with `any_hit` its ANY_HIT variant, with vector instructions on all cores.

    `rays` are the bits that its VISIBILITY has, and `by_reach` is its BY_REACH.
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
        by_reach: bool = False,
    ) -> None:
        super().__init__(device)
        self._triangles, self._kind = triangles, (any_hit, rays, by_reach)

    def compute(self, inputs: Arrays, tables: Values, uniforms: Values) -> Any:
        """Hits of the rays."""
        return self._triangles.tracer.trace(inputs["origin"], inputs["direction"], *self._kind)

    def hits(self, streams: Mapping[str, Stream]) -> NDArray[np.float32]:
        """As `run`, but (n, 4) of HIT that no stream takes."""
        self.launches += 1
        rays = {name: streams[name].download() for name in self.inputs}
        found: NDArray[np.float32] = self.compute(rays, {}, {}).reshape(-1, 4)
        return found


class NativeWalk(HostKernel):
    """Walk, by the same random numbers."""

    stem = Walk.stem
    inputs = Walk.inputs
    outputs = Walk.outputs
    uniforms = Walk.uniforms

    def __init__(self, device: Device, triangles: NativeTriangles) -> None:
        super().__init__(device)
        self._triangles = triangles

    def compute(self, inputs: Arrays, tables: Values, uniforms: Values) -> Any:
        """Rays that go on, and what they carry."""
        rays = [inputs[name] for name in self.inputs]
        return self._triangles.tracer.walk(*rays, **uniforms)


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
        "expecting",
        "least_expected",
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
            faces=self._triangles.mesh.faces,
            **{name: uniforms[name] for name in self._OWN},
        )


# Of points that gather.
_DISCS: Ports = {
    "place": PLACE,
    "facing": FACING,
    "cuts": CUTS,
    "coverage": COVERAGE,
    "tilt": TILT,
}


class NativeGather(HostKernel):
    """Gather from photons that the native core has sorted. Where normals are bent or lobes gather,
    kernels look at the points first, and write what the native core needs to know of them."""

    stem = Gather.stem
    outputs: Ports = {"irradiance": IRRADIANCE}
    uniforms = UNIFORMS
    tables = TABLES
    lobes: type[Kernel] | None = None  # the kernel that looks at them
    of_lobes: tuple[str, ...] = ()  # what the native core reads of them

    def __init__(self, device: Device, layer: Layer, filter_name: str, needs: SceneNeeds) -> None:
        super().__init__(device)
        self._filter = filter_name
        self._map: native.PhotonMap | None = None
        self._looks: list[Kernel] = []
        if needs.programs.normals:
            self._looks.append(BentBase(device, layer, needs.gather_defines, made=needs.made))
        if self.lobes:
            self._looks.append(self.lobes(device, layer, needs.gather_defines, made=needs.made))
        found = {name: x for look in self._looks for name, x in look.outputs.items()}
        self._written = {name: x for name, x in found.items() if name != "gathered"}
        self.inputs = {**_DISCS, **found}
        if needs.programs.normals:
            self.inputs |= {"shading": SHADING}
        if "direction" in self.of_lobes:
            self.inputs |= {"direction": RAY_DIRECTION}
        self._streams: dict[tuple[tuple[int, int], str], Stream] = {}  # that looks write

    def sort(self, deposits: Deposits, grid: Values) -> None:
        """Take a pass's deposits into the grid's cells."""
        place, deposit = deposits.arrays()
        origin, cell, cells = grid["grid_origin"], grid["cell_size"], grid["grid_cells"]
        self._map = native.PhotonMap(place, deposit, origin, cell, cells, bool(self._looks))

    def estimate(
        self, points: Mapping[str, Stream], tables: Values, uniforms: Values, in_chain: bool
    ) -> None:
        """Run on what it asks of points' streams; `in_chain`: of secondary rays."""
        size = points["place"].size
        for name, record in self._written.items():
            if (size, name) not in self._streams:
                self._streams[size, name] = Stream(self.device, record, size)
        points = {**points, **{name: self._streams[size, name] for name in self._written}}
        for look in self._looks:
            ports = {name: points[name] for name in (*look.inputs, *look.outputs)}
            look.run(ports, uniforms=depth_for(look, in_chain))
        self.run({name: points[name] for name in (*self.inputs, *self.outputs)}, tables, uniforms)

    def compute(self, inputs: Arrays, tables: Values, uniforms: Values) -> Any:
        """Irradiances, and with lobes radiances; none before any photon was sorted."""
        if self._map is None:
            none = np.zeros_like(inputs["place"])
            return (none,) * len(self.outputs)
        points = [inputs[name] for name in _DISCS]
        discs = tables["radii"], uniforms["radius_scale"], self._filter
        bent = (inputs["shading"], inputs["base"]) if "base" in inputs else None
        if not self.of_lobes:
            return self._map.gather(points, *discs, bent)
        none = np.zeros_like(inputs["place"])  # of a second lobe, where a point has one at most
        lobes = [inputs.get(name, none) for name in self.of_lobes]
        return self._map.gather_lobes(points, lobes, *discs, bent)

    def release(self) -> None:
        """Free streams and programs."""
        for look in self._looks:
            look.release()
        for stream in self._streams.values():
            stream.release()


class NativePhongGather(NativeGather):
    """The same, and what Phong's lobe sends on."""

    outputs = {"irradiance": IRRADIANCE, "gloss": GLOSS}
    lobes = PlainLobe
    of_lobes = ("gathered", "plain_lobe", "plain_peak")


class NativeMicrofacetGather(NativeGather):
    """The same, and what one or two lobes of microfacets send on."""

    outputs = {"irradiance": IRRADIANCE, "gloss": GLOSS}
    lobes = PlainMicrofacets
    of_lobes = ("gathered", "direction", *MICROFACETS)
