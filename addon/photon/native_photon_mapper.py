# SPDX-License-Identifier: GPL-3.0-or-later
"""The photon pass by the native core, in one call."""

from __future__ import annotations

import photon_stream_native as native

from ..streams import Device
from .deposits import HostDeposits
from .geometry import Frame, Mesh, light_table, material_table
from .needs import SceneNeeds
from .scene import Scene
from .settings import Settings


class NativePhotonMapper:
    """What PhotonMapper does, by the native core: the same photons to rounding."""

    def __init__(
        self,
        device: Device,
        scene: Scene,
        frame: Frame,
        mesh: Mesh,
        settings: Settings,
        needs: SceneNeeds,
        triangles: native.Tracer,
    ) -> None:
        """`triangles`: those of `mesh`."""
        self._settings, self._needs, self._triangles = settings, needs, triangles
        self._tables = (
            mesh.normals,
            material_table(scene.materials),
            light_table(scene.lights, frame),
        )
        self._launches = 0
        self.deposits = HostDeposits(device)
        self.unfinished = 0  # photons that the bounce limit cut off, over all passes

    def trace(self, index: int, photons: int | None = None) -> HostDeposits:
        """As PhotonMapper.trace."""
        self.start(index, photons)
        return self.finish()

    def finish(self) -> HostDeposits:
        """As PhotonMapper.finish."""
        return self.deposits

    def start(self, index: int, photons: int | None = None) -> None:
        """Trace a pass."""
        self._launches += 1
        self.deposits.clear()
        place, deposit, unfinished = self._triangles.photons(
            *self._tables,
            seed=self._settings.seed,
            pass_index=index,
            photons=self._settings.photons_a_pass if photons is None else photons,
            bounces=self._needs.photon_bounces,
            first_hits=self._settings.direct_by_photons,
        )
        self.deposits.extend(place, deposit)
        self.unfinished += unfinished

    def launches(self) -> dict[str, int]:
        """How many passes were traced."""
        return {"photons": self._launches}

    def release(self) -> None:
        """Free what is on the device."""
        self.deposits.release()
