# SPDX-License-Identifier: GPL-3.0-or-later
"""The photon pass: Generator -> (Tracer -> Shade -> Projector -> Reflector)* -> deposits."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...streams import Device
from ...streams.device import Layer
from ..settings import Settings
from ..stage.needs import SceneNeeds
from ..stage.tables import Tables
from .deposits import HostDeposits
from .emission import Emission, rays_of
from .mapper import PhotonBatch, draw_of
from .one_bounce import OneBounce, PathsAndEnds
from .paths import NARROWEST, PathsBySize


class PhotonMapper:
    """Traces a pass's photons and collects where they land on diffuse surfaces: a bounce after the
    other, each kernel by itself, lists on the host."""

    def __init__(
        self,
        device: Device,
        layer: Layer,
        tables: Tables,
        settings: Settings,
        needs: SceneNeeds,
        bounce: OneBounce,
    ) -> None:
        self._settings, self._needs = settings, needs
        media = needs.carries_medium
        self._paths = PathsBySize(device, bounce.paths, media, NARROWEST)
        self.deposits = HostDeposits(device, needs.caustics)
        self.unfinished = 0  # photons that the bounce limit cut off, over all passes
        self._emission = Emission(device, layer, tables, needs)
        self._bounce = bounce

    def start(self, batch: PhotonBatch) -> None:
        """Trace a batch until all its photons have ended."""
        photons = batch.photons
        paths = self._paths.of(photons)
        self._emission.run(paths.fronts(), draw_of(self._settings, batch.index), photons)
        self.deposits.clear()
        alive = photons
        for bounce in range(self._needs.photon_bounces + 1):
            alive = self._bounce.count(batch, paths, bounce, self.deposits).wait()
            if not alive:
                return
            paths = self._compacted(paths, alive)
        self.unfinished += alive

    def finish(self) -> HostDeposits:
        """The deposits of the batch that was started."""
        return self.deposits

    def rays(self, index: int, photons: int) -> NDArray[np.float32]:
        """Where a pass's photons start, and where they go, (photons or more, 6)."""
        paths = self._paths.of(photons)
        self._emission.run(paths.fronts(), draw_of(self._settings, index), photons)
        return rays_of(paths.fronts())

    def launches(self) -> dict[str, int]:
        """How often each kernel has run."""
        return self._emission.launches() | self._bounce.launches()

    def _compacted(self, paths: PathsAndEnds, alive: int) -> PathsAndEnds:
        """The photons that are alive, in order, in streams of half the size or less if they fit.

        On software OpenGL a dead photon costs as much as its SIMD neighbours' longest path:
        in full streams those that live would take longer.
        """
        smaller = self._paths.halved(paths, alive)
        if smaller is paths:
            return paths
        found = {name: stream.elements() for name, stream in paths.fronts().items()}
        there = np.flatnonzero(found["direction"][:, :3].any(axis=1))
        for name, elements in found.items():
            smaller.pairs[name].front.take(elements[there])
        return smaller

    def release(self) -> None:
        """Free streams and kernels."""
        self._paths.release()
        self._emission.release()
        self._bounce.release()
        self.deposits.release()
