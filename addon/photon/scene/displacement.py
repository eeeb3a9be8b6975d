# SPDX-License-Identifier: GPL-3.0-or-later
"""How nodes of a material move the surface that wears it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from .checks import RGB, check_finite
from .programs import Program, Result, check_program, read_program


@dataclass(frozen=True)
class Displacement:
    """Move the vertices of triangles, each as the program says at a corner of the first of them."""

    way: Result | RGB  # in world space [m]
    program: Program = ()
    # Whether normals become those of the surface where it is then; else they stay, and a bump bends
    # them.
    turns_normals: bool = True
    smooths: bool = False  # flat triangles, whose normals become those of their vertices before

    def check(self, who: str) -> None:
        """Raise SceneError naming the owner and the first thing that is wrong."""
        if isinstance(self.way, Result):
            check_program(who, self.program, [{"way": self.way}])
        else:
            check_finite(f"{who}: way", self.way)

    @staticmethod
    def read(values: Mapping[str, Any] | None) -> Displacement | None:
        """One from a snapshot's header."""
        if values is None:
            return None
        way = values["way"]
        own = Result(**way) if isinstance(way, Mapping) else tuple(way)
        return Displacement(
            own, read_program(values["program"]), values["turns_normals"], values["smooths"]
        )
