# SPDX-License-Identifier: GPL-3.0-or-later
"""The gather radius at every place, from how dense a pass's photons are there."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import moderngl
import numpy as np
import photon_stream_native as native
from numpy.typing import NDArray

from ...streams import Device, HostKernel, Kernel, Table, Uniform
from ..stage.tables import upload_table
from .deposits import Deposits, HostDeposits
from .device_radii import (
    DeviceRadii,
    Grids,
    Limits,
    grids_on_device,
    radii_on_device,
    step_of,
)

SAMPLE = 1 << 14  # photons that tell where nearly all lie, at most
WIDEST = 1.4  # no radius is larger, in radii that even light would have
# What a kernel that reads the radii (glsl/lib/radius.glsl) declares.
UNIFORMS = {"shrink": Uniform("float")}
TABLES = {"radii": Table()}


class RadiusField:
    """Radii of the first pass [scene units]; those of later passes are `shrink` times as large.

    A radius of its own for every place: about `wanted` photons fall into a disc, be it in a caustic
    or in the dark, and none of the first pass is smaller than a pixel sees. So no radius has to be
    set by hand, whatever a scene's scale and however much of it is dark. Surfaces are told apart by
    the axes that they face: the light on one side of a wall says nothing about the other.
    """

    def __init__(
        self, device: Device, made: native.RadiusField | DeviceRadii, is_even: bool = False
    ) -> None:
        self._device, self.is_even = device, is_even
        self._made = made
        self._native: native.RadiusField | None = None
        self._table: moderngl.Texture | None = None
        if isinstance(made, DeviceRadii):
            self._table = made.table
        else:
            self._native = made

    @classmethod
    def by_density(
        cls,
        device: Device,
        deposits: Deposits,
        grids: Grids,
        wanted: float,
        times: float,
        area: float,
        pixel: float,
        eye: Sequence[float] | None,
    ) -> RadiusField:
        """`deposits`: photons, of which a disc shall hold `wanted`, and a pass has `times` so many;
        `grids`: of `grids_over` them; `area`: of the surfaces they may fall on;
        `pixel`: its width at distance 1 from the eye, or everywhere."""
        sides, box = grids()
        even = math.sqrt(wanted * (min(area, box) or 1.0) / (math.pi * max(deposits.count, 1)))
        limits = Limits(wanted, times, min(WIDEST * even, 2.0), pixel, eye)
        if isinstance(deposits, HostDeposits):
            return cls(device, _on_host(*deposits.arrays(), sides, limits))
        return cls(device, radii_on_device(device, deposits, sides, limits))

    @classmethod
    def even(cls, device: Device, radius: float) -> RadiusField:
        """One radius everywhere."""
        none = np.zeros((0, 4), np.float32)
        limits = Limits(1.0, 1.0, radius, radius, None)
        return cls(device, _on_host(none, none, native.radius_grids(none)[0], limits), True)

    @cached_property
    def told(self) -> tuple[float, float]:
        """The median of the radii over the photons, and the largest; waits for the device that
        made them [scene units]."""
        made = self._made
        return made.told() if isinstance(made, DeviceRadii) else (made.typical(), made.largest())

    @property
    def table(self) -> moderngl.Texture:
        """What GLSL reads; made for the first kernel that does."""
        if self._table is None:
            self._table = upload_table(self._device, self.on_host.table())
        return self._table

    @property
    def on_host(self) -> native.RadiusField:
        """What native kernels read; downloaded for who asks where the device made it."""
        if self._native is None:
            assert self._table
            self._native = native.RadiusField.of_table(
                self._device.texels(self._table), self.told[0]
            )
        return self._native

    def of_pass(self, shrink: float) -> Radii:
        """The radii of a pass whose radii are `shrink` times the first pass's."""
        return Radii(self, shrink, {"shrink": shrink})

    def release(self) -> None:
        """Put the table back."""
        if self._table:
            self._device.put_back(self._table)


def grids_over(device: Device, deposits: Deposits) -> Grids:
    """Where most of the deposits are; a device that has them begins to look."""
    if isinstance(deposits, HostDeposits) or not deposits.count:
        return partial(native.radius_grids, sample_of(*deposits.arrays(), SAMPLE))
    return grids_on_device(device, deposits, SAMPLE)


def sample_of(
    place: NDArray[np.float32], deposit: NDArray[np.float32], most: int
) -> NDArray[np.float32]:
    """Every so many-th photon's position and packed normal, (`most` or fewer, 4)."""
    step = step_of(len(place), most)
    return np.concatenate([place[::step, :3], deposit[::step, 3:]], axis=1)


def _on_host(
    place: NDArray[np.float32],
    deposit: NDArray[np.float32],
    grids: NDArray[np.float32],
    limits: Limits,
) -> native.RadiusField:
    return native.RadiusField(place, deposit, grids, **limits._asdict())


@dataclass(frozen=True)
class Radii:
    """A pass's radii, as kernels take them."""

    field: RadiusField
    shrink: float
    uniforms: dict[str, Any]  # of UNIFORMS

    @property
    def typical(self) -> float:
        """The median over the photons [scene units]."""
        return self.field.told[0] * self.shrink

    @property
    def largest(self) -> float:
        """Of all [scene units]."""
        return self.field.told[1] * self.shrink

    def tables(self, kernel: Kernel) -> dict[str, Any]:
        """TABLES, for a GLSL or a native kernel."""
        on_host = isinstance(kernel, HostKernel)
        return {"radii": self.field.on_host if on_host else self.field.table}


def shrink_of(alpha: float, index: int) -> float:
    """The radius of pass `index` over that of pass 0.

    Knaus & Zwicker 2011, eq. 15, in closed form: r_i^2 = r_1^2 prod (k + alpha) / (k + 1).
    """
    i = index + 1
    return math.exp((math.lgamma(i + alpha) - math.lgamma(1 + alpha) - math.lgamma(i + 1)) / 2)
