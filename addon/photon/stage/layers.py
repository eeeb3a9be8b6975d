# SPDX-License-Identifier: GPL-3.0-or-later
"""Lobes that lie over others (glsl/lib/material_lobes.glsl)."""

from __future__ import annotations

from ..scene import Lobe, Material, reflecting
from .kinds import lobe_kinds

WHITE = (1.0, 1.0, 1.0)


def count_layered(material: Material) -> int:
    """How many lobes it has, if some lie over others."""
    lobes = reflecting(material.lobes)
    return len(lobes) if any(lobe.over is not None for lobe in lobes) else 0


def has_tint(material: Material) -> bool:
    """Whether other lobes lie under one that colours what it lets through."""
    lobes = reflecting(material.lobes)
    return any(lobe.over is not None and _tints(lobes[lobe.over]) for lobe in lobes)


def _tints(lobe: Lobe) -> bool:
    return "transmittance" in lobe_kinds()[lobe.kind].verbs and (
        lobe.colour != WHITE or "colour" in lobe.varying
    )
