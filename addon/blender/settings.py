# SPDX-License-Identifier: GPL-3.0-or-later
"""The one mapping from Blender's properties to the renderer's Settings."""

from __future__ import annotations

from typing import Any

import bpy

from ..photon.settings import FEWEST_PASSES, Mist, PixelFilter, Region, Settings

# By Cycles' names.
PIXEL_FILTERS: dict[str, PixelFilter] = {
    "BOX": "box",
    "GAUSSIAN": "gauss",
    "BLACKMAN_HARRIS": "blackman_harris",
}

# How thick mist is by the distance within it: to which power.
FALLOFFS = {"QUADRATIC": 2.0, "LINEAR": 1.0, "INVERSE_QUADRATIC": 0.5}


def mist_of(world: bpy.types.World | None) -> Mist:
    """That of a scene's world, as Cycles has it: whatever a view layer has instead; and where there
    is none."""
    if world is None:
        return 0.0, 100.0, 1.0
    own = world.mist_settings
    return own.start, own.depth, FALLOFFS[own.falloff]


def settings_from(
    scene: bpy.types.Scene, size: tuple[int, int], region: Region | None = None
) -> Settings:
    """Return the renderer's settings for a frame of `size` pixels."""
    p = scene.photon_stream
    seed = p.seed + scene.frame_current if p.use_animated_seed else p.seed
    return Settings(
        width=size[0],
        height=size[1],
        region=region,
        passes=p.passes,
        noise_threshold=p.noise_threshold if p.use_noise_threshold else 0.0,
        min_passes=max(p.min_passes, FEWEST_PASSES),  # older files may have fewer
        photons=p.photons if p.use_photons else None,
        radius=p.radius if p.use_radius else 0.0,
        radius_decay=p.radius_decay,
        seed=seed % (1 << 32),
        estimator=p.estimator.lower(),
        backend=p.backend.lower(),
        filter=p.filter.lower(),
        splat_shape=p.splat_shape.lower(),
        photon_bounces=p.photon_bounces,
        mirror_depth=p.mirror_depth if p.use_mirror_depth else bounces_of(scene),
        transparent_depth=transparent_bounces_of(scene),
        volume_bounces=volume_bounces_of(scene),
        boundary_correction=p.boundary_correction,
        direct_by_photons=p.direct_by_photons,
        clamp_direct=_of_cycles(scene, "sample_clamp_direct", 0.0),
        clamp_indirect=_of_cycles(scene, "sample_clamp_indirect", 0.0),
        transparent=scene.render.film_transparent,
        denoise=p.denoise,
        device_index=p.device_index,
        time_limit=p.time_limit,
        **film_of(scene),
    )


def _of_cycles(scene: bpy.types.Scene, name: str, usual: Any) -> Any:
    """Return a scene's setting that is Cycles' own; `usual` where Cycles is absent."""
    return getattr(getattr(scene, "cycles", None), name, usual)


def bounces_of(scene: bpy.types.Scene) -> int:
    """Return Cycles' Max Bounces; its default where Cycles is absent."""
    return int(_of_cycles(scene, "max_bounces", Settings.mirror_depth))


def transparent_bounces_of(scene: bpy.types.Scene) -> int:
    """Return Cycles' limit, which is the scene's; its default where Cycles is absent."""
    return int(_of_cycles(scene, "transparent_max_bounces", Settings.transparent_depth))


def volume_bounces_of(scene: bpy.types.Scene) -> int:
    """Return Cycles' limit, which is the scene's; its default where Cycles is absent."""
    return int(_of_cycles(scene, "volume_bounces", Settings.volume_bounces))


def film_of(scene: bpy.types.Scene) -> dict[str, Any]:
    """Return the settings of the film, which are Cycles' own; its defaults where it is absent."""
    kind = _of_cycles(scene, "pixel_filter_type", "BLACKMAN_HARRIS")
    return {
        "pixel_filter": PIXEL_FILTERS[kind],
        "pixel_width": _of_cycles(scene, "filter_width", 1.5),
        "exposure": _of_cycles(scene, "film_exposure", 1.0),
    }
