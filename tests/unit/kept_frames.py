# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames of an animation in which one thing changes, for tests of what is kept between renders."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from addon.photon.photons.kept import Kept
from addon.photon.prepare import prepare
from addon.photon.scene import TRANSPARENT, Lobe, Scene, phong
from addon.photon.settings import Settings
from addon.streams import Device
from tests.scenes import backdrop, with_cone

SETTINGS = Settings(width=16, height=12, passes=2, photons=1500, photon_bounces=3)
ALL = SETTINGS.passes  # the first one finds the radii, too
WAYS = [
    ("native", "gather", True),
    ("fragment", "splat", True),
    ("compute", "gather", False),  # as on a GPU: the deposits stay on the device
    ("compute", "splat", False),
]


class Frame(NamedTuple):
    """What a render gave."""

    traced: int  # passes of photons
    images: dict[str, bytes]
    info: dict[str, Any]  # but the time


def render(
    device: Device, scene: Scene, settings: Settings = SETTINGS, kept: Kept | None = None
) -> Frame:
    renderer = prepare(scene, settings, device, kept)
    try:
        for _ in range(settings.passes):
            renderer.render_pass()
        images = {name: image.tobytes() for name, image in renderer.images().items()}
        info = {name: value for name, value in renderer.info().items() if name != "seconds"}
        # A pass begins with the one or the other, kernel by kernel or natively.
        launches = renderer.launches()
        traced = launches.get("generator", 0) + launches.get("photons", 0)
        return Frame(traced, images, info)
    finally:
        renderer.release()


def moved(scene: Scene, by: float) -> Scene:
    """The camera goes along the room."""
    matrix = scene.camera.matrix.copy()
    matrix[0, 3] += by
    return replace(scene, camera=replace(scene.camera, matrix=matrix))


def relit(scene: Scene, **changes: Any) -> Scene:
    """The light is another."""
    return replace(scene, lights=(replace(scene.lights[0], **changes),))


def repainted(scene: Scene, **changes: Any) -> Scene:
    """The first material is another."""
    return replace(scene, materials=(replace(scene.materials[0], **changes), *scene.materials[1:]))


def pushed(scene: Scene, by: float) -> Scene:
    """The last object, the sphere, lies elsewhere."""
    vertices = scene.vertices.copy()
    vertices[np.unique(scene.triangles[scene.surface == scene.surface.max()])] += (0.0, by, 0.0)
    return replace(scene, vertices=vertices)


def widened(scene: Scene, radius: float) -> Scene:
    """The light is a sphere."""
    return relit(scene, parameters=dict(scene.lights[0].parameters) | {"radius": radius})


def tilted(scene: Scene, by: float) -> Scene:
    """The shading normals are others."""
    normals = scene.corner_normals + np.float32([by, 0.0, 0.0])
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    return replace(scene, corner_normals=normals)


SceneStep = tuple[str, Callable[[Scene], Scene], bool]  # what changes, and whether photons do
SCENE_STEPS: list[SceneStep] = [
    ("nothing", lambda s: s, False),
    ("camera", lambda s: moved(s, 0.7), False),
    ("lens", lambda s: replace(s, camera=replace(s.camera, window=(-0.5, 0.4, -0.3, 0.3))), False),
    ("a world", lambda s: replace(s, lights=(*s.lights, *backdrop((0.1, 0.2, 0.3)))), True),
    ("light's place", lambda s: relit(s, position=(4.0, 5.0, 9.9)), True),
    ("camera again", lambda s: moved(s, -0.2), False),
    ("light's power", lambda s: relit(s, power=(3000.0, 2000.0, 3000.0)), True),
    ("light's cone", lambda s: replace(s, lights=(with_cone(s.lights[0], 1.5),)), True),
    ("object", lambda s: pushed(s, 0.5), True),
    ("camera once more", lambda s: moved(s, 0.3), False),
    ("material", lambda s: repainted(s, diffuse=(0.5, 0.6, 0.7)), True),
    ("gloss", lambda s: repainted(s, lobes=(phong((0.2, 0.2, 0.2), 30.0),)), True),
    ("clear", lambda s: repainted(s, lobes=(Lobe(TRANSPARENT, (0.5, 0.6, 0.7)),)), True),
    ("but not to lamps", lambda s: repainted(s, shades_lamps=True), True),
    ("normals", lambda s: tilted(s, 0.3), True),
    ("assignment", lambda s: replace(s, material=s.material[::-1].copy()), True),
    ("nothing more", lambda s: s, False),
]
