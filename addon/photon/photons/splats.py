# SPDX-License-Identifier: GPL-3.0-or-later
"""Indirect light by rasterising photons (Marino & Abbate, Splatting)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ...streams import Defines, Device, Stream
from ...streams.device import Layer
from ..kernels.gather_radius import GatherRadius
from ..kernels.records import GATHER_RADIUS
from ..kernels.splat import Splat
from ..settings import SplatShape
from .deposits import Deposits
from .radius_field import Radii


@dataclass(frozen=True)
class Projection:
    """How visible points project to the screen: what eye_rays.glsl inverted."""

    world_to_camera: tuple[float, ...]  # column-major, scene units
    window: tuple[float, float, float, float]  # (left, right, bottom, top) of the streams' pixels
    spread: tuple[float, float]  # how far eye rays may pass from pixels' middles, likewise
    orthographic: bool


class Splats:
    """Adds each photon to the visible points around it by blending one splat a photon.

    Reaches only points that the camera sees directly; those seen in mirrors need Gather.
    """

    def __init__(self, device: Device, layer: Layer, shape: SplatShape, defines: Defines) -> None:
        """`defines`: the filter."""
        self._device = device
        self._radius: Stream | None = None
        self._gather_radius, self._splat = (
            GatherRadius(device, layer),
            Splat(device, shape, defines),
        )
        self._deposits: Deposits | None = None
        self._radii: Radii | None = None

    def prepare(self, deposits: Deposits, radii: Radii) -> None:
        """Take a pass's deposits and radii."""
        self._deposits, self._radii = deposits, radii

    def estimate(
        self, points: Mapping[str, Stream], irradiance: Stream, projection: Projection
    ) -> None:
        """Write the irradiance [W/m^2] at points: place, facing, cuts, coverage, tilt."""
        assert self._deposits and self._radii
        count, *photons = self._deposits.tables()
        if count == 0:
            irradiance.clear()
            return
        radius = self._radius_at(points)
        streams = {name: points[name] for name in ("place", "facing", "cuts", "coverage", "tilt")}
        self._splat.run(
            {**streams, "gather_radius": radius, "irradiance": irradiance},
            dict(zip(("photon_place", "photon_deposit"), photons, strict=True))
            | self._radii.tables(self._splat),
            {
                "world_to_camera": projection.world_to_camera,
                "window": projection.window,
                "spread": projection.spread,
                "field_is_even": self._radii.field.is_even,
                "orthographic": projection.orthographic,
            }
            | self._radii.uniforms,
            items=count,
        )

    def launches(self) -> dict[str, int]:
        """How often each kernel has run."""
        return {kernel.stem: kernel.launches for kernel in (self._splat, self._gather_radius)}

    def release(self) -> None:
        """Free what is its own; the programs are the device's."""
        self._release_radii()
        self._gather_radius.release()
        self._splat.release()

    def _radius_at(self, points: Mapping[str, Stream]) -> Stream:
        """The gather radius at each point."""
        place, radii = points["place"], self._radii
        assert radii
        if self._radius is None or self._radius.size != place.size:
            self._release_radii()
            self._radius = Stream(self._device, GATHER_RADIUS, place.size)
        streams = {name: points[name] for name in ("place", "facing", "cuts")}
        streams["gather_radius"] = self._radius
        self._gather_radius.run(streams, radii.tables(self._gather_radius), radii.uniforms)
        return self._radius

    def _release_radii(self) -> None:
        if self._radius:
            self._radius.release()
