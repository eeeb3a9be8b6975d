# SPDX-License-Identifier: GPL-3.0-or-later
"""Where photons start at lights, as tables (glsl/lib/aim.glsl)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..kernels.records import AIM_NODE, LIGHT_AIM


@dataclass(frozen=True)
class Aim:
    """Where photons of a light start that count."""

    nodes: NDArray[np.float32]  # (N, 4) as of AIM_NODE: a tree, its root first
    middle: NDArray[np.float64]  # (3,) of a light afar: what its disc is about [scene units]


class Aims:
    """Those of all lights, some of which have none."""

    def __init__(self, count: int, aims: Mapping[int, Aim]) -> None:
        """`count` lights; aims by their numbers."""
        self.by_light = dict(aims)
        self.lights = LIGHT_AIM.zeros(count)
        parts, first = [], 0
        for light, aim in sorted(aims.items()):
            self.lights[light]["middle"], self.lights[light]["root"] = aim.middle, first + 1
            nodes = aim.nodes.copy()
            nodes[nodes[:, 2] > 0.0, 2] += first
            parts.append(nodes)
            first += len(nodes)
        self.nodes: NDArray[Any] = AIM_NODE.zeros(max(first, 1))
        if parts:
            self.nodes.view(np.float32).reshape(-1, 4)[:] = np.concatenate(parts)

    def bytes(self) -> bytes:
        """All of it, for comparison."""
        return self.lights.tobytes() + self.nodes.tobytes()
