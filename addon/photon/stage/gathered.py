# SPDX-License-Identifier: GPL-3.0-or-later
"""Which lobes photons are gathered with (glsl/lib/gathered.glsl)."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from ..scene import CAUSTICS, RAY_BITS, TRANSPARENT, Light, Lobe, Material, Scene
from ..settings import Settings
from .kinds import light_kinds, lobe_kinds

# Roughness from which on photons are gathered with a share of a lobe, and with all of it. Sharper
# lobes see few of the photons about a point, and most light by a ray. As float32 has them, which
# lobes come in: one that is just as rough gathers nothing.
GATHERED_FROM, GATHERED_WHOLLY = float(np.float32(0.4)), 0.5
BLEND = {"GATHERED_FROM": GATHERED_FROM, "GATHERED_WHOLLY": GATHERED_WHOLLY}
# The same of what the eye sees itself, where the picture is denoised: what a pixel's own ray misses
# is noise to a denoiser, what photons miss that neighbours share is not.
SEEN_GATHERED_FROM, SEEN_GATHERED_WHOLLY = 0.6, 0.8
SEEN_BLEND = {
    "SEEN_GATHERED_FROM": SEEN_GATHERED_FROM,
    "SEEN_GATHERED_WHOLLY": SEEN_GATHERED_WHOLLY,
}


def _roughness(lobe: Lobe) -> tuple[float, float]:
    """The least and the most that it may be where the lobe gathers; 0 of one that never does."""
    return (0.0, 0.0) if lobe_kinds()[lobe.kind].sends_rays else lobe.roughness


def gather_some(material: Material) -> bool:
    """Whether photons are gathered with any of its lobes, wholly or in part."""
    return any(map(_gathers, material.lobes))


def gathering_kinds(materials: Collection[Material]) -> frozenset[str]:
    """The kinds of these materials' lobes that photons are gathered with."""
    return frozenset(x.kind for material in materials for x in material.lobes if _gathers(x))


def _gathers(lobe: Lobe) -> bool:
    return lobe.reflects and _roughness(lobe)[1] > GATHERED_FROM


def seen_send_rays(scene: Scene, settings: Settings, materials: Collection[Material]) -> bool:
    """Whether lobes that the eye sees itself send rays, up to SEEN_BLEND.

    Not where rays would miss what photons bring: a lamp of no size that sharp lobes of some of
    these materials show, or all that no shadow ray finds.
    """
    if not settings.denoise or settings.direct_by_photons:
        return False
    lamps = (light for light in scene.lights if light.lights_surfaces)
    if all(map(_is_met, lamps)):
        return True
    return not any(_is_sharp(lobe) for material in materials for lobe in material.lobes)


def send_rays(material: Material, seen: bool) -> bool:
    """Whether any of its lobes, or a part of one, sends rays where others gather; `seen`: as
    `seen_send_rays` says."""
    return any(lobe.reflects and _sends_rays(lobe, seen) for lobe in material.lobes)


def _sends_rays(lobe: Lobe, seen: bool) -> bool:
    wholly = SEEN_GATHERED_WHOLLY if seen and not _is_diffuse(lobe) else GATHERED_WHOLLY
    return _roughness(lobe)[0] < wholly


def _is_met(lamp: Light) -> bool:
    """Whether rays of lobes meet it by chance."""
    return lamp.is_met_by_lobes and light_kinds()[lamp.kind].is_met(lamp.parameters)


def _is_sharp(lobe: Lobe) -> bool:
    """Whether it throws caustics that are followed by rays, not gathered."""
    is_caster = lobe.reflects and not _is_diffuse(lobe) and lobe.kind != TRANSPARENT
    return is_caster and _roughness(lobe)[0] < GATHERED_FROM


def _is_diffuse(lobe: Lobe) -> bool:
    return lobe_kinds()[lobe.kind].is_diffuse


def _is_met_by_rays_alone(light: Light) -> bool:
    """Whether lobes reflect it where their rays meet it, and no shadow ray finds it for them."""
    found = set(light.found_by)
    ways = (("chains", "glossy"), ("passing", "transmission"))
    return any(ray in found and shadow not in found for ray, shadow in ways)


def _are_told_apart(scene: Scene, materials: Collection[Material]) -> bool:
    """Whether rays of diffuse lobes and of others meet other surfaces, or other light: a photon
    that has landed does not say which of these may have found it."""
    diffuse, glossy = (scene.visible & RAY_BITS[ray] > 0 for ray in ("diffuse", "glossy"))
    if (diffuse != glossy).any():
        return True
    broad = (lobe for material in materials if gather_some(material) for lobe in material.lobes)
    lacking = len(scene.caustics) < len(CAUSTICS)
    return lacking and not all(map(_is_diffuse, broad))


def can_gather(scene: Scene, settings: Settings, materials: Collection[Material]) -> bool:
    """Whether photons are gathered with lobes of these materials, if there are photons."""
    return (
        settings.photons_a_pass > 0
        and settings.mirror_depth > 0
        and settings.estimator != "splat"  # a splat knows no lobes
        and not any(map(_is_met_by_rays_alone, scene.lights))
        and any(map(gather_some, materials))
        and not _are_told_apart(scene, materials)
    )
