# SPDX-License-Identifier: GPL-3.0-or-later
"""Where photons start: at lights as they are, or aimed."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ...streams import Device, Stream
from ...streams.device import Layer
from ..kernels.generator import Generator
from ..stage.needs import SceneNeeds
from ..stage.tables import Tables


class Emission:
    """Runs the Generator; where lights are aimed another of its programs, made when they first
    are."""

    def __init__(self, device: Device, layer: Layer, tables: Tables, needs: SceneNeeds) -> None:
        self._device, self._layer, self._tables, self._needs = device, layer, tables, needs
        self._plain = self._generator()
        self._aimed: Generator | None = None

    def run(self, streams: Mapping[str, Stream], draw: Mapping[str, int], photons: int) -> None:
        """Write origin, direction and flux of a pass's photons; `draw`: what its random numbers
        depend on."""
        tables, generator = self._tables, self._plain
        values = {**draw, "photons": photons, "light_count": len(tables.lights)}
        if tables.aims:
            generator = self._aimed = self._aimed or self._generator({"AIMED": 1})
            values["distant_lights"] = tables.distant_lights
        generator.run(streams, tables.of(generator), values)

    def launches(self) -> dict[str, int]:
        """How often it has run."""
        both = [kernel for kernel in (self._plain, self._aimed) if kernel]
        return {Generator.stem: sum(kernel.launches for kernel in both)}

    def release(self) -> None:
        """Free the programs."""
        for kernel in (self._plain, self._aimed):
            if kernel:
                kernel.release()

    def _generator(self, more: Mapping[str, int] | None = None) -> Generator:
        needs = self._needs
        defines = {**needs.light_defines, **needs.photon_defines, **(more or {})}
        return Generator(self._device, self._layer, defines, made=needs.made)


def rays_of(streams: Mapping[str, Stream]) -> NDArray[np.float64]:
    """Where photons are and where they go, (n, 6), of an Emission's streams."""
    both = [streams[name].download().reshape(-1, 4)[:, :3] for name in ("origin", "direction")]
    rays: NDArray[np.float64] = np.concatenate(both, axis=1).astype(np.float64)
    return rays
