# SPDX-License-Identifier: GPL-3.0-or-later
"""The photon map of the native core, and with one in GLSL for lobes that it does not know."""

from __future__ import annotations

from collections.abc import Mapping

from ...streams import Stream
from ..photons.deposits import Deposits
from ..photons.photon_grid import Cells, Gathering
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
        self._kernel.sort(deposits, self._cells.of(WIDTH * radii.typical[0]))

    def estimate(
        self, points: Mapping[str, Stream], irradiance: Stream, in_chain: bool = False
    ) -> None:
        """As Gathering's."""
        assert self._radii
        tables = self._radii.tables(self._kernel)
        self._kernel.estimate(
            {**points, "irradiance": irradiance}, tables, self._radii.uniforms, in_chain
        )

    @property
    def launches(self) -> int:
        """As Gathering's."""
        return self._kernel.launches

    def release(self) -> None:
        """As Gathering's."""
        self._kernel.release()


# What a point of lobes that the native core does not know has of the other photon map alone.
_OF_LOBES = ("gloss", "gathered")


class MixedPhotonGrid:
    """The native core's irradiance everywhere, and what lobes gather of whichever photon map knows
    all lobes of a point."""

    def __init__(self, known: NativePhotonGrid, others: Gathering) -> None:
        """`others` looks at the points that `known` leaves out, and at none else."""
        self._known, self._others = known, others
        self._found: dict[tuple[int, int], dict[str, Stream]] = {}  # by size

    def prepare(self, deposits: Deposits, radii: Radii) -> None:
        """As Gathering's."""
        self._known.prepare(deposits, radii)
        self._others.prepare(deposits, radii)

    def estimate(
        self, points: Mapping[str, Stream], irradiance: Stream, in_chain: bool = False
    ) -> None:
        """As Gathering's."""
        streams = {"irradiance": irradiance, **{name: points[name] for name in _OF_LOBES}}
        if irradiance.size not in self._found:
            self._found[irradiance.size] = {
                name: Stream(x.device, x.record, x.size) for name, x in streams.items()
            }
        found = self._found[irradiance.size]
        self._known.estimate(points, irradiance, in_chain)
        self._others.estimate({**points, **found}, found["irradiance"], in_chain)
        for name in _OF_LOBES:  # of each point one of the two is zero
            streams[name].upload(streams[name].download() + found[name].download())

    @property
    def launches(self) -> int:
        """As Gathering's."""
        return self._known.launches + self._others.launches

    def release(self) -> None:
        """As Gathering's."""
        self._known.release()
        self._others.release()
        for streams in self._found.values():
            for stream in streams.values():
                stream.release()
