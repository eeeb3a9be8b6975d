# SPDX-License-Identifier: GPL-3.0-or-later
"""The gather radius at every place, from how dense a pass's photons are there."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np
import photon_stream_native as native
from numpy.typing import NDArray

from ..streams import Device, HostKernel, Kernel, Table, Uniform
from .geometry import upload_table

MOST_CELLS = 64  # along the longest axis
OUTSIDE = 0.005  # of the photons may lie beyond the grid, on either side of each axis
TELLING = 1 << 14  # as many of the photons tell that to a tenth of itself
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
        self,
        device: Device,
        place: NDArray[np.float32],
        deposit: NDArray[np.float32],
        wanted: float,
        times: float,
        area: float,
        pixel: float,
        eye: Sequence[float] | None,
    ) -> None:
        """`place`, `deposit` (P, 4): photons, of which a disc shall hold `wanted`, and a pass has
        `times` so many; `area`: of the surfaces they may fall on;
        `pixel`: its width at distance 1 from the eye, or everywhere."""
        # The grid lies over most photons: a far ground must not coarsen a lit room on it.
        low, high = np.zeros((2, 3))
        if len(place):
            some = place[:: -(-len(place) // TELLING), :3]
            low, high = np.quantile(some, [OUTSIDE, 1 - OUTSIDE], axis=0)
        size = high - low
        cell = max(float(size.max()) / (MOST_CELLS - 2), 1e-6)
        box = 2 * (size[0] * size[1] + size[1] * size[2] + size[2] * size[0])
        even = math.sqrt(wanted * (min(area, box) or 1.0) / (math.pi * max(len(place), 1)))
        self.native = native.RadiusField(
            place,
            deposit,
            low.tolist(),
            high.tolist(),
            cell,
            photons=wanted,
            times=times,
            most=min(WIDEST * even, 2.0),
            pixel=pixel,
            eye=eye,
        )
        self._finish(device, is_even=False)

    @classmethod
    def even(cls, device: Device, radius: float) -> RadiusField:
        """One radius everywhere."""
        field = cls.__new__(cls)
        none, zero = np.zeros((0, 4), np.float32), (0.0, 0.0, 0.0)
        field.native = native.RadiusField(
            none, none, zero, zero, 1.0, photons=1.0, times=1.0, most=radius, pixel=radius, eye=None
        )
        field._finish(device, is_even=True)
        return field

    def _finish(self, device: Device, is_even: bool) -> None:
        self._device = device
        self._table: moderngl.Texture | None = None
        self.typical, self.largest = self.native.typical(), self.native.largest()
        self.is_even = is_even

    @property
    def table(self) -> moderngl.Texture:
        """What GLSL reads; made for the first kernel that does."""
        if self._table is None:
            self._table = upload_table(self._device, self.native.table())
        return self._table

    def of_pass(self, shrink: float) -> Radii:
        """The radii of a pass whose radii are `shrink` times the first pass's."""
        return Radii(self, shrink, {"shrink": shrink})

    def release(self) -> None:
        """Free the table."""
        if self._table:
            self._table.release()


@dataclass(frozen=True)
class Radii:
    """A pass's radii, as kernels take them."""

    field: RadiusField
    shrink: float
    uniforms: dict[str, Any]  # of UNIFORMS

    @property
    def typical(self) -> float:
        """The median over the photons [scene units]."""
        return self.field.typical * self.shrink

    @property
    def largest(self) -> float:
        """Of all [scene units]."""
        return self.field.largest * self.shrink

    def tables(self, kernel: Kernel) -> dict[str, Any]:
        """TABLES, for a GLSL or a native kernel."""
        on_host = isinstance(kernel, HostKernel)
        return {"radii": self.field.native if on_host else self.field.table}


def shrink_of(alpha: float, index: int) -> float:
    """The radius of pass `index` over that of pass 0.

    Knaus & Zwicker 2011, eq. 15, in closed form: r_i^2 = r_1^2 prod (k + alpha) / (k + 1).
    """
    i = index + 1
    return math.exp((math.lgamma(i + alpha) - math.lgamma(1 + alpha) - math.lgamma(i + 1)) / 2)
