# SPDX-License-Identifier: GPL-3.0-or-later
"""The photon pass by the native core, in one call."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any, Protocol

import numpy as np
import photon_stream_native as native
from numpy.typing import NDArray

from ...streams import Device
from ..kernels.records import PLAIN_LIGHT, PLAIN_MATERIAL
from ..scene import Material, Scene
from ..settings import Settings
from ..stage.aims import Aims
from ..stage.gathered import gather_some
from ..stage.geometry import Mesh
from ..stage.kinds import light_kinds, lobe_kinds
from ..stage.needs import SceneNeeds
from ..stage.tables import Tables
from ..stage.upload import texels_of
from .deposits import HostDeposits
from .mapper import PhotonBatch

# The kinds of lobes and lights that the native core knows; for scenes of others, or of several
# lobes at a point, PhotonMapper runs the GLSL.
LOBES = frozenset({"mirror", "phong"})
LIGHTS = frozenset({"point", "spot"})


def knows_lobes(lobes: int, kinds: Collection[str]) -> bool:
    """Whether the native core can gather photons with so many lobes a point, of these kinds."""
    return lobes <= 1 and LOBES.issuperset(kinds)


def leaves_lobes(lobes: int, kinds: Collection[str], gathering: Collection[str]) -> bool:
    """Whether GLSL gathers photons with some of these, as those that gather are neither lobes that
    it knows nor microfacets."""
    known = all("microfacets" in lobe_kinds()[kind].verbs for kind in gathering)
    return not knows_lobes(lobes, kinds) and not known


def knows(scene: Scene, needs: SceneNeeds) -> bool:
    """Whether the native core can trace a scene's photons."""
    lobes = [lobe for material in scene.materials for lobe in material.lobes if lobe.reflects]
    if needs.visibility or needs.carries_medium or needs.programs.nodes or needs.caustics:
        return False
    plain = all(lobe.weight == 1.0 and not any(lobe.covered) for lobe in lobes)
    if (
        needs.arrivals
        or needs.profiles
        or needs.gobos
        or any(light.is_stretched for light in scene.lights)
    ):
        return False
    return plain and knows_lobes(needs.lobes, needs.lobe_kinds) and needs.light_kinds <= LIGHTS


class Triangles(Protocol):
    """A scene's, where they are now."""

    tracer: native.Tracer
    mesh: Mesh


class NativePhotonMapper:
    """What PhotonMapper does for the scenes that the native core knows: the same photons to
    rounding, sooner."""

    def __init__(
        self,
        device: Device,
        scene: Scene,
        tables: Tables,
        settings: Settings,
        needs: SceneNeeds,
        triangles: Triangles,
    ) -> None:
        self._settings, self._needs, self._triangles = settings, needs, triangles
        self._tables = tables
        self._materials = _plain(_materials(scene.materials, needs.gathered_lobes))
        self._launches = 0
        self.deposits = HostDeposits(device)
        self.unfinished = 0  # photons that the bounce limit cut off, over all passes

    def finish(self) -> HostDeposits:
        """As PhotonMapper.finish."""
        return self.deposits

    def rays(self, index: int, photons: int) -> NDArray[np.float32]:
        """As PhotonMapper.rays."""
        lights, seed = _plain(_lights(self._tables.lights)), self._settings.seed
        return self._triangles.tracer.photon_starts(
            lights, seed, index, photons, **_aims(self._tables.aims)
        )

    def start(self, batch: PhotonBatch) -> None:
        """Trace a batch."""
        portals = self._tables.photon_portals
        self._launches += 1
        self.deposits.clear()
        place, deposit, unfinished = self._triangles.tracer.photons(
            _plain(self._triangles.mesh.normals),
            self._materials,
            _plain(_lights(self._tables.lights)),
            seed=self._settings.seed,
            pass_index=batch.index,
            photons=batch.photons,
            bounces=self._needs.photon_bounces,
            first_hits=batch.first_to_deposit(self._settings) == 0,
            directions=self._needs.gathered_lobes,
            numbered=batch.numbered,
            **_aims(self._tables.aims),
            portals=texels_of(portals).reshape(-1, 3, 4) if len(portals) else None,
        )
        self.deposits.extend(place, deposit)
        self.unfinished += unfinished

    def launches(self) -> dict[str, int]:
        """How many passes were traced."""
        return {"photons": self._launches}

    def release(self) -> None:
        """Free what is on the device."""
        self.deposits.release()


def _aims(aims: Aims | None) -> dict[str, Any]:
    """As the native core takes them."""
    return {"aims": texels_of(aims.lights), "aim_nodes": texels_of(aims.nodes)} if aims else {}


def _plain(table: NDArray[Any]) -> NDArray[np.float32]:
    return table.view(np.float32).reshape(len(table), -1, 4)


def _materials(materials: tuple[Material, ...], gathered_lobes: bool = False) -> NDArray[Any]:
    """(M,) of PLAIN_MATERIAL, one at least."""
    table = PLAIN_MATERIAL.zeros(max(len(materials), 1))
    for row, material in zip(table, (made.conserving() for made in materials), strict=False):
        row["diffuse"] = material.diffuse
        row["gathers"] = gathered_lobes and gather_some(material)
        for lobe in material.lobes:
            if lobe.reflects:
                row["specular"] = lobe.colour
                row["exponent"] = lobe.parameters.get("exponent", -1.0)
    return table


def _lights(lights: NDArray[Any]) -> NDArray[Any]:
    """(L,) of PLAIN_LIGHT from LIGHT: a point light is a spot whose inner cone is everywhere."""
    table = PLAIN_LIGHT.zeros(len(lights))
    for name in ("position", "axis", "power", "chosen", "cdf"):
        table[name] = lights[name]
    is_spot = lights["kind"] == light_kinds()["spot"].number
    table["radius"] = lights["parameters"][:, 0]
    table["outer"] = np.where(is_spot, lights["parameters"][:, 2], 2.0)
    table["inner"] = np.where(is_spot, lights["parameters"][:, 3], 2.0)
    return table
