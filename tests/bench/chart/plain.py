# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights and materials in the words of the other engines: the paper's, and glass."""

from __future__ import annotations

import math
from typing import NamedTuple

from addon.photon.scene import MIRROR, RGB, Light, Material


class Glass(NamedTuple):
    """Of a Glass BSDF alone, about a body."""

    colour: RGB  # of what it reflects, and of what it lets through
    ior: float
    alpha: float  # GGX's, 0 if it is smooth


def glass_of(material: Material) -> Glass | None:
    """What a material is, if it is glass; ValueError for what differs from point to point, and for
    glass that absorbs, or is a sheet."""
    check_plain(material)
    lobes = [lobe for lobe in material.lobes if lobe.reflects]
    if [lobe.kind for lobe in lobes] not in (["glass"], ["ggx_glass"]) or any(material.diffuse):
        return None
    ((lobe,), more) = lobes, lobes[0].parameters
    both = (more["tint"], more["reflects"], more["open"], more.get("compensated", 0.0))
    if both != ((1.0, 1.0, 1.0), 2.0, 0.0, 0.0) or lobe.weight != 1.0 or material.medium.is_there:
        raise ValueError(f"material {material.name!r} is glass of a kind that is not converted")
    return Glass(lobe.colour, float(more["ior"]), float(more.get("alpha", 0.0)))


def check_plain(material: Material) -> None:
    """ValueError for what differs from point to point."""
    if material.program:
        raise ValueError(f"material {material.name!r} has textures, which are not converted")


def specular_of(material: Material) -> tuple[RGB, float]:
    """k_s and its Phong exponent; ValueError for what the paper does not have: other lobes, and
    what differs from point to point."""
    check_plain(material)
    lobes = [lobe for lobe in material.lobes if lobe.reflects]
    if not lobes:
        return (0.0, 0.0, 0.0), MIRROR
    (lobe, *others) = lobes
    if others or lobe.kind not in ("mirror", "phong") or any(lobe.covered) or lobe.weight != 1.0:
        raise ValueError(f"material {material.name!r} has lobes that are not converted")
    return lobe.colour, lobe.parameters.get("exponent", MIRROR)


def check_converted(light: Light) -> None:
    """ValueError for lights that have a size, or no equal in the other engines."""
    if light.kind not in ("point", "spot", "sun"):
        raise ValueError(f"light {light.name!r} is of kind {light.kind}, which is not converted")
    if light.parameters["widest" if light.kind == "sun" else "radius"] > 0:
        raise ValueError(f"light {light.name!r} has a radius: only delta lights are converted")


def cone_of(light: Light) -> tuple[float, float]:
    """A spotlight's width [rad] and the share of it that fades."""
    outer, inner = light.parameters["outer"], light.parameters["inner"]
    return 4.0 * math.asin(math.sqrt(outer / 2.0)), 1.0 - inner / outer
