# SPDX-License-Identifier: GPL-3.0-or-later
"""Where photons start: at lights as they are, or aimed."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ...streams import ByDefines, Defines, Device, Stream
from ...streams.device import Layer
from ..kernels.generator import Generator
from ..stage.needs import SceneNeeds
from ..stage.tables import Tables


class Emission:
    """Runs the Generator; where lights are aimed another of its programs, made when they first
    are."""

    def __init__(self, device: Device, layer: Layer, tables: Tables, needs: SceneNeeds) -> None:
        self._tables, self._needs = tables, needs
        defines, made = {**needs.light_defines, **needs.photon_defines}, needs.made

        def generator(more: Defines) -> Generator:
            return Generator(device, layer, {**defines, **more}, made=made)

        self._generators = ByDefines(generator)
        self._generators.of({})

    def run(
        self, streams: Mapping[str, Stream], draw: Mapping[str, int], photons: int, passes: int = 1
    ) -> None:
        """Write origin, direction and flux of so many photons of a pass, and of as many of each
        pass after it; `draw`: what its random numbers depend on."""
        tables = self._tables
        values = {**draw, "photons": photons, "passes": passes, "light_count": len(tables.lights)}
        if tables.aims or self._needs.panes:
            values["distant_lights"] = tables.distant_lights
        aimed: Defines = {"AIMED": 1} if tables.aims else {}
        generator = self._generators.of({**aimed, **self._portals})
        generator.run(streams, tables.of(generator), values)

    @property
    def _portals(self) -> Defines:
        """With the faces of a box, where some lights send photons there."""
        return self._tables.faces_defines if self._needs.emits_by_cosine else {}

    def launches(self) -> dict[str, int]:
        """How often it has run."""
        return {Generator.stem: self._generators.launches}

    def release(self) -> None:
        """Free the programs."""
        for generator in self._generators.made():
            generator.release()


def rays_of(streams: Mapping[str, Stream]) -> NDArray[np.float32]:
    """Where photons are and where they go, (n, 6), of an Emission's streams."""
    both = [streams[name].download().reshape(-1, 4)[:, :3] for name in ("origin", "direction")]
    return np.concatenate(both, axis=1)
