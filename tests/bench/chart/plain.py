# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights and materials in the words of the engines that know the paper's alone."""

from __future__ import annotations

import math

from addon.photon.scene import MIRROR, RGB, Light, Material


def specular_of(material: Material) -> tuple[RGB, float]:
    """k_s and its Phong exponent; ValueError for what the paper does not have: other lobes, and
    what differs from point to point."""
    if material.program:
        raise ValueError(f"material {material.name!r} has textures, which are not converted")
    lobes = [lobe for lobe in material.lobes if lobe.reflects]
    if not lobes:
        return (0.0, 0.0, 0.0), MIRROR
    (lobe, *others) = lobes
    if others or lobe.kind not in ("mirror", "phong") or any(lobe.covered) or lobe.weight != 1.0:
        raise ValueError(f"material {material.name!r} has lobes that are not converted")
    return lobe.colour, lobe.parameters.get("exponent", MIRROR)


def check_converted(light: Light) -> None:
    """ValueError for lights that the paper does not have."""
    if light.kind not in ("point", "spot"):
        raise ValueError(f"light {light.name!r} is of kind {light.kind}, which is not converted")
    if light.parameters["radius"] > 0:
        raise ValueError(f"light {light.name!r} has a radius: only delta lights are converted")


def cone_of(light: Light) -> tuple[float, float]:
    """A spotlight's width [rad] and the share of it that fades."""
    outer, inner = light.parameters["outer"], light.parameters["inner"]
    return 4.0 * math.asin(math.sqrt(outer / 2.0)), 1.0 - inner / outer
