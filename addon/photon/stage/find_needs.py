# SPDX-License-Identifier: GPL-3.0-or-later
"""What a scene has a use for: looked for once, before its programs are made."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from ..scene import ALL_RAYS, SUBSURFACE, TRANSPARENT, Light, Material, Result, Scene
from ..settings import Settings
from .emissive import TRIANGLE, emissive_triangles, emits_for_some_only
from .gathered import can_gather, gathering_kinds, seen_send_rays, send_rays
from .geometry import Mesh
from .kinds import PHASE, light_kinds, lobe_kinds
from .layers import count_layered, has_tint
from .light_tree import AskedLights
from .limits import are_apart, are_linked, casts_caustics, is_limited, lacking_caustics
from .media import MediaThere
from .needs import MOST_LOBES, SceneNeeds
from .panes import has_panes
from .programs import ProgramNeeds, of_emission, of_transmittance

MOST_BOUNDS = 256  # of media that a path may pass


def find_needs(
    scene: Scene,
    settings: Settings,
    mesh: Mesh,
    emitting: tuple[Light, ...],
    asked_lights: AskedLights,
) -> SceneNeeds:
    """Look at the lamps that emit, at the lights that visible points ask, and at the materials of
    the triangles that were kept."""
    materials = _used(scene, mesh)
    diffuse = any(material.is_diffuse for material in materials)
    lobes = [[lobe.kind for lobe in m.lobes if lobe.reflects] for m in materials]
    media = MediaThere.of(scene, materials)
    lobes += [[PHASE]] * media.scattering
    kinds = {kind for of_one in lobes for kind in of_one}
    broad = any(not lobe_kinds()[kind].is_delta for kind in kinds)
    emissive = len(emissive_triangles(scene, mesh)) > 0
    lighting = emissive or any(light.is_asked for light in emitting)
    asked = lighting and (diffuse or broad) and not settings.direct_by_photons
    gathered = lighting and can_gather(scene, settings, materials)
    seen = gathered and seen_send_rays(scene, settings, materials)
    sends = media.scattering or any(send_rays(m, seen) for m in materials)
    rays = bool(kinds) and (sends or not gathered)
    transparent = any(material.is_transparent for material in materials)
    chains = (rays and settings.mirror_depth > 0) or transparent
    met = [light for light in emitting if light_kinds()[light.kind].is_met(light.parameters)]
    glows = emissive or media.glowing  # and rays of lobes meet it
    by_chains = chains and (glows or any(light.is_met_by_lobes for light in met))
    of_mesh = frozenset({TRIANGLE} if emissive else ())
    photons = lighting and (diffuse or gathered) and settings.photons_a_pass > 0
    return SceneNeeds(
        surfaces=len(mesh.triangles) > 0,
        shadow_rays=asked_lights.rays if asked else 0,
        drawn_rays=asked_lights.drawn,
        hidden_highlights=lighting and broad and settings.direct_by_photons,
        photons=photons,
        panes=asked and photons and has_panes(scene, mesh, emitting),
        caustics=photons and settings.caustics and any(map(casts_caustics, kinds)),
        secondary_rays=chains,
        emitters_seen=by_chains or glows or any("camera" in x.found_by for x in met),
        emissive=emissive,
        weighed=asked
        and broad
        and by_chains
        and (glows or any(not {"glossy", "transmission"}.isdisjoint(x.found_by) for x in met)),
        transparent_depth=settings.transparent_depth + _bounds_met(scene) if transparent else 0,
        shadow_programs=_programs_of(scene, materials, of_transmittance),
        light_kinds=of_mesh | {light.kind for light in emitting},
        gathered_lobes=gathered,
        seen_send_rays=seen,
        portals=asked and photons and any(light_kinds()[light.kind].is_world for light in emitting),
        programs=ProgramNeeds.of(scene),
        emission_programs=_programs_of(scene, materials if emissive else (), of_emission),
        **_of_lights(scene, mesh, emitting),
        **_of_rays(scene, mesh, materials, kinds, emitting),
        **_of_mesh(scene, mesh),
        **_of_materials(materials, lobes, media),
        **_of_settings(settings),
        **_of_camera(scene),
    )


def _of_rays(
    scene: Scene,
    mesh: Mesh,
    materials: Iterable[Material],
    kinds: Iterable[str],
    emitting: tuple[Light, ...],
) -> dict[str, Any]:
    """Whether not all rays meet all surfaces, or find all lights."""
    lobes = [lobe_kinds()[kind] for kind in kinds]
    no_caustics = lacking_caustics(scene, lobes)
    sent = [kind for kind in lobes if kind.name != TRANSPARENT]
    kinds_of_rays = any(x.is_diffuse for x in sent), any(x.transmits for x in sent)
    rays_apart = are_apart(emitting, *kinds_of_rays)
    return {
        "no_caustics": no_caustics,
        "rays_apart": rays_apart,
        "visibility": is_limited(emitting)
        or are_linked(scene, emitting)
        or bool((mesh.visible != ALL_RAYS).any())
        or any(material.holdout or material.is_transparent for material in materials)
        or rays_apart
        or no_caustics > 0,
    }


def _bounds_met(scene: Scene) -> int:
    """How often a path may meet what is nothing but the bounds of media, which Cycles does not
    count: in and out, and some times there and back."""
    bounds = np.array([material.only_bounds for material in scene.materials], bool)
    surfaces = np.unique(scene.surface[bounds[scene.material]]) if bounds.any() else ()
    return min(8 * len(surfaces), MOST_BOUNDS)


def _used(scene: Scene, mesh: Mesh) -> list[Material]:
    """The materials of the triangles that were kept."""
    if not len(mesh.triangles):
        return []
    shown = scene.material if scene.moving else mesh.triangles["material"].astype(int)
    return [scene.materials[number] for number in np.unique(shown)]


def _programs_of(
    scene: Scene, materials: Sequence[Material], asked: Callable[[Material], list[Result]]
) -> ProgramNeeds:
    """What programs need that tell some results; nothing where none of these materials has any."""
    return ProgramNeeds.of_some(scene, asked) if any(map(asked, materials)) else ProgramNeeds()


def _of_lights(scene: Scene, mesh: Mesh, emitting: tuple[Light, ...]) -> dict[str, Any]:
    """What hangs on the lamps that emit, and on emissive meshes, alone."""
    for_some = any(light.cares_who_is_lit for light in emitting if light.is_asked)
    return {
        "profiles": any(light.profile for light in emitting),
        "gobos": any(light.gobo is not None for light in emitting),
        "arrivals": for_some or emits_for_some_only(scene, mesh),
        "linked": are_linked(scene, emitting),
    }


def _of_mesh(scene: Scene, mesh: Mesh) -> dict[str, Any]:
    """What hangs on its normals and tangents."""
    return {
        "tangents": len(mesh.tangents) > 0,
        "smooth": any(bool((mesh.normals["a"] != mesh.normals[x]).any()) for x in "bc")
        or any(one.normals.size > 0 for one in scene.moving),
    }


def _of_materials(
    materials: Sequence[Material], lobes: Sequence[Sequence[str]], media: MediaThere
) -> dict[str, Any]:
    """What hangs on them alone; `lobes` are the kinds of each one's, and of media."""
    kinds = {kind for of_one in lobes for kind in of_one}
    return {
        "media": media.any,
        "scattering": media.scattering,
        "varying": media.varying,
        "glowing": media.glowing,
        "too_bright": any(material.may_be_too_bright for material in materials),
        "shaded_lamps": any(material.filters_no_lamps for material in materials),
        "lobes": min(max(map(len, lobes), default=0), MOST_LOBES),
        "lobe_kinds": frozenset(kinds),
        "gathering_kinds": gathering_kinds(materials),
        "layers": max(map(count_layered, materials), default=0),
        "covers": any(
            lobe.may_be("covered") or (lobe.kind == SUBSURFACE and lobe.over is not None)
            for m in materials
            for lobe in m.lobes
        ),
        # What disperses light weighs each channel by itself, too.
        "tinted": any(map(has_tint, materials)) or any(lobe_kinds()[x].disperses for x in kinds),
    }


def _of_settings(settings: Settings) -> dict[str, Any]:
    """What hangs on them alone."""
    return {
        "chain_depth": settings.mirror_depth,
        "photon_bounces": settings.photon_bounces,
        "illuminance": settings.illuminance,
        "mist": settings.mist is not None,
        "features": settings.denoise or settings.denoising_data,
        "first_hits": settings.direct_by_photons,
        "clamped": settings.clamp_direct > 0.0 or settings.clamp_indirect > 0.0,
    }


def _of_camera(scene: Scene) -> dict[str, Any]:
    camera = scene.camera
    return {
        "camera_kind": camera.kind.lower(),
        "lens": camera.lens is not None,
        "moves": camera.motion is not None or bool(scene.moving),
        "panorama": camera.is_panorama,
    }
