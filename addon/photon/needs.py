# SPDX-License-Identifier: GPL-3.0-or-later
"""SceneNeeds: what a scene has a use for. Nothing else is compiled, allocated or run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .geometry import Mesh, emitted_flux
from .scene import Scene
from .settings import Settings


@dataclass(frozen=True)
class SceneNeeds:
    """The scene summed up once; the pipeline is built from it."""

    surfaces: bool  # there are triangles to see
    lights: tuple[int, ...]  # lights that emit, for direct light; none if photons carry it
    hidden_highlights: bool  # photons carry the direct light, and lobes would have reflected it
    photons: bool  # light can reach a diffuse surface by a path that photons stand for
    mirror: bool  # a surface sends secondary rays
    mirror_depth: int
    photon_bounces: int

    @staticmethod
    def of(scene: Scene, settings: Settings, mesh: Mesh) -> SceneNeeds:
        """Look at lights, and at the materials of the triangles that were kept."""
        surfaces = len(mesh.corners) > 0
        used = np.unique(mesh.corners[:, 0, 3].astype(int)) if surfaces else []
        materials = [scene.materials[i] for i in used]
        diffuse = any(max(m.diffuse) > 0 for m in materials)
        specular = any(max(m.specular) > 0 for m in materials)
        lobes = any(max(m.specular) > 0 and np.isfinite(m.exponent) for m in materials)
        emitting = tuple(i for i, x in enumerate(scene.lights) if emitted_flux(x).max() > 0)
        return SceneNeeds(
            surfaces=surfaces,
            lights=emitting if (diffuse or lobes) and not settings.direct_by_photons else (),
            hidden_highlights=bool(emitting) and lobes and settings.direct_by_photons,
            photons=bool(emitting) and diffuse and settings.photons_a_pass > 0,
            mirror=specular and settings.mirror_depth > 0,
            mirror_depth=settings.mirror_depth,
            photon_bounces=settings.photon_bounces,
        )
