# SPDX-License-Identifier: GPL-3.0-or-later
"""Which lobes photons are gathered with (glsl/lib/gathered.glsl)."""

from __future__ import annotations

from collections.abc import Collection

from ..scene import CAUSTICS, RAY_BITS, Light, Lobe, Material, Scene
from ..settings import Settings
from .kinds import lobe_kinds

# Roughness from which on photons are gathered with a share of a lobe, and with all of it. Sharper
# lobes see few of the photons about a point, and most light by a ray.
GATHERED_FROM, GATHERED_WHOLLY = 0.4, 0.5
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
    return any(lobe.reflects and _roughness(lobe)[1] > GATHERED_FROM for lobe in material.lobes)


def send_rays(material: Material, settings: Settings) -> bool:
    """Whether any of its lobes, or a part of one, sends rays where others gather."""
    wholly = SEEN_GATHERED_WHOLLY if settings.denoise else GATHERED_WHOLLY
    return any(lobe.reflects and _roughness(lobe)[0] < wholly for lobe in material.lobes)


def _is_met_by_rays_alone(light: Light) -> bool:
    """Whether lobes reflect it where their rays meet it, and no shadow ray finds it for them."""
    return "chains" in light.found_by and "glossy" not in light.found_by


def _are_told_apart(scene: Scene, materials: Collection[Material]) -> bool:
    """Whether rays of diffuse lobes and of others meet other surfaces, or other light: a photon
    that has landed does not say which of these may have found it."""
    diffuse, glossy = (scene.visible & RAY_BITS[ray] > 0 for ray in ("diffuse", "glossy"))
    if (diffuse != glossy).any():
        return True
    broad = (lobe for material in materials if gather_some(material) for lobe in material.lobes)
    lacking = len(scene.caustics) < len(CAUSTICS)
    return lacking and not all(lobe_kinds()[lobe.kind].is_diffuse for lobe in broad)


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
