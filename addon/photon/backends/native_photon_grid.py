# SPDX-License-Identifier: GPL-3.0-or-later
"""The photon map of the native core."""

from __future__ import annotations

from collections.abc import Mapping

from ...streams import Stream
from ..photons.deposits import Deposits
from ..photons.photon_grid import Cells
from ..photons.radius_field import Radii
from .native_kernels import NativeGather

WIDTH = 0.7  # of a cell, in radii: wider ones and narrower ones are slower to look into


class NativePhotonGrid:
    """What PhotonGrid does, by the native core's sort and gather."""

    def __init__(self, kernel: NativeGather, cells: Cells) -> None:
        self._kernel, self._cells = kernel, cells
        self._radii: Radii | None = None

    def prepare(self, deposits: Deposits, radii: Radii) -> None:
        """As Gathering's."""
        self._radii = radii
        self._kernel.sort(deposits, self._cells.of(WIDTH * radii.typical))

    def estimate(
        self, points: Mapping[str, Stream], irradiance: Stream, in_chain: bool = False
    ) -> None:
        """As Gathering's."""
        assert self._radii
        tables = self._radii.tables(self._kernel)
        self._kernel.estimate({**points, "irradiance": irradiance}, tables, self._radii.uniforms)

    @property
    def launches(self) -> int:
        """As Gathering's."""
        return self._kernel.launches

    def release(self) -> None:
        """As Gathering's."""
        self._kernel.release()
