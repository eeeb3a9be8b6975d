# SPDX-License-Identifier: GPL-3.0-or-later
"""Programs beside that of a material's surface, which are asked before a scene is lit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from ...photon.scene import Material, Result
from ...photon.scene.programs import Program
from ...photon.stage.programs import MOST_REGISTERS, width_of
from .graph import Graph


def own_program(
    graph: Graph, what: str, results: Mapping[str, Result]
) -> tuple[Program, dict[str, Result]] | None:
    """The instructions of a graph that some results need, and these results of them; None if they
    need too many registers, which is noted of `what`."""
    program, numbers = graph.program.pruned(results.values())
    moved = {name: replace(x, instruction=numbers[x.instruction]) for name, x in results.items()}
    width = width_of(Material("", program=program, varying=moved))
    if width > MOST_REGISTERS:
        text = f"its nodes hold {width} values at a time, {MOST_REGISTERS} are possible: none"
        graph.notes.approximated(graph.owner, what, text)
        return None
    return program, moved
