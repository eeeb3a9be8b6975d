# SPDX-License-Identifier: GPL-3.0-or-later
"""The gather radius at every place, from how dense a pass's photons are there."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any, Protocol

import moderngl
import numpy as np
import photon_stream_native as native
from numpy.typing import NDArray

from ...streams import Device, Kernel, Table, Uniform, of_parts
from ..kernels.records import RADIUS_GRID
from ..stage.upload import upload_table
from .device_radii import Box, Grids, Limits, step_of

SAMPLE = 1 << 14  # photons that tell where nearly all lie, at most
WIDEST = 1.4  # no radius is larger, in radii that even light would have
# What a kernel that reads the radii (glsl/lib/radius.glsl) declares.
UNIFORMS = {"radius_scale": Uniform("float", of_parts=True)}
TABLES = {"radii": Table(RADIUS_GRID)}


class Found(Protocol):
    """Radii by density, where they were made: HostRadii or DeviceRadii."""

    def summary(self) -> tuple[float, float]:
        """The median over the photons, and the largest; waits for who made them [scene units]."""

    @property
    def on_device(self) -> moderngl.Texture:
        """What GLSL reads; made for the first kernel that does."""

    @property
    def on_host(self) -> native.RadiusField:
        """What native kernels read; downloaded for the first that does, if it has to be."""

    def release(self) -> None:
        """Put the texture back."""


class HostRadii:
    """Radii that the native core has made."""

    def __init__(self, device: Device, made: native.RadiusField) -> None:
        self._device, self.on_host = device, made
        self._table: moderngl.Texture | None = None

    def summary(self) -> tuple[float, float]:
        """As Found's."""
        return self.on_host.typical(), self.on_host.largest()

    @property
    def on_device(self) -> moderngl.Texture:
        """As Found's."""
        if self._table is None:
            self._table = upload_table(self._device, self.on_host.table())
        return self._table

    def release(self) -> None:
        """As Found's."""
        if self._table:
            self._device.put_back(self._table)


class RadiusField:
    """Radii of the first pass [scene units]; `radius_scale` times as large in later ones.

    A radius of its own for every place: about `wanted` photons fall into a disc, be it in a caustic
    or in the dark, and none of the first pass is smaller than a pixel sees. So no radius has to be
    set by hand, whatever a scene's scale and however much of it is dark. Surfaces are told apart by
    the axes that they face: the light on one side of a wall says nothing about the other.
    """

    def __init__(self, found: Found, deposits: float, is_even: bool = False) -> None:
        """`deposits`: of a pass, about; whichever pass asks."""
        self._found, self.deposits, self.is_even = found, deposits, is_even

    @classmethod
    def even(cls, device: Device, radius: float, deposits: float) -> RadiusField:
        """One radius everywhere."""
        none = np.zeros((0, 4), np.float32)
        limits = Limits(1.0, 1.0, radius, radius, None)
        found = radii_on_host(device, (none, none), native.radius_grids(none)[0], limits)
        return cls(found, deposits, is_even=True)

    @cached_property
    def summary(self) -> tuple[float, float]:
        """The median of the radii over the photons, and the largest; waits for the device that
        made them [scene units]."""
        return self._found.summary()

    @property
    def on_device(self) -> moderngl.Texture:
        """As Found's."""
        return self._found.on_device

    @property
    def on_host(self) -> native.RadiusField:
        """As Found's."""
        return self._found.on_host

    def of_passes(self, *scales: float) -> Radii:
        """The radii of passes together, which are so many times the first pass's."""
        return Radii(self, scales, {"radius_scale": of_parts(scales)})

    def release(self) -> None:
        """Put what it found back."""
        self._found.release()


def limits_by(
    wanted: float,
    times: float,
    photons: int,
    area: float,
    pixel: float,
    eye: Sequence[float] | None,
) -> Limits:
    """How radii are to be: a disc shall hold `wanted` of so many photons, of which a pass has
    `times` as many; `area`: of the surfaces they may fall on; `pixel`: its width at distance 1
    from the eye, or everywhere."""
    even = math.sqrt(wanted * (area or 1.0) / (math.pi * max(photons, 1)))
    return Limits(wanted, times, min(WIDEST * even, 2.0), pixel, eye)


def grids_on_host(
    place: NDArray[np.float32], deposit: NDArray[np.float32], focus: Box | None = None
) -> Grids:
    """Where most of the deposits are, of those in a box if there is one; looked up when it is
    called."""
    sample = sample_of(place, deposit, SAMPLE)
    if focus is not None:
        sample = sample[((sample[:, :3] >= focus[0]) & (sample[:, :3] <= focus[1])).all(axis=1)]
    return partial(native.radius_grids, np.ascontiguousarray(sample))


def radii_on_host(
    device: Device,
    deposits: tuple[NDArray[np.float32], NDArray[np.float32]],
    grids: NDArray[np.float32],
    limits: Limits,
) -> HostRadii:
    """The radii by places and deposits (P, 4)."""
    return HostRadii(device, native.RadiusField(*deposits, grids, **limits._asdict()))


def sample_of(
    place: NDArray[np.float32], deposit: NDArray[np.float32], most: int
) -> NDArray[np.float32]:
    """Every so many-th photon's position and packed normal, (`most` or fewer, 4)."""
    step = step_of(len(place), most)
    return np.concatenate([place[::step, :3], deposit[::step, 3:]], axis=1)


@dataclass(frozen=True)
class Radii:
    """Radii of passes that are rendered together, as kernels take them."""

    field: RadiusField
    scales: tuple[float, ...]  # of each pass
    uniforms: dict[str, Any]  # of UNIFORMS

    @property
    def typical(self) -> tuple[float, ...]:
        """Of each pass the median over the photons [scene units]."""
        return tuple(self.field.summary[0] * scale for scale in self.scales)

    @property
    def largest(self) -> tuple[float, ...]:
        """Of each pass the largest [scene units]."""
        return tuple(self.field.summary[1] * scale for scale in self.scales)

    def tables(self, kernel: Kernel) -> dict[str, Any]:
        """TABLES, as a GLSL or a native kernel reads them."""
        return {"radii": kernel.placed(self.field)}


def radius_scale(decay: float, index: int) -> float:
    """The radius of pass `index` over that of pass 0.

    Knaus & Zwicker 2011, eq. 15, in closed form: r_i^2 = r_1^2 prod (k + decay) / (k + 1).
    """
    i = index + 1
    return math.exp((math.lgamma(i + decay) - math.lgamma(1 + decay) - math.lgamma(i + 1)) / 2)
