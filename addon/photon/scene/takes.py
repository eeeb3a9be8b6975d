# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene that no single render shows, as several: of a light group each, of light that is taken
away, and for shadow catchers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .checks import BLACK
from .lights import GLOW, Light
from .materials import TRANSPARENT, Lobe, Material
from .values import Scene
from .visibility import CATCHER, HOLDOUT, RAY_BITS

# What of the picture a take shows. Without catchers all of it. With them what the eye sees first:
# other things; or the catchers, with the others about, or as if these were not there; or the
# background, which catchers show whatever else is behind them.
Part = Literal["all", "others", "caught", "alone", "behind"]
WORLDS = ("world", "environment")  # kinds


@dataclass(frozen=True)
class Take:
    """A scene to render, and what its picture is of the whole one."""

    scene: Scene
    part: Part
    group: str  # of Scene.light_groups; "": of none of them, or of all
    sign: float  # -1: of light that is taken away


def takes_of(scene: Scene, is_transparent: bool) -> tuple[Take, ...]:
    """The takes, one at least; of a scene that needs no more the scene itself. `is_transparent`:
    its background."""
    catches = _catches(scene)
    takes_away = any(light.subtracts for light in scene.emitters)
    if not (catches.any() or takes_away or scene.light_groups):
        return (Take(scene, "all", "", 1.0),)
    if not catches.any():
        return tuple(_lit(scene, "all", scene.light_groups))
    camera = np.uint8(RAY_BITS["camera"])
    bits = scene.visible & ~np.uint8(CATCHER)
    dark = replace(scene, lights=tuple(filter(_lights, (x.unseen for x in scene.lights))))
    hidden = bits | np.uint8(HOLDOUT)
    takes = _lit(_seen(scene, np.where(catches, hidden, bits)), "others", scene.light_groups)
    found = [*takes]
    found += _lit(_seen(dark, np.where(catches, bits, hidden)), "caught", ())
    only_seen = (bits & camera) | np.uint8(HOLDOUT)
    alone = _emitting_only(dark, catches)  # what else is emissive is among the other things
    found += _lit(_seen(alone, np.where(catches, bits, only_seen)), "alone", ())
    if not is_transparent:
        sky = tuple(light for light in scene.lights if light.kind in WORLDS)
        sky = tuple(replace(x, found_by=("camera",)) for x in sky if "camera" in x.found_by)
        bare = _emitting_only(replace(scene, lights=sky), np.zeros(len(scene.surfaces), bool))
        # What goes on behind a transparent surface is no camera's ray, and meets nothing.
        found += _lit(_seen(_clear(bare, catches), bits & camera), "behind", ())
    return tuple(found)


def _catches(scene: Scene) -> NDArray[np.bool_]:
    """(S,) of each surface."""
    if not len(scene.visible):
        return np.zeros(len(scene.surfaces), bool)
    caught: NDArray[np.bool_] = (scene.visible & CATCHER) != 0
    return caught


def _seen(scene: Scene, visible: NDArray[np.uint8]) -> Scene:
    return replace(scene, visible=visible.astype(np.uint8))


def _lights(light: Light) -> bool:
    return light.is_asked or light.is_met_by_lobes


def _lit(scene: Scene, part: Part, groups: tuple[str, ...]) -> Iterator[Take]:
    """Takes by the groups' lights and by all others, one at least."""
    plain = replace(scene, light_groups=(), surface_groups=())
    of_surfaces = scene.surface_groups or ("",) * len(scene.surfaces)
    all_emissive = _emissive(scene)
    is_first = True
    for group in (*groups, ""):
        for sign in (1.0, -1.0):
            subtracts = sign < 0.0
            lights = tuple(
                replace(light, subtracts=False, group="")
                for light in scene.emitters
                if light.subtracts == subtracts and _group_of(light.group, groups) == group
            )
            member = [_group_of(name, groups) == group for name in of_surfaces]
            shines = np.array(member, bool) & (not subtracts)
            is_last = group == "" and subtracts and is_first
            if not (lights or (shines & all_emissive).any() or is_last):
                continue
            is_first = False
            yield Take(_emitting_only(replace(plain, lights=lights), shines), part, group, sign)


def _group_of(name: str, groups: tuple[str, ...]) -> str:
    return name if name in groups else ""


def _emissive(scene: Scene) -> NDArray[np.bool_]:
    """(S,): which surfaces have emissive triangles, or such about what emits."""
    emissive = np.array([material.emits for material in scene.materials], bool)
    found = np.zeros(len(scene.surfaces), bool)
    if emissive.any():
        found[scene.surface[emissive[scene.material]]] = True
    return found


def _emitting_only(scene: Scene, shines: NDArray[np.bool_]) -> Scene:
    """The scene in which of emissive surfaces only such (S,) emit."""
    if shines[_emissive(scene)].all():
        return scene
    lights = tuple(x for x in scene.lights if x.kind != GLOW or shines[_surface_of(x)])
    scene = replace(scene, lights=lights)
    off = ~shines[scene.surface]
    material, materials = scene.material.copy(), [*scene.materials]
    for number, one in enumerate(scene.materials):
        chosen = off & (scene.material == number)
        if one.emits and chosen.any():
            material[chosen] = len(materials)
            materials.append(_dark(one))
    return replace(scene, material=material, materials=tuple(materials))


def _surface_of(lamp: Light) -> int:
    """Whose medium it is a part of."""
    surface = lamp.parameters["surface"]
    assert isinstance(surface, float)
    return int(surface)


def _clear(scene: Scene, which: NDArray[np.bool_]) -> Scene:
    """The scene in which surfaces (S,) let all through."""
    material = np.where(which[scene.surface], len(scene.materials), scene.material)
    clear = Material("clear", BLACK, (Lobe(TRANSPARENT, (1.0, 1.0, 1.0)),))
    materials = (*scene.materials, clear)
    return replace(scene, material=material.astype(scene.material.dtype), materials=materials)


def _dark(material: Material) -> Material:
    varying = {name: value for name, value in material.varying.items() if name != "emission"}
    medium = replace(material.medium, emission=BLACK)
    return replace(material, emission=BLACK, varying=varying, medium=medium)
