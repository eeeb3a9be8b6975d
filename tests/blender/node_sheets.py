# SPDX-License-Identifier: GPL-3.0-or-later
"""The cases of every node: a sheet a subject."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from . import colour_cases, info_cases, mapping_cases, procedural_cases, range_cases, vector_cases
from .node_cases import Case

SHEETS: Mapping[str, Sequence[Case]] = {
    "colours": colour_cases.CASES,
    "info": info_cases.CASES,
    "mapping": mapping_cases.CASES,
    "ranges": range_cases.CASES,
    "vectors": vector_cases.CASES,
    **procedural_cases.CASES,
}
LONG: Mapping[str, Sequence[Case]] = procedural_cases.LONG_CASES  # with --thorough
